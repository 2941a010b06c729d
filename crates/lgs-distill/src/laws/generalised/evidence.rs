//! What speaks for a law, in units of χ², so that laws of the same poses can be compared.

use super::kinematics::Configured;
use lgs_mechanics::Law;
use lgs_mechanics::choose::{Judged, PARSIMONY, surcharge_of};
use lgs_mechanics::coordinates::Coordinates;
use lgs_mechanics::terms::Role;

/// The evidence for a law of some poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    /// Whitened χ² of the poses.
    pub(crate) chi_square: f64,
    /// Samples that count as independent.
    pub(crate) samples: f64,
    /// Penalty of the unknowns, and prior odds against laws that are not simple.
    pub(crate) against: f64,
    /// The part of it that is held against the damping of modes.
    pub(crate) against_damping: f64,
}

impl Evidence {
    /// The evidence for a law in its coordinates, of so many samples and values.
    pub(super) fn of(system: &Configured, law: &Judged, (samples, values): (f64, usize)) -> Self {
        // Simplicity counts unknowns in halves.
        let of_system = 2 * (system.joint_constants() + 2 * system.coordinates.freedoms());
        let (rates, surcharge) = damping_of_modes(&law.fitted.law);
        Self {
            chi_square: law.fitted.loss + system.chi_square,
            samples,
            against: penalty(unknowns(system, law), values) + PARSIMONY * (law.simplicity + of_system) as f64,
            against_damping: penalty(rates as f64, values) + PARSIMONY * (2 * rates + surcharge) as f64,
        }
    }

    /// The same where some of the unknowns that were counted, of so many values, are known.
    pub(super) fn with_known(self, known: usize, values: usize) -> Self {
        let known = known as f64;
        Self { against: self.against - penalty(known, values) - 2.0 * PARSIMONY * known, ..self }
    }

    /// The evidence for a law that leaves so much less of χ².
    pub(super) fn bettered_by(self, chi_square: f64) -> Self {
        Self { chi_square: (self.chi_square - chi_square).max(0.0), ..self }
    }

    /// The evidence for a law of one body and another one of another body.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            chi_square: self.chi_square + other.chi_square,
            samples: self.samples + other.samples,
            against: self.against + other.against,
            against_damping: self.against_damping + other.against_damping,
        }
    }

    /// The least χ² for each sample that any law leaves, where that is more than 1. Where no law explains the
    /// poses, their noise is larger than it looks: by as much as the best law leaves.
    pub(crate) fn inflation(all: impl Iterator<Item = Self>) -> f64 {
        all.map(|one| one.chi_square / one.samples.max(1.0)).fold(f64::INFINITY, f64::min).max(1.0)
    }

    /// The score of a law where the variance of the noise is so many times as large as it looks; the smaller
    /// the likelier.
    pub(crate) fn score(&self, inflation: f64) -> f64 {
        self.chi_square / inflation + self.against
    }

    /// The score of a law in forecasts. What deforms and vibrates is damped by what it is made of, and a window
    /// of about a period hardly tells that from another shape at rest: so nothing is held against damping
    /// where laws are weighed that agree on the window and part beyond it.
    pub(crate) fn forecast_score(&self, inflation: f64) -> f64 {
        self.score(inflation) - self.against_damping
    }
}

/// The rates of terms that damp modes, and their surcharge beyond that of unknowns.
fn damping_of_modes(law: &Law) -> (usize, usize) {
    if !matches!(law.coordinates, Coordinates::Modal(_)) {
        return (0, 0);
    }
    let terms = law.terms.iter().enumerate();
    let damping = terms.filter(|(_, term)| term.kind.role() == Role::Dissipates);
    damping.fold((0, 0), |(rates, surcharge), (at, _)| {
        (rates + law.range(at).len(), surcharge + surcharge_of(Role::Dissipates))
    })
}

/// The Bayesian penalty of unknowns, for as many values as there are: correlated errors tell little of a
/// law's constants, but enough of them to forbid one constant for each.
pub(super) fn penalty(unknowns: f64, values: usize) -> f64 {
    unknowns * (values.max(1) as f64).ln()
}

/// Unknowns of a law in its coordinates: constants of the geometry, start and parameters.
pub(super) fn unknowns(system: &Configured, law: &Judged) -> f64 {
    let freedoms = system.coordinates.freedoms();
    (system.constants + 2 * freedoms + law.fitted.law.unknown_count()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::coordinates::{AffineMode, Modal, Port};
    use lgs_mechanics::fit::Fitted;
    use lgs_mechanics::terms::Term;
    use nalgebra::DMatrix;

    fn evidence(coordinates: Coordinates, terms: &[&str]) -> Evidence {
        let terms: Vec<Term> =
            terms.iter().map(|name| Term::named(name, Port::Whole).expect("a term")).collect();
        let candidate = lgs_mechanics::Candidate::new(coordinates.clone(), terms).expect("a candidate");
        let law = candidate.law(vec![1.0; candidate.parameter_count()], 0.01).expect("a law");
        let n = coordinates.freedoms();
        let start = lgs_mechanics::coordinates::State { x: vec![0.0; n], v: vec![0.0; n] };
        let covariance = DMatrix::zeros(0, 0);
        let fitted = Fitted { law, start, loss: 50.0, covariance, bounds: Vec::new(), priors: Vec::new() };
        let simplicity = lgs_mechanics::choose::simplicity(&candidate);
        let judged = Judged { index: 0, fitted, evidence: 0.0, simplicity };
        let (x, bases) = (Vec::new(), Vec::new());
        let system = Configured { coordinates, x, order: vec![0], bases, constants: 0, chi_square: 0.0 };
        Evidence::of(&system, &judged, (92.0, 552))
    }

    #[test]
    fn nothing_is_held_against_the_damping_of_modes_in_forecasts_alone() {
        let mode = AffineMode { linear: [[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]], shift: [0.0; 3] };
        let modal = || Coordinates::Modal(Modal { affine: vec![mode; 2], further: 0 });
        let undamped = evidence(modal(), &["spring-diagonal"]);
        let damped = evidence(modal(), &["spring-diagonal", "damping-diagonal"]);
        assert!(damped.score(1.0) > undamped.score(1.0) + 10.0, "{damped:?} {undamped:?}");
        assert!((damped.forecast_score(1.0) - undamped.forecast_score(1.0)).abs() < 1e-9);
        let drag = evidence(Coordinates::Point, &["spring", "linear-drag"]);
        assert!((drag.forecast_score(1.0) - drag.score(1.0)).abs() < 1e-9);
    }
}
