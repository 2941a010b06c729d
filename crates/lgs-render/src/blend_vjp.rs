//! The vector–Jacobian product of `blend`: back to front through one tile.
//!
//! Going back divides `1 - α` out of the transmittance again. With `T` the transmittance in front of a
//! Gaussian and `B` the cotangent's product with all light from behind it, the exponent's cotangent is `α T
//! shade - α / (1 - α) · B`.
//!
//! It enters the gradients of centre and covariance only through moments of `d`
//! (`project_vjp::ImageCotangent`), so that three of them are summed per row and `d_x` is applied once per
//! Gaussian.

use crate::blend::TileState;
use crate::exponential::exp2;
use crate::project_vjp::{CotangentCell, ImageCotangent};
use crate::projected::{ALPHA_MAX, ALPHA_MIN};
use crate::simd::{fma, reciprocal};
use crate::tile_list::{BATCH, Batch, Heights, Plane, Splat, TileList, offset_x, take_row};
use crate::tiles::TILE;
use pulp::{Simd, WithSimd};

/// Cotangents of a tile's pixels, padded with zeros outside of the image.
pub(crate) struct TileCotangent {
    pub color: [Plane; 3],
    /// Per pixel: cotangent of the final transmittance, times that transmittance.
    pub remainder: Plane,
}

/// Pulls the cotangents of a tile back to its Gaussians.
pub(crate) struct BlendVjp<'a> {
    pub list: TileList<'a>,
    pub state: &'a TileState,
    pub v: TileCotangent,
    /// Cells by the numbers of entries; all cells of the list are replaced.
    pub out: &'a [CotangentCell],
}

impl WithSimd for BlendVjp<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { list, state, mut v, out } = self;
        let mut transmittance = state.transmittance;
        let mut batch = Batch::new();
        let [red, green, blue] = &mut v.color;
        let mut pixels = Pixels::<S> {
            v: [red.vectors::<S>(), green.vectors::<S>(), blue.vectors::<S>()],
            transmittance: transmittance.vectors::<S>(),
            behind: v.remainder.vectors::<S>(),
            stop: S::as_simd_f32s(&state.stop.0).0,
        };
        let mut lit = LitRows::new(state);
        list.members[state.processed..]
            .iter()
            .for_each(|member| out[member.entry as usize].set(&ImageCotangent::default()));
        for first in (0..state.processed).step_by(BATCH).rev() {
            batch.load(simd, &list, first, &|g| g.color);
            for position in (first..state.processed.min(first + BATCH)).rev() {
                let mut g = batch.get(position - first);
                g.rows &= lit.at(position);
                let mut sum = ImageCotangent::default();
                if g.rows != 0 {
                    pixels.remove(simd, &g, position as f32, &mut sum);
                }
                out[list.members[position].entry as usize].set(&sum);
            }
        }
    }
}

/// The rows with pixels that accept light from a position, positions decreasing.
pub(crate) struct LitRows {
    /// Rows and the position from which on they are closed, the last first.
    closed_from: [(f32, u32); TILE],
    next: usize,
    rows: u32,
}

impl LitRows {
    pub(crate) fn new(state: &TileState) -> Self {
        let mut closed_from = [(0.0, 0); TILE];
        for (row, entry) in closed_from.iter_mut().enumerate() {
            *entry = (state.stop.row(row).iter().copied().fold(0.0, f32::max), 1 << row);
        }
        closed_from.sort_by(|a, b| b.0.total_cmp(&a.0));
        Self { closed_from, next: 0, rows: 0 }
    }

    #[inline(always)]
    pub(crate) fn at(&mut self, position: usize) -> u32 {
        while self.next < TILE && self.closed_from[self.next].0 > position as f32 {
            self.rows |= self.closed_from[self.next].1;
            self.next += 1;
        }
        self.rows
    }
}

/// The pixels of a tile while Gaussians are taken away again.
struct Pixels<'a, S: Simd> {
    /// Cotangents of the colours.
    v: [&'a mut [S::f32s]; 3],
    transmittance: &'a mut [S::f32s],
    /// Product of the cotangent with the light from behind.
    behind: &'a mut [S::f32s],
    stop: &'a [S::f32s],
}

