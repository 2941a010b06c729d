//! EWA projection of Gaussians, vector lanes running over Gaussians (method §2.1).
//!
//! With `p` the mean in camera axes, `W` the camera rotation and `J` the Jacobian of the pinhole at `p` (its
//! `x/z`, `y/z` clamped to 1.3 times the tangent of half the field of view), `M = J W R S` is 2×3 and the
//! covariance on the image is `Σ = M Mᵀ + b I` with b = 0.3; for the Mip filter b = 0.1, and the opacity is
//! multiplied by `√(|M Mᵀ| / |Σ|)`, by which a Gaussian keeps its energy.
//!
//! Two forms keep f32 accurate for long thin Gaussians: the determinant as
//! `|m₀ × m₁|² + b (|m₀|² + |m₁|²) + b²` (Cauchy–Binet; no cancellation), and the exponent as minus a sum
//! of squares, `-½ dᵀ Σ⁻¹ d = -(u² + w²) ln 2` with `u = f₀ d_x + f₁ d_y`, `w = f₂ d_y`, so that it can never
//! be positive.

mod lanes;

use crate::extent::can_be_seen;
use crate::projected::{LEAST_ENERGY, LOG2_255, Projected};
use crate::simd::{BLOCK, V, splat};
use crate::splats::Splats;
use crate::view::View;
use lanes::{ImageBlock, Inputs};
use lgs_core::PixelFilter;
use pulp::{Simd, WithSimd};

/// Projects some Gaussians. A struct rather than a closure, so that the body is compiled with the processor's
/// features.
pub(crate) struct ProjectChunk<'a> {
    pub splats: &'a Splats<'a>,
    pub view: &'a View,
    /// Index of the first one.
    pub first: usize,
    /// The projected Gaussians; invisible ones become zero.
    pub out: &'a mut [Projected],
    /// Projected centres, zero for what is behind the near plane.
    pub means2d: &'a mut [[f32; 2]],
    /// Three standard deviations, pixels, rounded up; zero for what is invisible.
    pub radii: &'a mut [u32],
}

impl WithSimd for ProjectChunk<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let blocks =
            self.out.chunks_mut(BLOCK).zip(self.means2d.chunks_mut(BLOCK)).zip(self.radii.chunks_mut(BLOCK));
        for (block, ((out, means2d), radii)) in blocks.enumerate() {
            let first = self.first + block * BLOCK;
            let inputs = Inputs::load(self.splats, first, out.len());
            let mut image = ImageBlock::default();
            let projection = Projection { simd, inputs: &inputs, view: self.view };
            for index in 0..BLOCK / S::F32_LANES {
                projection.project(index, self.splats.active_degree, &mut image);
            }
            out.fill(Projected::default());
            means2d.fill([0.0; 2]);
            radii.fill(0);
            for lane in 0..out.len() {
                let Some(mut g) = image.get(lane, self.view.near) else { continue };
                means2d[lane] = g.mean;
                if !can_be_seen(&g, self.view.size) || image.determinant.0[lane].is_infinite() {
                    continue;
                }
                g.color =
                    image.basis.color(self.splats.sh_row(first + lane), self.splats.active_degree, lane);
                if g.color[0].is_finite() && g.color[1].is_finite() && g.color[2].is_finite() {
                    out[lane] = g;
                    radii[lane] = (image.radius.0[lane].ceil() as u32).max(1);
                }
            }
        }
    }
}

/// The projection of a block in a view.
#[derive(Clone, Copy)]
struct Projection<'a, S: Simd> {
    simd: S,
    inputs: &'a Inputs,
    view: &'a View,
}

