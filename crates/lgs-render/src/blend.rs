//! Front-to-back blending of one tile, and its vector–Jacobian product: the hot loops of the renderer.
//!
//! A tile is 16 rows of 16 pixels. For each Gaussian, nearest first, the rows it reaches are visited as vectors of pixels. With
//! `u = f₀ d_x + f₁ d_y` and `w = f₂ d_y` (see `project`), `α = 2^(log2 o - w² - u²)`; per row only `u` varies between lanes.
//!
//! A pixel that has stopped holds minus its transmittance: the product with `1 - α` then stays below the threshold by itself. The index of
//! the Gaussian that stopped it is kept, so that the backward pass, which goes back to front and divides `1 - α` out of the
//! transmittance again, makes exactly the decisions of the forward pass.
//!
//! The exponent's cotangent enters the gradients of centre and covariance only through moments of `d` (`project::ImageCotangent`), so
//! that three of them are summed per row and `d_x` is applied once per Gaussian.

use crate::project::{ALPHA_MAX, ALPHA_MIN, ImageCotangent, Projected, TRANSMITTANCE_STOP};
use crate::simd::{exp2, fma, none};
use crate::tiles::{TILE, half_height};
use pulp::{Simd, WithSimd};

/// Pixels of a tile.
const PIXELS: usize = TILE * TILE;

/// Offsets of the pixel centres of a row.
const CENTRES: Lanes = Lanes([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 10.5, 11.5, 12.5, 13.5, 14.5, 15.5]);

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Lanes([f32; TILE]);

/// One value per pixel of a tile, row by row.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Plane(pub [f32; PIXELS]);

impl Plane {
    pub(crate) const ZERO: Self = Self([0.0; PIXELS]);

    /// A row of the tile.
    pub(crate) fn row(&self, row: usize) -> &[f32; TILE] {
        &self.0.as_chunks::<TILE>().0[row]
    }
}

/// The list of a tile: its Gaussians nearest first, and where it lies in the image.
#[derive(Clone, Copy)]
pub(crate) struct TileList<'a> {
    pub projected: &'a [Projected],
    /// Gaussians of the band.
    pub items: &'a [u32],
    /// Positions in `items`.
    pub members: &'a [u32],
    /// Top left corner, pixels.
    pub origin: [usize; 2],
    /// Rows and columns inside the image.
    pub size: [usize; 2],
}

impl TileList<'_> {
    fn get(&self, position: usize) -> &Projected {
        &self.projected[self.items[self.members[position] as usize] as usize]
    }

    /// The mean relative to the tile.
    #[inline(always)]
    fn local_mean(&self, g: &Projected) -> [f32; 2] {
        [g.mean[0] - self.origin[0] as f32, g.mean[1] - self.origin[1] as f32]
    }

    /// Rows of the tile that a Gaussian reaches, one pixel row of slack included by rounding outwards.
    #[inline(always)]
    fn rows(&self, g: &Projected, mean_y: f32) -> std::ops::Range<usize> {
        let half = half_height(g);
        // `as` saturates: below zero becomes zero.
        let first = (mean_y - half - 0.51).max(0.0).ceil() as usize;
        let end = (mean_y + half + 0.51).max(0.0) as usize;
        first..end.min(self.size[1]).max(first)
    }
}

/// What the backward pass needs of the forward one, per pixel of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileState {
    /// Final transmittance; negative where blending stopped early.
    pub transmittance: Plane,
    /// Position in the list of the Gaussian that stopped the pixel, infinite if none did.
    pub stop: Plane,
    /// Length of the part of the list that was looked at.
    pub processed: usize,
}

/// A blended tile.
pub(crate) struct TileImage {
    /// Colour without background, one plane per channel.
    pub color: [Plane; 3],
    pub state: TileState,
}

impl TileImage {
    fn empty() -> Self {
        let state = TileState { transmittance: Plane([1.0; PIXELS]), stop: Plane([f32::INFINITY; PIXELS]), processed: 0 };
        Self { color: [Plane::ZERO; 3], state }
    }

    /// Composites a row over the background.
    pub(crate) fn write_row(&self, y: usize, background: [f32; 3], image: &mut [[f32; 3]], transmittance: &mut [f32]) {
        let [red, green, blue] = [self.color[0].row(y), self.color[1].row(y), self.color[2].row(y)];
        let left = self.state.transmittance.row(y);
        for (x, (pixel, out)) in image.iter_mut().zip(transmittance).enumerate().take(TILE) {
            let t = left[x].abs();
            *out = t;
            *pixel = [red[x] + t * background[0], green[x] + t * background[1], blue[x] + t * background[2]];
        }
    }
}

