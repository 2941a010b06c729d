//! Deformation by modes.

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
}
