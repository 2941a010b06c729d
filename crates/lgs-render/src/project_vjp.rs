//! The vector–Jacobian product of `project`, one Gaussian at a time.

use crate::projected::{LEAST_ENERGY, Projected};
use crate::sh;
use crate::splats::Splats;
use crate::view::{Chain, TINY_QUATERNION, View};
use lgs_core::PixelFilter;
use lgs_core::linear::{Mat3, add, cross, dot, mat_vec, scale, sub, transpose};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Sums over pixels of what blending sends back to one Gaussian.
///
/// With `v` the cotangent of the exponent at a pixel and `d` the pixel minus the mean, `moments` are the sums
/// of `[v, v d_x, v d_y, v d_x², v d_x d_y, v d_y²]`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ImageCotangent {
    pub moments: [f32; 6],
    pub color: [f32; 3],
}

impl ImageCotangent {
    #[inline(always)]
    pub(crate) fn accumulate(&mut self, other: &Self) {
        for (a, b) in self.moments.iter_mut().zip(other.moments) {
            *a += b;
        }
        for (a, b) in self.color.iter_mut().zip(other.color) {
            *a += b;
        }
    }
}

/// An [`ImageCotangent`] that any thread may replace; no cell is written by two threads between two joins.
#[derive(Debug, Default)]
pub(crate) struct CotangentCell {
    moments: [AtomicU32; 6],
    color: [AtomicU32; 3],
}

impl CotangentCell {
    #[inline(always)]
    pub(crate) fn set(&self, v: &ImageCotangent) {
        self.moments.iter().zip(v.moments).for_each(|(cell, v)| cell.store(v.to_bits(), Relaxed));
        self.color.iter().zip(v.color).for_each(|(cell, v)| cell.store(v.to_bits(), Relaxed));
    }

    #[inline(always)]
    pub(crate) fn get(&self) -> ImageCotangent {
        let mut out = ImageCotangent::default();
        out.moments
            .iter_mut()
            .zip(&self.moments)
            .for_each(|(v, cell)| *v = f32::from_bits(cell.load(Relaxed)));
        out.color.iter_mut().zip(&self.color).for_each(|(v, cell)| *v = f32::from_bits(cell.load(Relaxed)));
        out
    }
}

/// Cotangents of the parameters of one Gaussian, its SH coefficients excepted.
#[derive(Default)]
pub(crate) struct ParameterCotangent {
    pub mean: [f32; 3],
    pub rotation: [f32; 4],
    pub log_scale: [f32; 3],
    pub raw_opacity: f32,
    pub mean2d: [f32; 2],
    /// Of a small motion of the Gaussian in camera axes: rotation vector, translation.
    pub pose: [f32; 6],
}

/// Pulls the image cotangent of one Gaussian back to its parameters; `v_sh` (zero on entry) receives that of
/// the SH coefficients.
#[inline(always)]
pub(crate) fn project_vjp(
    splats: &Splats,
    view: &View,
    (index, projected): (usize, &Projected),
    v: &ImageCotangent,
    v_sh: &mut [f32],
) -> ParameterCotangent {
    let chain = view.chain(splats, index);
    let (v_mean2d, v_covariance) = ellipse_vjp(projected.factor, &v.moments);
    let v_m = image_axes_vjp(view, &chain.m, v_covariance, v.moments[0]);
    // ∂α/∂o · o (1 - o), and the sum of v is already o ∂α/∂o.
    let opacity = match view.filter {
        PixelFilter::Dilation => projected.log2_opacity.exp2(),
        PixelFilter::Mip => 1.0 / (1.0 + (-splats.raw_opacities[index]).exp()),
    };
    let log_scale = std::array::from_fn(|j| v_m[0][j] * chain.m[0][j] + v_m[1][j] * chain.m[1][j]);
    let v_turned =
        v_m.map(|row| [row[0] * chain.scales[0], row[1] * chain.scales[1], row[2] * chain.scales[2]]);
    let world = &chain.image_from_world;
    let v_rotation: Mat3 =
        std::array::from_fn(|i| add(scale(v_turned[0], world[0][i]), scale(v_turned[1], world[1][i])));
    let v_image_from_world = v_turned.map(|row| mat_vec(&chain.rotation, row));
    let v_camera_mean = camera_mean_vjp(view, &chain, v_mean2d, &v_image_from_world);
    let v_direction = sh::color_vjp(
        (splats.means[index], view.center),
        (splats.sh_row(index), splats.active_degree),
        projected.color,
        v.color,
        v_sh,
    );
    ParameterCotangent {
        mean: add(mat_vec(&transpose(&view.rotation), v_camera_mean), v_direction),
        rotation: quat_vjp(splats.rotations[index], &v_rotation),
        log_scale,
        raw_opacity: v.moments[0] * (1.0 - opacity),
        mean2d: v_mean2d,
        pose: pose_vjp(view, &chain, v_camera_mean, &v_image_from_world, v_direction),
    }
}