impl<S: Simd> Pixels<'_, S> {
    /// Takes away the backmost Gaussian.
    #[inline(always)]
    fn remove(&mut self, simd: S, g: &Splat, position: f32, out: &mut ImageCotangent) {
        let per_row = TILE / S::F32_LANES;
        let heights = Heights::new(simd, g);
        let color =
            [simd.splat_f32s(g.channels[0]), simd.splat_f32s(g.channels[1]), simd.splat_f32s(g.channels[2])];
        let zero = simd.splat_f32s(0.0);
        for column in 0..per_row {
            let dx = offset_x(simd, g, column);
            let along = simd.mul_f32s(simd.splat_f32s(g.factor[0]), dx);
            let (mut v_color, mut v_power) = ([zero; 3], [zero; 3]);
            let mut rows = g.rows;
            while rows != 0 {
                let row = take_row(&mut rows);
                let at = row * per_row + column;
                let log2_alpha = heights.log2_alpha(simd, along, row);
                let hit = simd.less_than_f32s(simd.splat_f32s(position), self.stop[at]);
                let (weight, v) = self.remove_at(simd, at, color, (log2_alpha, hit));
                for (sum, v) in v_color.iter_mut().zip(&self.v) {
                    *sum = fma(simd, weight, v[at], *sum);
                }
                let v_dy = simd.mul_f32s(v, simd.splat_f32s(heights.dy.0[row]));
                v_power[0] = simd.add_f32s(v_power[0], v);
                v_power[1] = simd.add_f32s(v_power[1], v_dy);
                v_power[2] = fma(simd, v_dy, simd.splat_f32s(heights.dy.0[row]), v_power[2]);
            }
            out.accumulate(&reduce(simd, dx, v_power, v_color));
        }
    }

    /// Takes a Gaussian of a colour away from the vector of pixels number `at`, where those count that are
    /// `hit`; gives its weight in them and the cotangent of its exponent.
    #[inline(always)]
    fn remove_at(
        &mut self,
        simd: S,
        at: usize,
        color: [S::f32s; 3],
        (log2_alpha, hit): (S::f32s, S::m32s),
    ) -> (S::f32s, S::f32s) {
        let Removed { weight, odds, inverse, is_free } =
            removed(simd, (log2_alpha, hit), self.transmittance[at]);
        let [red, green, blue] = [self.v[0][at], self.v[1][at], self.v[2][at]];
        let shade = fma(simd, color[2], blue, fma(simd, color[1], green, simd.mul_f32s(color[0], red)));
        let light = simd.mul_f32s(weight, shade);
        let v = simd.negate_mul_add_f32s(odds, self.behind[at], light);
        // A clamped alpha does not see the exponent.
        let v = simd.select_f32s(is_free, v, simd.splat_f32s(0.0));
        self.behind[at] = simd.add_f32s(self.behind[at], light);
        self.transmittance[at] = simd.mul_f32s(self.transmittance[at], inverse);
        (weight, v)
    }
}

/// A Gaussian in a vector of pixels, the rearmost of those that are left.
pub(crate) struct Removed<S: Simd> {
    /// What it contributes of its colour.
    pub weight: S::f32s,
    /// `α / (1 − α)`.
    pub odds: S::f32s,
    /// `1 / (1 − α)`, by which the transmittance grows when it is taken away.
    pub inverse: S::f32s,
    /// Where alpha is below its limit, and so follows the exponent.
    pub is_free: S::m32s,
}

/// A Gaussian as it is taken away from the pixels that are `hit`, given the transmittance behind it.
#[inline(always)]
pub(crate) fn removed<S: Simd>(
    simd: S,
    (log2_alpha, hit): (S::f32s, S::m32s),
    transmittance: S::f32s,
) -> Removed<S> {
    let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
    let seen = simd.greater_than_or_equal_f32s(log2_alpha, simd.splat_f32s(ALPHA_MIN.log2()));
    let raw = exp2(simd, log2_alpha);
    let limit = simd.splat_f32s(ALPHA_MAX);
    let alpha = simd.select_f32s(simd.and_m32s(seen, hit), simd.min_f32s(raw, limit), zero);
    let inverse = reciprocal(simd, simd.sub_f32s(one, alpha));
    let odds = simd.mul_f32s(alpha, inverse);
    let weight = simd.mul_f32s(odds, transmittance);
    Removed { weight, odds, inverse, is_free: simd.less_than_f32s(raw, limit) }
}