/// Blends a tile. `channels` picks the three values to be blended, usually the colour.
pub(crate) struct Blend<'a, F> {
    pub list: TileList<'a>,
    pub channels: F,
}

impl<F: Fn(&Projected) -> [f32; 3]> WithSimd for Blend<'_, F> {
    type Output = TileImage;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> TileImage {
        let mut image = TileImage::empty();
        let mut alive = Alive::rows(self.list.size[1]);
        let [red, green, blue] = &mut image.color;
        let (red, green, blue) = (vectors::<S>(red), vectors::<S>(green), vectors::<S>(blue));
        let (transmittance, stop) = (vectors::<S>(&mut image.state.transmittance), vectors::<S>(&mut image.state.stop));
        let per_row = TILE / S::F32_LANES;
        let (alpha_min, alpha_max, threshold) =
            (simd.splat_f32s(ALPHA_MIN.log2()), simd.splat_f32s(ALPHA_MAX), simd.splat_f32s(TRANSMITTANCE_STOP));
        for position in 0..self.list.members.len() {
            if alive.none() {
                break;
            }
            image.state.processed = position + 1;
            let g = self.list.get(position);
            let mean = self.list.local_mean(g);
            let channels = splat3(simd, (self.channels)(g));
            let rows = self.list.rows(g, mean[1]);
            for column in 0..per_row {
                let along = along_row(simd, g, mean[0], column);
                for row in rows.clone() {
                    if !alive.has(row) {
                        continue;
                    }
                    let at = row * per_row + column;
                    let log2_alpha = log2_alpha(simd, g, along, row as f32 + 0.5 - mean[1]);
                    let seen = simd.greater_than_or_equal_f32s(log2_alpha, alpha_min);
                    let raw = exp2(simd, log2_alpha);
                    let weight = simd.mul_f32s(simd.min_f32s(raw, alpha_max), transmittance[at]);
                    let next = simd.sub_f32s(transmittance[at], weight);
                    let open = simd.greater_than_or_equal_f32s(next, threshold);
                    let hit = simd.and_m32s(seen, open);
                    let weight = simd.select_f32s(hit, weight, simd.splat_f32s(0.0));
                    red[at] = fma(simd, weight, channels[0], red[at]);
                    green[at] = fma(simd, weight, channels[1], green[at]);
                    blue[at] = fma(simd, weight, channels[2], blue[at]);
                    let live = simd.and_m32s(seen, simd.greater_than_f32s(transmittance[at], simd.splat_f32s(0.0)));
                    let blocked = simd.and_m32s(live, simd.less_than_f32s(next, threshold));
                    transmittance[at] = simd.select_f32s(hit, next, transmittance[at]);
                    if !none(simd, blocked) {
                        stop_pixels(simd, blocked, position as f32, &mut transmittance[at], &mut stop[at]);
                        alive.update(simd, row, &transmittance[row * per_row..(row + 1) * per_row]);
                    }
                }
            }
        }
        image
    }
}

/// A bit per row of a tile with pixels that still accept light.
struct Alive(u32);

impl Alive {
    fn rows(count: usize) -> Self {
        Self((1 << count) - 1)
    }

    #[inline(always)]
    fn none(&self) -> bool {
        self.0 == 0
    }

    #[inline(always)]
    fn has(&self, row: usize) -> bool {
        self.0 >> row & 1 == 1
    }

    #[inline(always)]
    fn update<S: Simd>(&mut self, simd: S, row: usize, transmittance: &[S::f32s]) {
        let zero = simd.splat_f32s(0.0);
        if transmittance.iter().all(|&t| none(simd, simd.greater_than_f32s(t, zero))) {
            self.0 &= !(1 << row);
        }
    }
}

/// Marks the pixels of `blocked` as stopped at `position`.
#[inline(always)]
fn stop_pixels<S: Simd>(simd: S, blocked: S::m32s, position: f32, transmittance: &mut S::f32s, stop: &mut S::f32s) {
    *stop = simd.select_f32s(blocked, simd.splat_f32s(position), *stop);
    *transmittance = simd.select_f32s(blocked, simd.sub_f32s(simd.splat_f32s(0.0), *transmittance), *transmittance);
}

#[inline(always)]
fn vectors<S: Simd>(plane: &mut Plane) -> &mut [S::f32s] {
    S::as_mut_simd_f32s(&mut plane.0).0
}