/// Cotangent of a small motion `p → p + ω × p + τ` of the scene in camera axes, as `[ω, τ]`, given those of
/// the mean in camera axes, of `J W`, and of the mean by its colour alone.
///
/// The motion turns the camera's rotation `W` by ω, and moves the camera's centre by `−Wᵀ τ`, which is what
/// directions of view depend on.
#[inline(always)]
fn pose_vjp(
    view: &View,
    chain: &Chain,
    v_camera_mean: [f32; 3],
    v_image_from_world: &[[f32; 3]; 2],
    v_direction: [f32; 3],
) -> [f32; 6] {
    let focal = view.focal.map(|focal| focal / chain.camera_mean[2]);
    let [row_x, row_y] = [0, 1].map(|i| scale(v_image_from_world[i], focal[i]));
    let row_z = add(scale(row_x, -chain.tangent[0]), scale(row_y, -chain.tangent[1]));
    let [w_x, w_y, w_z] = view.rotation;
    let by_rotation = [
        dot(row_z, w_y) - dot(row_y, w_z),
        dot(row_x, w_z) - dot(row_z, w_x),
        dot(row_y, w_x) - dot(row_x, w_y),
    ];
    let turn = add(cross(chain.camera_mean, v_camera_mean), by_rotation);
    let shift = add(v_camera_mean, mat_vec(&view.rotation, v_direction));
    [turn[0], turn[1], turn[2], shift[0], shift[1], shift[2]]
}

/// Cotangent of `M = J W R S`, given those of the covariance and of the logarithm of the opacity.
#[inline(always)]
fn image_axes_vjp(
    view: &View,
    m: &[[f32; 3]; 2],
    v_covariance: [[f32; 2]; 2],
    v_log_opacity: f32,
) -> [[f32; 3]; 2] {
    let by_covariance = v_covariance.map(|row| add(scale(m[0], 2.0 * row[0]), scale(m[1], 2.0 * row[1])));
    match view.filter {
        PixelFilter::Dilation => by_covariance,
        PixelFilter::Mip => {
            let by_energy = energy_vjp(m, view.blur, v_log_opacity);
            std::array::from_fn(|i| add(by_covariance[i], by_energy[i]))
        }
    }
}

/// Cotangent of `M = J W R S`, given that of the logarithm of the Mip filter's factor `√(N / D)` with
/// `N = |m₀ × m₁|²` and `D = N + b (|m₀|² + |m₁|²) + b²`.
#[inline(always)]
pub(crate) fn energy_vjp([m0, m1]: &[[f32; 3]; 2], blur: f32, v: f32) -> [[f32; 3]; 2] {
    let n = cross(*m0, *m1);
    let (area, widened) = (dot(n, n), blur * (dot(*m0, *m0) + dot(*m1, *m1)) + blur * blur);
    let determinant = area + widened;
    if area / determinant <= LEAST_ENERGY {
        return [[0.0; 3]; 2];
    }
    let (by_area, by_blur) = (v * widened / (area * determinant), -v * blur / determinant);
    [
        add(scale(cross(*m1, n), by_area), scale(*m0, by_blur)),
        add(scale(cross(n, *m0), by_area), scale(*m1, by_blur)),
    ]
}

