//! What speaks for a law, in units of χ², so that laws of the same poses can be compared.

use super::kinematics::Configured;
use lgs_mechanics::choose::{Judged, PARSIMONY};

/// The evidence for a law of some poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    /// Whitened χ² of the poses.
    pub(crate) chi_square: f64,
    /// Samples that count as independent.
    pub(crate) samples: f64,
    /// Penalty of the unknowns, and prior odds against laws that are not simple.
    pub(crate) against: f64,
}

impl Evidence {
    /// The evidence for a law in its coordinates, of so many samples and values.
    pub(super) fn of(system: &Configured, law: &Judged, (samples, values): (f64, usize)) -> Self {
        // Simplicity counts unknowns in halves.
        let of_system = 2 * (system.joint_constants() + 2 * system.coordinates.freedoms());
        Self {
            chi_square: law.fitted.loss + system.chi_square,
            samples,
            against: penalty(unknowns(system, law), values) + PARSIMONY * (law.simplicity + of_system) as f64,
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
