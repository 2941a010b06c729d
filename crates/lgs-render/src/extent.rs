//! Exact extents of the ellipse on which a Gaussian's alpha is 1/255.
//!
//! In the factors of `project` the ellipse is `u² + w² ≤ reach`. At height `d_y` it spans `d_x = -(f₁/f₀) d_y
//! ± √(reach - w²) / f₀`, and an ellipse and a band of rows are convex, so that the extent over a band is the
//! exact set of tiles it reaches there.

use crate::projected::Projected;

/// Widening of extents, pixels: keeps rounding from dropping a pixel that the blending test would accept.
pub(crate) const MARGIN: f32 = 1e-2;

/// Relative inflation of `reach`, so that rounding cannot shorten an extent.
pub(crate) const SLACK: f32 = 1.0 + 2e-6;

/// First and last pixel whose centre lies in `[low, high]`, within `0..size`.
#[inline(always)]
fn pixel_range(low: f32, high: f32, size: usize) -> Option<(usize, usize)> {
    let first = (low - 0.5 - MARGIN).ceil().max(0.0);
    let last = (high - 0.5 + MARGIN).floor().min(size as f32 - 1.0);
    (first <= last).then_some((first as usize, last as usize))
}

/// First and last row and column of pixels in the bounding box of the ellipse, within the image.
#[inline(always)]
pub(crate) fn pixel_box(g: &Projected, [width, height]: [usize; 2]) -> Option<[(usize, usize); 2]> {
    let columns = pixel_range(g.mean[0] - g.half[0], g.mean[0] + g.half[0], width)?;
    Some([columns, pixel_range(g.mean[1] - g.half[1], g.mean[1] + g.half[1], height)?])
}

/// First and last pixel column that the ellipse reaches between the heights `top` and `bottom`.
#[inline(always)]
pub(crate) fn pixel_columns(g: &Projected, top: f32, bottom: f32, width: usize) -> Option<(usize, usize)> {
    let half = g.half[1] + MARGIN;
    let (low, high) = ((top - g.mean[1]).max(-half), (bottom - g.mean[1]).min(half));
    let [f0, f1, f2] = g.factor;
    let (inverse, reach) = (1.0 / f0, g.reach * SLACK);
    let half_width = |d: f32| (reach - f2 * d * (f2 * d)).max(0.0).sqrt() * inverse;
    let (d_right, d_left) = (g.rightmost.max(low).min(high), (-g.rightmost).max(low).min(high));
    let right = half_width(d_right) - f1 * inverse * d_right;
    let left = -half_width(d_left) - f1 * inverse * d_left;
    // Relative slack for ellipses much larger than the image.
    let slack = 1e-5 * (right - left).abs();
    pixel_range(g.mean[0] + left - slack, g.mean[0] + right + slack, width)
}

/// Whether alpha reaches 1/255 at a pixel of the image, going by the bounding box; false if a value is NaN.
#[inline(always)]
pub(crate) fn can_be_seen(g: &Projected, size: [usize; 2]) -> bool {
    let representable = g.factor[0] > 0.0 && g.factor[1].is_finite() && g.factor[2] > 0.0;
    g.reach > 0.0 && representable && pixel_box(g, size).is_some()
}
