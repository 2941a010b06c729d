//! Whether a scene keeps its size: foreground pixels, spread of objects, and reach of the dynamic
//! Gaussians (method §7).
//!
//! Pixels depend on perspective and on what leaves the view, so the truth's own pixels are compared where
//! images show them, and spread and reach in space where ground truth is known.

mod pixels;
mod space;

pub use pixels::{pixel_extent, pixel_extent_against_images, source_pixel_extent};
pub use space::{reach_against_truth, spread_against_truth};

use crate::finite::finite;

/// Maximum and minimum of a ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The largest ratio.
    pub max: f64,
    /// The smallest ratio.
    pub min: f64,
}

impl Range {
    fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        values.into_iter().try_fold(None, |range: Option<Self>, v| {
            finite(v).map(|v| {
                Some(range.map_or(Self { max: v, min: v }, |r| Self { max: r.max.max(v), min: r.min.min(v) }))
            })
        })?
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diverged_ratio_is_no_range() {
        assert_eq!(Range::of([1.0, 2.0, 0.5]), Some(Range { max: 2.0, min: 0.5 }));
        assert_eq!(Range::of([1.0, f64::NAN]), None);
        assert_eq!(Range::of([]), None);
    }
}
