//! Deformation by modes.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A mode whose displacement is an affine function of the position at rest: `linear X + shift`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AffineMode {
    /// Rows of the linear part, 1.
    pub linear: [[f64; 3]; 3],
    /// Displacement of the origin.
    pub shift: [f64; 3],
}

/// The three translations along the world's axes.
const TRANSLATIONS: [AffineMode; 3] =
    [translation([1.0, 0.0, 0.0]), translation([0.0, 1.0, 0.0]), translation([0.0, 0.0, 1.0])];

const fn translation(shift: [f64; 3]) -> AffineMode {
    AffineMode { linear: [[0.0; 3]; 3], shift }
}

/// A body whose points move by a sum of modes, `q_i = X_i + Σ_k x_k φ_k(X_i)`, with amplitudes `x_k` in
/// mass-normalised modes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Modal {
    /// Affine modes, the first amplitudes.
    pub affine: Vec<AffineMode>,
    /// Number of further modes, whose displacements are kept point by point beside the law.
    pub further: usize,
}

impl Modal {
    /// Number of amplitudes.
    #[must_use]
    pub fn amplitudes(&self) -> usize {
        self.affine.len() + self.further
    }

    /// A body that flies while it deforms: the given modes, then its centre along the world's axes.
    #[must_use]
    pub fn in_flight(deformation: &[AffineMode]) -> Self {
        Self { affine: [deformation, &TRANSLATIONS].concat(), further: 0 }
    }

    /// Whether the last three amplitudes are those of the centre of a body in flight.
    #[must_use]
    pub fn flies(&self) -> bool {
        self.further == 0 && self.affine.len() > 3 && self.affine.ends_with(&TRANSLATIONS)
    }

    /// The modes, without the translations of a body in flight.
    #[must_use]
    pub fn deformation(&self) -> &[AffineMode] {
        &self.affine[..self.affine.len() - if self.flies() { 3 } else { 0 }]
    }

    /// Makes a point of the body in flight, given by its distance at rest from what is the centre of mass
    /// now, the one that no deformation moves.
    pub fn move_center(&mut self, by: DVec3) {
        let modes = self.deformation().len();
        for mode in &mut self.affine[..modes] {
            let moved = mode.linear.map(|row| DVec3::from(row).dot(by));
            mode.shift.iter_mut().zip(moved).for_each(|(shift, moved)| *shift -= moved);
        }
    }
}