/// Not `array::map`: intrinsics in its closure would stay calls, as its body is compiled without the vector features.
#[inline(always)]
fn splat3<S: Simd>(simd: S, [a, b, c]: [f32; 3]) -> [S::f32s; 3] {
    [simd.splat_f32s(a), simd.splat_f32s(b), simd.splat_f32s(c)]
}

/// `d_x` of a vector of pixels.
#[inline(always)]
fn offset_x<S: Simd>(simd: S, mean_x: f32, column: usize) -> S::f32s {
    simd.sub_f32s(S::as_simd_f32s(&CENTRES.0).0[column], simd.splat_f32s(mean_x))
}

/// `f₀ d_x` of a vector of pixels.
#[inline(always)]
fn along_row<S: Simd>(simd: S, g: &Projected, mean_x: f32, column: usize) -> S::f32s {
    simd.mul_f32s(simd.splat_f32s(g.factor[0]), offset_x(simd, mean_x, column))
}

/// Base-2 logarithm of opacity times Gaussian.
#[inline(always)]
fn log2_alpha<S: Simd>(simd: S, g: &Projected, along: S::f32s, dy: f32) -> S::f32s {
    let w = g.factor[2] * dy;
    let u = simd.add_f32s(along, simd.splat_f32s(g.factor[1] * dy));
    let top = simd.splat_f32s((-w).mul_add(w, g.log2_opacity));
    simd.negate_mul_add_f32s(u, u, top)
}

/// Cotangents of a tile's pixels, padded with zeros outside of the image.
pub(crate) struct TileCotangent {
    pub color: [Plane; 3],
    /// Per pixel: cotangent of the final transmittance, times that transmittance.
    pub remainder: Plane,
}

/// Pulls the cotangents of a tile back to its Gaussians, one entry per element of the list.
pub(crate) struct BlendVjp<'a> {
    pub list: TileList<'a>,
    pub state: &'a TileState,
    pub v: TileCotangent,
}

impl WithSimd for BlendVjp<'_> {
    type Output = Vec<ImageCotangent>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Vec<ImageCotangent> {
        let mut out = vec![ImageCotangent::default(); self.list.members.len()];
        let per_row = TILE / S::F32_LANES;
        let mut transmittance = Plane(self.state.transmittance.0.map(f32::abs));
        let last_stop: [f32; TILE] =
            std::array::from_fn(|row| self.state.stop.0[row * TILE..(row + 1) * TILE].iter().copied().fold(0.0, f32::max));
        let stop = S::as_simd_f32s(&self.state.stop.0).0;
        let [red, green, blue] = &mut self.v.color;
        let (red, green, blue) = (vectors::<S>(red), vectors::<S>(green), vectors::<S>(blue));
        let (transmittance, behind) = (vectors::<S>(&mut transmittance), vectors::<S>(&mut self.v.remainder));
        let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
        let (alpha_min, alpha_max) = (simd.splat_f32s(ALPHA_MIN.log2()), simd.splat_f32s(ALPHA_MAX));
        for position in (0..self.state.processed).rev() {
            let g = self.list.get(position);
            let mean = self.list.local_mean(g);
            let color = splat3(simd, g.color);
            let here = simd.splat_f32s(position as f32);
            let rows = self.list.rows(g, mean[1]);
            for column in 0..per_row {
                let along = along_row(simd, g, mean[0], column);
                let mut v_color = [zero; 3];
                let mut v_power = [zero; 3];
                for row in rows.clone() {
                    if last_stop[row] <= position as f32 {
                        continue;
                    }
                    let at = row * per_row + column;
                    let dy = row as f32 + 0.5 - mean[1];
                    let log2_alpha = log2_alpha(simd, g, along, dy);
                    let seen = simd.greater_than_or_equal_f32s(log2_alpha, alpha_min);
                    let hit = simd.and_m32s(seen, simd.less_than_f32s(here, stop[at]));
                    let raw = exp2(simd, log2_alpha);
                    let alpha = simd.select_f32s(hit, simd.min_f32s(raw, alpha_max), zero);
                    let inverse = simd.div_f32s(one, simd.sub_f32s(one, alpha));
                    let in_front = simd.mul_f32s(transmittance[at], inverse);
                    let weight = simd.mul_f32s(alpha, in_front);
                    let shade = fma(simd, color[0], red[at], fma(simd, color[1], green[at], simd.mul_f32s(color[2], blue[at])));
                    // ∂/∂α = T shade - (light from behind) / (1 - α); times α for the exponent, which a clamped α does not see.
                    let v_alpha = simd.mul_f32s(inverse, simd.sub_f32s(simd.mul_f32s(transmittance[at], shade), behind[at]));
                    let unclamped = simd.select_f32s(simd.less_than_f32s(raw, alpha_max), alpha, zero);
                    let v = simd.mul_f32s(unclamped, v_alpha);
                    behind[at] = fma(simd, weight, shade, behind[at]);
                    transmittance[at] = in_front;
                    v_color[0] = fma(simd, weight, red[at], v_color[0]);
                    v_color[1] = fma(simd, weight, green[at], v_color[1]);
                    v_color[2] = fma(simd, weight, blue[at], v_color[2]);
                    v_power[0] = simd.add_f32s(v_power[0], v);
                    let v_dy = simd.mul_f32s(v, simd.splat_f32s(dy));
                    v_power[1] = simd.add_f32s(v_power[1], v_dy);
                    v_power[2] = fma(simd, v_dy, simd.splat_f32s(dy), v_power[2]);
                }
                let dx = offset_x(simd, mean[0], column);
                out[position].accumulate(&reduce(simd, dx, v_power, v_color));
            }
        }
        out
    }
}

