//! The record of one object's law.

mod describe;
mod edits;
mod outline;

pub use describe::unit_text;
pub use edits::TrustedEdit;
pub use outline::{LawOutline, TermOutline};

use std::collections::BTreeMap;

use lgs_mechanics::bands::Verdict;
use lgs_mechanics::contact::{Impact, Origin, Plane};
use lgs_mechanics::terms::Role;
use serde::{Deserialize, Serialize};

/// The law of an object's motion, how far it is trusted, and how it compares with the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ObjectLaw {
    /// Name of the coordinates, such as `rigid` or `hinge`; `particles` for the paper's system.
    pub coordinates: String,
    /// Number of bodies that the law moves.
    #[serde(skip_serializing_if = "is_one")]
    pub bodies: usize,
    /// Parameters of the kinetic energy: moments of inertia, ratios of masses.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kinetic: Vec<LawParameter>,
    /// Energies and forces; none for free motion.
    pub terms: Vec<LawTerm>,
    /// The plane that the body collides with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<LawContact>,
    /// Impulses by what is outside of the law, in the captured window.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub impulses: Vec<Impact>,
    /// Other objects that hit this one, and how.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hits: Option<HitsOfObjects>,
    /// The object whose shadow this one is, by which it goes on outside of the captured window.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow_of: Option<usize>,
    /// First and last time of the part of the captured window that the law explains, where none explains all
    /// of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<[f64; 2]>,
    /// Claim that the scene makes about the motion.
    pub verdict: Verdict,
    /// Error of blocked forecasts inside the captured window, over the displacement in the hidden part.
    pub forecast_error: Option<f64>,
    /// First and last time at which the forecast is trusted, units of time; nothing where it is not trusted
    /// beyond the captured window.
    pub trusted: Option<[f64; 2]>,
    /// How far forecasts under some edits are trusted, of a law that explains the motion.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub edits: Vec<TrustedEdit>,
    /// Laws that the evidence weighs against each other, the heaviest first, the chosen one among them.
    pub rivals: Vec<RivalLaw>,
    /// Radius that contains 90 % of the positions that the evidence allows.
    pub band: Option<PositionBand>,
    /// Fraction of the true positions inside of the band, over Gaussians and times in (0, 3 τ_max].
    pub coverage: Option<f64>,
    /// Verdict that a synthetic scene expects.
    pub expected: Option<Verdict>,
}

impl Default for ObjectLaw {
    /// Free motion of which nothing is claimed.
    fn default() -> Self {
        Self {
            coordinates: String::new(),
            bodies: 1,
            kinetic: Vec::new(),
            terms: Vec::new(),
            contact: None,
            impulses: Vec::new(),
            hits: None,
            shadow_of: None,
            part: None,
            verdict: Verdict::Outside,
            forecast_error: None,
            trusted: None,
            edits: Vec::new(),
            rivals: Vec::new(),
            band: None,
            coverage: None,
            expected: None,
        }
    }
}

fn is_one(bodies: &usize) -> bool {
    *bodies == 1
}

/// One energy or force of a law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawTerm {
    /// Kind of the term, such as `uniform-field`.
    pub name: String,
    /// Vector of the coordinates that it acts on, such as `center`; `whole` for all of them.
    pub port: String,
    /// Effect on the energy.
    pub role: Role,
    /// Values of its parameters.
    pub parameters: Vec<LawParameter>,
}

/// Other objects that hit one, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HitsOfObjects {
    /// The others, by index.
    pub others: Vec<usize>,
    /// Times of the hits in the captured window.
    pub times: Vec<f64>,
    /// Radius, mass over that of the first of the objects, restitution and friction.
    pub parameters: Vec<LawParameter>,
}

/// The plane that a body collides with, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawContact {
    /// Unit normal of the plane, to the side of the body.
    pub normal: [f64; 3],
    /// Distance of the plane from the origin along its normal, world units.
    pub offset: f64,
    /// Where the plane comes from.
    pub origin: Origin,
    /// Further planes that it collides with.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Plane>,
    /// Restitution and friction.
    pub parameters: Vec<LawParameter>,
    /// Times of the impacts in the captured window.
    pub impacts: Vec<f64>,
}

/// A constant of a law.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LawParameter {
    /// Name within its term.
    pub name: String,
    /// Value in world units, for unit mass.
    pub value: f64,
    /// Standard deviation of the value, in the same unit, where it is known.
    pub deviation: Option<f64>,
    /// Unit, with `u` for the world's unit of length and `t` for the unit of time; empty for a number.
    pub unit: String,
}

/// A law that was weighed against the others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RivalLaw {
    /// Names of its terms, joined by ` + `; `free` without any.
    pub terms: String,
    /// Share of all laws' weight, 0 to 1.
    pub weight: f64,
}

/// Radius of a band around the predicted positions, by time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PositionBand {
    /// Ascending times.
    pub times: Vec<f64>,
    /// Radius at each time, world units; nothing where the band is unbounded.
    pub radius: Vec<Option<f64>>,
}

/// How often the truth lies inside of the bands of a scene's forecasts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BandCoverage {
    /// By time, as labelled in the report, the fraction of the true positions inside of the 90 % bands, over
    /// the Gaussians of all objects that have one; nothing where none has, or the truth does not reach.
    pub coverage_90: BTreeMap<String, Option<f64>>,
}

impl PositionBand {
    /// The radius at a time, linear in between and infinite where the band is unbounded; nothing outside of
    /// the band's times.
    #[must_use]
    pub fn radius_at(&self, time: f64) -> Option<f64> {
        let radius = |index: usize| Some(self.radius.get(index)?.unwrap_or(f64::INFINITY));
        let after = self.times.partition_point(|&t| t < time);
        let (next, end) = (*self.times.get(after)?, radius(after)?);
        if next <= time {
            return Some(end);
        }
        let before = after.checked_sub(1)?;
        let (start, last) = (radius(before)?, self.times[before]);
        let weight = (time - last) / (next - last);
        let unbounded = start.is_infinite() || end.is_infinite();
        Some(if unbounded { f64::INFINITY } else { start + weight * (end - start) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_linear_between_its_times_and_unknown_outside_of_them() {
        let band =
            PositionBand { times: vec![0.0, 1.0, 2.0, 3.0], radius: vec![Some(0.1), Some(0.3), None, None] };
        assert_eq!(band.radius_at(0.0), Some(0.1));
        assert!((band.radius_at(0.25).expect("inside") - 0.15).abs() < 1e-12);
        assert_eq!(band.radius_at(1.0), Some(0.3));
        assert_eq!(band.radius_at(1.5), Some(f64::INFINITY));
        assert_eq!((band.radius_at(-0.1), band.radius_at(3.1)), (None, None));
        assert_eq!(PositionBand::default().radius_at(0.0), None);
    }

    #[test]
    fn a_record_with_the_least_is_read_and_what_is_absent_is_not_written() {
        let law: ObjectLaw =
            serde_json::from_str(r#"{"coordinates":"rigid","verdict":"described"}"#).expect("law");
        assert_eq!((law.verdict, law.terms.len(), law.coverage), (Verdict::Described, 0, None));
        let text = serde_json::to_string(&law).expect("text");
        assert!(!text.contains("bodies") && !text.contains("kinetic"), "{text}");
        assert_eq!(serde_json::from_str::<ObjectLaw>(&text).expect("again"), law);
    }
}