impl<S: Simd> Projection<'_, S> {
    /// Projects vector number `index` of the block.
    #[inline(always)]
    fn project(self, index: usize, degree: usize, out: &mut ImageBlock) {
        let Self { simd, inputs, view } = self;
        let mean = [
            inputs.mean[0].get(simd, index),
            inputs.mean[1].get(simd, index),
            inputs.mean[2].get(simd, index),
        ];
        let [x, y, z] = self.camera_mean(mean);
        let inverse_depth = splat(simd, 1.0) / z;
        let slopes = [x * inverse_depth, y * inverse_depth];

        let m = self.image_axes(index, slopes, inverse_depth);
        let (m0, m1) = (dot(m[0], m[0]), dot(m[1], m[1]));
        let blur = splat(simd, view.blur);
        let (a, b, c) = (m0 + blur, dot(m[0], m[1]), m1 + blur);
        let n = cross(m[0], m[1]);
        let area = dot(n, n);
        let determinant = (m0 + m1).mul_add(blur, area + splat(simd, view.blur * view.blur));

        // The conic's factors in base 2.
        let base2 = (0.5 * std::f32::consts::LOG2_E).sqrt();
        let along = splat(simd, base2) * (c / determinant).sqrt();
        let log2_opacity = self.log2_opacity(index, area, determinant);
        // Squared Mahalanobis radius of the ellipse: 2 ln(255 o).
        let reach = (log2_opacity + splat(simd, LOG2_255)).max(splat(simd, 0.0))
            * splat(simd, 2.0 * std::f32::consts::LN_2);

        let principal = [splat(simd, view.principal[0]), splat(simd, view.principal[1])];
        out.mean[0].set(index, slopes[0].mul_add(splat(simd, view.focal[0]), principal[0]));
        out.mean[1].set(index, slopes[1].mul_add(splat(simd, view.focal[1]), principal[1]));
        out.factor[0].set(index, along);
        out.factor[1].set(index, -(along * b / c));
        out.factor[2].set(index, splat(simd, base2) / c.sqrt());
        out.log2_opacity.set(index, log2_opacity);
        out.depth.set(index, z);
        out.set_extent(index, [a, b, c], determinant, reach);
        let direction = std::array::from_fn(|i| mean[i] - splat(simd, view.center[i]));
        out.basis.evaluate(simd, index, direction, degree);
    }

    /// The opacity on the image, given the determinants of the covariances without and with the filter.
    #[inline(always)]
    fn log2_opacity(self, index: usize, area: V<S>, determinant: V<S>) -> V<S> {
        let Self { simd, inputs, view } = self;
        let log2_peak = -(splat(simd, 1.0) + (-inputs.raw_opacity.get(simd, index)).exp()).log2();
        match view.filter {
            PixelFilter::Dilation => log2_peak,
            PixelFilter::Mip => {
                let energy = (area / determinant).max(splat(simd, LEAST_ENERGY));
                energy.log2().mul_add(splat(simd, 0.5), log2_peak)
            }
        }
    }

    #[inline(always)]
    fn camera_mean(self, mean: [V<S>; 3]) -> [V<S>; 3] {
        let Self { simd, view, .. } = self;
        let mut out = mean;
        for ((out, row), &translation) in out.iter_mut().zip(&view.rotation).zip(&view.translation) {
            *out = dot([splat(simd, row[0]), splat(simd, row[1]), splat(simd, row[2])], mean)
                + splat(simd, translation);
        }
        out
    }

    /// `M = J W R S`.
    #[inline(always)]
    fn image_axes(self, index: usize, slopes: [V<S>; 2], inverse_depth: V<S>) -> [[V<S>; 3]; 2] {
        let Self { simd, inputs, view } = self;
        let axes = rotation_columns([
            inputs.rotation[0].get(simd, index),
            inputs.rotation[1].get(simd, index),
            inputs.rotation[2].get(simd, index),
            inputs.rotation[3].get(simd, index),
        ]);
        let scales = [
            inputs.log_scale[0].get(simd, index).exp(),
            inputs.log_scale[1].get(simd, index).exp(),
            inputs.log_scale[2].get(simd, index).exp(),
        ];
        let mut m = [[splat(simd, 0.0); 3]; 2];
        for i in 0..2 {
            let limit = view.tangent_limit[i];
            let tangent = slopes[i].max(splat(simd, -limit)).min(splat(simd, limit));
            let focal = splat(simd, view.focal[i]) * inverse_depth;
            let mut world = [splat(simd, 0.0); 3];
            for (k, world) in world.iter_mut().enumerate() {
                *world =
                    (splat(simd, view.rotation[i][k]) - tangent * splat(simd, view.rotation[2][k])) * focal;
            }
            for j in 0..3 {
                m[i][j] = dot(world, axes[j]) * scales[j];
            }
        }
        m
    }
}

/// The columns of the rotation of a raw quaternion; a (near) zero one is the identity.
#[inline(always)]
fn rotation_columns<S: Simd>([w, x, y, z]: [V<S>; 4]) -> [[V<S>; 3]; 3] {
    let (zero, one, two) = (w.of(0.0), w.of(1.0), w.of(2.0));
    let norm = (w * w + x * x + (y * y + z * z)).sqrt();
    // NaN stays NaN: it is not below the limit.
    let tiny =
        norm.simd.less_than_or_equal_f32s(norm.value, norm.simd.splat_f32s(crate::view::TINY_QUATERNION));
    let inverse = one / norm;
    let (w, x) = (one.where_set(tiny, w * inverse), zero.where_set(tiny, x * inverse));
    let (y, z) = (zero.where_set(tiny, y * inverse), zero.where_set(tiny, z * inverse));
    [
        [one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)],
        [two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)],
        [two * (x * z + w * y), two * (y * z - w * x), one - two * (x * x + y * y)],
    ]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: [V<S>; 3], b: [V<S>; 3]) -> V<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
fn cross<S: Simd>(a: [V<S>; 3], b: [V<S>; 3]) -> [V<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests;
