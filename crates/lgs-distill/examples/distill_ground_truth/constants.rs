//! Constants of laws beside those of the truth.

use lgs_data::synth::GroundTruth;
use lgs_distill::{Distilled, DistilledLaw, SceneDistillation};
use lgs_mechanics::Law;
use lgs_mechanics::terms::Term;
use std::fmt;
use std::ops::Range;

use super::thresholds::{DEVIATIONS, RECOVERED};

/// A constant of the truth with its recovered value.
pub(super) struct Constant {
    name: String,
    truth: f64,
    value: f64,
    deviation: f64,
}

impl Constant {
    /// Relative error.
    pub(super) fn off(&self) -> f64 {
        (self.value / self.truth - 1.0).abs()
    }

    /// Whether it is recovered: within 3 %, or inside of its own interval.
    pub(super) fn is_recovered(&self) -> bool {
        self.off() <= RECOVERED || (self.value - self.truth).abs() <= DEVIATIONS * self.deviation
    }
}

impl fmt::Display for Constant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, truth, value, deviation } = self;
        let wrong = if self.is_recovered() { "" } else { "!" };
        let (off, own) = (100.0 * (value / truth - 1.0), 100.0 * (deviation / truth).abs());
        write!(f, "{name} {off:+.1}±{own:.1}%{wrong}")
    }
}

/// Constants of all objects that can be compared: those of terms that the truth has as well.
pub(super) fn constants(found: &SceneDistillation, truth: &GroundTruth) -> Vec<Constant> {
    let mut all: Vec<Constant> = Vec::new();
    for (members, object) in &found.objects {
        let Distilled::Generalised(law) = object else { continue };
        let described = &truth.law["objects"][usize::try_from(truth.object[members[0]]).unwrap_or(0)];
        let Some(own) = described["constants"].as_object() else { continue };
        for (name, value) in own {
            let (Some(truth), Some((value, deviation))) = (value.as_f64(), recovered(law, name)) else {
                continue;
            };
            // An axis points either way, and the sign of its torque with it.
            let [truth, value] = if name == "torque" { [truth.abs(), value.abs()] } else { [truth, value] };
            all.push(Constant { name: name.clone(), truth, value, deviation });
        }
    }
    all
}

/// A number with its deviation.
type Measured = (f64, f64);

/// The constant of a law that a truth calls by a name.
fn recovered(found: &DistilledLaw, name: &str) -> Option<Measured> {
    let law = &found.law;
    match name {
        "g" => length(law, &["uniform-field"], 0..3),
        "k" => one(law, &["spring", "spring-length", "central-power", "central-inverse-square"], 0),
        "n" => one(law, &["central-power"], 1).or_else(|| {
            let is_known = |term: &Term| term.kind.name() == "central-inverse-square";
            law.terms.iter().any(is_known).then_some((-2.0, 0.0))
        }),
        "length" => one(law, &["spring-length"], 1),
        "mass_ratio" if law.coordinates.name() == "pair" => parameter(law, 0),
        "k_gravity" => length(law, &["fourier"], 0..2),
        "k_spring" => one(law, &["spring"], 0),
        "torque" => one(law, &["constant-drive"], 0),
        "drag" => one(law, &["linear-drag"], 0),
        "quadratic_drag" => one(law, &["quadratic-drag"], 0),
        "friction" => one(law, &["dry-friction"], 0),
        "slope" => length(law, &["uniform-field"], 0..1),
        "gyration" => length(law, &["gyroscopic"], 0..3),
        "omega" if found.start.v.len() == 1 => Some((found.start.v[0].abs(), 0.0)),
        "k_across" => one(law, &["quartic-axis"], 0),
        "quartic" => length(law, &["quartic-axis"], 2..5).map(|(u, s)| (u.powi(4), 4.0 * u.powi(3) * s)),
        "half_distance" => half_distance(law),
        "restitution" => law.contact.as_ref().map(|contact| (contact.restitution, 0.0)),
        _ => None,
    }
}

/// Half the distance of the wells of a quartic potential along an axis: `√(−(k + a)/|u|⁴)`.
fn half_distance(law: &Law) -> Option<Measured> {
    let [(k, sk), (a, sa)] = [0, 1].map(|at| one(law, &["quartic-axis"], at)).map(Option::unwrap_or_default);
    let (u, su) = length(law, &["quartic-axis"], 2..5)?;
    let square = -(k + a) / u.powi(4);
    let relative = 0.5 * (sk.hypot(sa) / (k + a)).abs().hypot(4.0 * su / u);
    (square > 0.0).then(|| (square.sqrt(), square.sqrt() * relative))
}

/// Where the parameters of the first term of one of the names are.
fn range(law: &Law, names: &[&str]) -> Option<Range<usize>> {
    law.terms.iter().position(|term| names.contains(&term.kind.name())).map(|index| law.range(index))
}

fn parameter(law: &Law, at: usize) -> Option<Measured> {
    Some((*law.parameters.get(at)?, law.deviations.get(at).copied().unwrap_or(0.0)))
}

/// One parameter of a term.
fn one(law: &Law, names: &[&str], at: usize) -> Option<Measured> {
    parameter(law, range(law, names)?.start + at)
}

/// The length of a vector among the parameters of a term.
fn length(law: &Law, names: &[&str], part: Range<usize>) -> Option<Measured> {
    let first = range(law, names)?.start;
    let entries: Vec<Measured> = part.filter_map(|at| parameter(law, first + at)).collect();
    let length = entries.iter().map(|(value, _)| value * value).sum::<f64>().sqrt();
    let variance = entries.iter().map(|(value, deviation)| (value * deviation / length).powi(2)).sum::<f64>();
    Some((length, variance.sqrt()))
}
