//! The frame in which networks see positions.

use serde::{Deserialize, Serialize};

/// The affine map applied to positions before encoding: `(x − center) / scale`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputFrame {
    /// World units.
    pub center: [f32; 3],
    /// World units.
    pub scale: f32,
}

impl InputFrame {
    /// Positions as they are.
    pub const IDENTITY: Self = Self { center: [0.0; 3], scale: 1.0 };

    /// The values of a frame that is not a map, for messages.
    pub(super) fn defect(&self) -> Option<String> {
        let Self { center, scale } = *self;
        let sound = scale > 0.0 && scale.is_finite() && center.iter().all(|v| v.is_finite());
        (!sound).then(|| format!("{scale} and {center:?}"))
    }

    /// Centre and half extent of a box around points (the identity if there are none or they coincide).
    #[must_use]
    pub fn around(points: &[[f32; 3]]) -> Self {
        let low = points.iter().fold([f32::MAX; 3], |a, p| std::array::from_fn(|i| a[i].min(p[i])));
        let high = points.iter().fold([f32::MIN; 3], |a, p| std::array::from_fn(|i| a[i].max(p[i])));
        let scale = (0..3).map(|i| 0.5 * (high[i] - low[i])).fold(0.0, f32::max);
        if scale.is_finite() && scale > 1e-6 {
            Self { center: std::array::from_fn(|i| 0.5 * (low[i] + high[i])), scale }
        } else {
            Self::IDENTITY
        }
    }
}