/// Sums lanes in a fixed order, and applies the powers of `d_x`.
#[inline(always)]
fn reduce<S: Simd>(simd: S, dx: S::f32s, [v, v_dy, v_dyy]: [S::f32s; 3], v_color: [S::f32s; 3]) -> ImageCotangent {
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
        color: [simd.reduce_sum_f32s(v_color[0]), simd.reduce_sum_f32s(v_color[1]), simd.reduce_sum_f32s(v_color[2])],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::{View, project};
    use crate::splats::Splats;
    use crate::tiles::tile;
    use lgs_core::testing::{assert_gradient_close, assert_values_close};
    use lgs_core::{Camera, GaussianCloud};
    use pulp::{Arch, Scalar};

    /// Values and gradients of one tile at the vector width that `dispatch` and `vjp` choose.
    fn run(
        list: TileList,
        dispatch: impl Fn(Blend<fn(&Projected) -> [f32; 3]>) -> TileImage,
        vjp: impl Fn(BlendVjp) -> Vec<ImageCotangent>,
    ) -> (Vec<f32>, Vec<f32>) {
        let image = dispatch(Blend { list, channels: |g| g.color });
        let weights = |phase: usize| Plane(std::array::from_fn(|i| ((i * 13 + phase * 7) % 17) as f32 / 17.0 - 0.4));
        let v = TileCotangent { color: [weights(0), weights(1), weights(2)], remainder: weights(3) };
        let gradients = vjp(BlendVjp { list, state: &image.state, v });
        let mut values = image.state.transmittance.0.to_vec();
        values.extend(image.color.iter().flat_map(|plane| plane.0));
        (values, gradients.iter().flat_map(|g| g.moments.into_iter().chain(g.color)).collect())
    }

    #[test]
    fn every_vector_width_agrees() {
        let means = (0..60).map(|i| [(i as f32 * 0.7).sin() * 0.3, i as f32 * 0.02, (i as f32 * 1.3).cos() * 0.3]).collect();
        let cloud = GaussianCloud::isotropic(means, 0.12, [0.7, 0.2, 0.5], 0.9);
        let camera = Camera::look_at([0.0, -2.0, 0.2], [0.0; 3], 0.4, 16, 13);
        let (splats, view) = (Splats::from(&cloud), View::from(&camera));
        let projected: Vec<Projected> = (0..60).map(|i| project(&splats, &view, i).unwrap_or_default()).collect();
        let tiling = tile(&projected, 16, 13);
        let band = &tiling.bands[0];
        let list = TileList { projected: &projected, items: &band.items, members: band.tile(0), origin: [0, 0], size: [16, 13] };
        assert!(list.members.len() > 30);
        let (wide, v_wide) = run(list, |op| Arch::new().dispatch(op), |op| Arch::new().dispatch(op));
        let (narrow, v_narrow) = run(list, |op| Scalar.vectorize(op), |op| Scalar.vectorize(op));
        assert_values_close("values", &wide, &narrow, 1e-5, 1e-5);
        assert_gradient_close("gradients", &v_wide, &v_narrow);
        assert!(wide.iter().any(|&v| v < 0.0), "some pixel stops early");
    }
}
