//! The triangular factor of a symmetric positive definite 3×3 matrix.

use crate::thresholds::{LEAST_DETERMINANT, LEAST_PIVOT};

/// A lower triangular factor `L` of a symmetric matrix `L Lᵀ`: l00, l10, l11, l20, l21, l22, with the
/// diagonal inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositiveFactor([f64; 6]);

impl PositiveFactor {
    /// The factor of a symmetric matrix given as m00, m10, m11, m20, m21, m22; `None` unless its determinant
    /// exceeds a small part of `scale³` ([`LEAST_DETERMINANT`]).
    #[inline]
    #[must_use]
    pub fn new(m: [f64; 6], scale: f64) -> Option<Self> {
        let tiny = LEAST_DETERMINANT * scale;
        let positive = |v: f64| v.is_finite() && v > tiny && v > LEAST_PIVOT;
        if !positive(m[0]) {
            return None;
        }
        let i00 = 1.0 / m[0].sqrt();
        let (l10, l20) = (m[1] * i00, m[3] * i00);
        let d11 = m[2] - l10 * l10;
        if !positive(d11) {
            return None;
        }
        let i11 = 1.0 / d11.sqrt();
        let l21 = (m[4] - l20 * l10) * i11;
        let d22 = m[5] - l20 * l20 - l21 * l21;
        positive(d22).then(|| Self([i00, l10, i11, l20, l21, 1.0 / d22.sqrt()]))
    }

    /// The solution `y` of `L Lᵀ y = b`.
    #[inline]
    #[must_use]
    pub fn solve(&self, b: [f64; 3]) -> [f64; 3] {
        let [i00, l10, i11, l20, l21, i22] = self.0;
        let x0 = b[0] * i00;
        let x1 = (b[1] - l10 * x0) * i11;
        let x2 = (b[2] - l20 * x0 - l21 * x1) * i22;
        let y2 = x2 * i22;
        let y1 = (x1 - l21 * y2) * i11;
        [(x0 - l10 * y1 - l20 * y2) * i00, y1, y2]
    }
}