/// Cotangents of the projected centre and of the covariance on the image, given the factor of the conic and
/// the moments of the exponents' cotangents.
#[inline(always)]
fn ellipse_vjp([f0, f1, f2]: [f32; 3], moments: &[f32; 6]) -> ([f32; 2], [[f32; 2]; 2]) {
    let &[_, v_x, v_y, v_xx, v_xy, v_yy] = moments;
    // The conic K = 2 ln 2 · FᵀF; the exponent falls with the mean moving away from the pixel.
    let base = 2.0 * std::f32::consts::LN_2;
    let k = [[base * f0 * f0, base * f0 * f1], [base * f0 * f1, base * (f1 * f1 + f2 * f2)]];
    let v_mean2d = [k[0][0] * v_x + k[0][1] * v_y, k[1][1] * v_y + k[0][1] * v_x];
    // v_Σ = -K (v_K) K with v_K = -½ [[v_xx, v_xy], [v_xy, v_yy]].
    let half = [[0.5 * v_xx, 0.5 * v_xy], [0.5 * v_xy, 0.5 * v_yy]];
    (v_mean2d, mul2(&mul2(&k, &half), &k))
}

/// Through the projection of the centre and through the Jacobian; a clamped axis passes nothing from the
/// latter to its own coordinate.
#[inline(always)]
fn camera_mean_vjp(
    view: &View,
    chain: &Chain,
    v_mean2d: [f32; 2],
    v_image_from_world: &[[f32; 3]; 2],
) -> [f32; 3] {
    let [x, y, z] = chain.camera_mean;
    let centre = [x, y];
    let mut v = [0.0; 3];
    for i in 0..2 {
        let focal = view.focal[i] / z;
        v[i] += focal * v_mean2d[i];
        v[2] -= focal * (centre[i] / z) * v_mean2d[i];
        // Row i of J W is (focal / z) (W_i - tangent_i W_2).
        let v_focal =
            dot(v_image_from_world[i], sub(view.rotation[i], scale(view.rotation[2], chain.tangent[i])));
        let v_tangent = -focal * dot(v_image_from_world[i], view.rotation[2]);
        v[2] -= focal / z * v_focal;
        if !chain.clamped[i] {
            v[i] += v_tangent / z;
            v[2] -= chain.tangent[i] / z * v_tangent;
        }
    }
    v
}

#[inline(always)]
fn mul2(a: &[[f32; 2]; 2], b: &[[f32; 2]; 2]) -> [[f32; 2]; 2] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

/// Cotangent of the raw quaternion, given that of the rotation matrix of its normalised form.
#[inline(always)]
fn quat_vjp(raw: [f32; 4], v: &Mat3) -> [f32; 4] {
    let length = raw.iter().map(|c| c * c).sum::<f32>().sqrt();
    // Below this the forward pass falls back to the identity, which no longer depends on the quaternion.
    if length <= TINY_QUATERNION {
        return [0.0; 4];
    }
    let [w, x, y, z] = raw.map(|c| c / length);
    let unit = [w, x, y, z];
    let v_unit = [
        2.0 * (x * (v[2][1] - v[1][2]) + y * (v[0][2] - v[2][0]) + z * (v[1][0] - v[0][1])),
        2.0 * (w * (v[2][1] - v[1][2]) - 2.0 * x * (v[1][1] + v[2][2])
            + y * (v[0][1] + v[1][0])
            + z * (v[0][2] + v[2][0])),
        2.0 * (w * (v[0][2] - v[2][0]) + x * (v[0][1] + v[1][0]) - 2.0 * y * (v[0][0] + v[2][2])
            + z * (v[1][2] + v[2][1])),
        2.0 * (w * (v[1][0] - v[0][1]) + x * (v[0][2] + v[2][0]) + y * (v[1][2] + v[2][1])
            - 2.0 * z * (v[0][0] + v[1][1])),
    ];
    let radial: f32 = (0..4).map(|i| unit[i] * v_unit[i]).sum();
    std::array::from_fn(|i| (v_unit[i] - radial * unit[i]) / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_norm_of_a_quaternion_has_no_gradient() {
        let v = [[0.3, -1.0, 0.2], [0.7, 0.1, -0.4], [0.5, 0.9, -0.6]];
        let raw = [0.6, -1.2, 0.4, 2.0];
        let g = quat_vjp(raw, &v);
        assert!(g.iter().zip(raw).map(|(a, b)| a * b).sum::<f32>().abs() < 1e-5);
        assert_eq!(quat_vjp([0.0; 4], &v), [0.0; 4]);
    }
}