/// Sums lanes in a fixed order, and applies the powers of `d_x`.
#[inline(always)]
fn reduce<S: Simd>(
    simd: S,
    dx: S::f32s,
    [v, v_dy, v_dyy]: [S::f32s; 3],
    v_color: [S::f32s; 3],
) -> ImageCotangent {
    let v_dx = simd.mul_f32s(v, dx);
    ImageCotangent {
        moments: [
            simd.reduce_sum_f32s(v),
            simd.reduce_sum_f32s(v_dx),
            simd.reduce_sum_f32s(v_dy),
            simd.reduce_sum_f32s(simd.mul_f32s(v_dx, dx)),
            simd.reduce_sum_f32s(simd.mul_f32s(v_dy, dx)),
            simd.reduce_sum_f32s(v_dyy),
        ],
        color: [
            simd.reduce_sum_f32s(v_color[0]),
            simd.reduce_sum_f32s(v_color[1]),
            simd.reduce_sum_f32s(v_color[2]),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blend::{Blend, TileImage};
    use crate::project::ProjectChunk;
    use crate::projected::Projected;
    use crate::splats::Splats;
    use crate::tiles::Tiling;
    use crate::view::View;
    use lgs_core::testing::{assert_gradient_close, assert_values_close};
    use lgs_core::{Camera, GaussianCloud};
    use pulp::{Arch, Scalar};

    /// Values and gradients of one tile at the vector width that `dispatch` and `vjp` choose, and whether
    /// some pixel stopped early.
    fn run(
        list: TileList,
        dispatch: impl Fn(Blend<fn(&Projected) -> [f32; 3]>) -> TileImage,
        vjp: impl Fn(BlendVjp),
    ) -> (Vec<f32>, Vec<f32>, bool) {
        let image = dispatch(Blend { list, channels: |g| g.color });
        let weights =
            |phase: usize| Plane(std::array::from_fn(|i| ((i * 13 + phase * 7) % 17) as f32 / 17.0 - 0.4));
        let v = TileCotangent { color: [weights(0), weights(1), weights(2)], remainder: weights(3) };
        let mut gradients = Vec::new();
        gradients.resize_with(list.members.len(), CotangentCell::default);
        vjp(BlendVjp { list, state: &image.state, v, out: &gradients });
        let mut values = image.state.transmittance.0.to_vec();
        values.extend(image.color.iter().flat_map(|plane| plane.0));
        let stopped = image.state.stop.0.iter().any(|&s| s >= 0.0 && s.is_finite());
        let gradients =
            gradients.iter().map(CotangentCell::get).flat_map(|g| g.moments.into_iter().chain(g.color));
        (values, gradients.collect(), stopped)
    }

    #[test]
    fn every_vector_width_agrees() {
        let means = (0..100)
            .map(|i| [(i as f32 * 0.7).sin() * 0.3, i as f32 * 0.02, (i as f32 * 1.3).cos() * 0.3])
            .collect();
        let cloud = GaussianCloud::isotropic(means, 0.12, [0.7, 0.2, 0.5], 0.9);
        let camera = Camera::look_at([0.0, -2.0, 0.2], [0.0; 3], 0.4, 15, 13);
        let (splats, view) = (Splats::from(&cloud), View::from(&camera));
        let (mut projected, mut means2d, mut radii) =
            (vec![Projected::default(); 100], vec![[0.0; 2]; 100], vec![0; 100]);
        let (out, means2d, radii) = (&mut projected[..], &mut means2d[..], &mut radii[..]);
        Arch::new().dispatch(ProjectChunk { splats: &splats, view: &view, first: 0, out, means2d, radii });
        let mut tiling = Tiling::default();
        tiling.update(&projected, [15, 13]);
        let list =
            TileList { projected: &projected, members: tiling.tile(0), origin: [0, 0], size: [15, 13] };
        assert!(list.members.len() > 70);
        let (wide, v_wide, stopped) = run(list, |op| Arch::new().dispatch(op), |op| Arch::new().dispatch(op));
        let (narrow, v_narrow, _) = run(list, |op| Scalar.vectorize(op), |op| Scalar.vectorize(op));
        assert_values_close("values", &wide, &narrow, 1e-5, 1e-5);
        assert_gradient_close("gradients", &v_wide, &v_narrow);
        assert!(stopped, "some pixel stops early");
    }
}
