//! EWA projection of one Gaussian, and its vector–Jacobian product (`reference-systems` §2.3, contract "Rasterizer").
//!
//! With `p` the mean in camera axes, `W` the camera rotation and `J` the Jacobian of the pinhole at `p` (its `x/z`, `y/z` clamped to 1.3 times
//! the tangent of half the field of view), `M = J W R S` is 2×3 and the covariance on the image is `Σ = M Mᵀ + 0.3 I`.
//!
//! Two forms keep f32 accurate for long thin Gaussians: the determinant as `|m₀ × m₁|² + 0.3 (|m₀|² + |m₁|²) + 0.09` (Cauchy–Binet; no
//! cancellation), and the exponent as minus a sum of squares, `-½ dᵀ Σ⁻¹ d = -(u² + w²) ln 2` with `u = f₀ d_x + f₁ d_y`, `w = f₂ d_y`, so that
//! it can never be positive.

use crate::sh;
use crate::splats::Splats;
use lgs_core::Camera;
use lgs_core::linear::{Mat3, add, cross, dot, mat_vec, matrix_from_quat, scale, sub, transpose};

/// Gaussians nearer than this along the viewing axis (world units) are culled.
pub const NEAR: f32 = 0.2;
/// Low-pass filter added to the diagonal of the image covariance, square pixels.
pub const BLUR: f32 = 0.3;
/// A Gaussian contributes to a pixel if its alpha there is at least this.
pub const ALPHA_MIN: f32 = 1.0 / 255.0;
/// Alpha never exceeds this.
pub const ALPHA_MAX: f32 = 0.99;
/// Blending stops before the Gaussian that would bring transmittance below this.
pub const TRANSMITTANCE_STOP: f32 = 1e-4;
/// Clamp of `x/z` inside the Jacobian, in tangents of half the field of view.
const TANGENT_LIMIT: f32 = 1.3;

/// A camera in the form the projection wants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    rotation: Mat3,
    translation: [f32; 3],
    focal: [f32; 2],
    principal: [f32; 2],
    tangent_limit: [f32; 2],
    center: [f32; 3],
}

impl From<&Camera> for View {
    fn from(camera: &Camera) -> Self {
        let rotation = transpose(&glam::Mat3::from_mat4(camera.camera_from_world).to_cols_array_2d());
        let translation: [f32; 3] = camera.camera_from_world.w_axis.truncate().into();
        Self {
            rotation,
            translation,
            focal: [camera.fx, camera.fy],
            principal: [camera.cx, camera.cy],
            tangent_limit: [
                TANGENT_LIMIT * camera.width as f32 / (2.0 * camera.fx),
                TANGENT_LIMIT * camera.height as f32 / (2.0 * camera.fy),
            ],
            center: scale(mat_vec(&transpose(&rotation), translation), -1.0),
        }
    }
}

/// A Gaussian on the image plane: one cache line, all that tiling and blending need.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Projected {
    /// Centre in pixels.
    pub mean: [f32; 2],
    /// Distance along the viewing axis.
    pub depth: f32,
    /// In (0, 1).
    pub opacity: f32,
    /// `log2(opacity)`.
    pub log2_opacity: f32,
    /// RGB.
    pub color: [f32; 3],
    /// `[Σ_xx, Σ_xy, Σ_yy]`, blur included.
    pub covariance: [f32; 3],
    /// Determinant of the covariance.
    pub determinant: f32,
    /// `[f₀, f₁, f₂]` of the exponent in base 2 (module header).
    pub factor: [f32; 3],
    /// `2 ln(255 · opacity)`: squared Mahalanobis radius at which alpha falls to 1/255; 0 marks an invisible Gaussian.
    pub reach: f32,
}

/// What the forward and the backward pass both compute on the way to the image covariance.
struct Chain {
    camera_mean: [f32; 3],
    rotation: Mat3,
    /// `J W`, 2×3.
    image_from_world: [[f32; 3]; 2],
    /// Clamped `x/z`, `y/z`, and whether each was clamped.
    tangent: [f32; 2],
    clamped: [bool; 2],
    scales: [f32; 3],
    /// `M = J W R S`.
    m: [[f32; 3]; 2],
}

#[inline(always)]
fn chain(splats: &Splats, view: &View, index: usize, camera_mean: [f32; 3]) -> Chain {
    let [x, y, z] = camera_mean;
    let raw = [x / z, y / z];
    let tangent: [f32; 2] = std::array::from_fn(|i| raw[i].clamp(-view.tangent_limit[i], view.tangent_limit[i]));
    let clamped = std::array::from_fn(|i| raw[i] != tangent[i]);
    let image_from_world = std::array::from_fn(|i| scale(sub(view.rotation[i], scale(view.rotation[2], tangent[i])), view.focal[i] / z));
    let q = splats.rotations[index];
    let rotation = matrix_from_quat(lgs_core::linear::quat_normalize(q));
    let scales = splats.log_scales[index].map(f32::exp);
    let m = image_from_world.map(|row| {
        let turned = mat_vec(&transpose(&rotation), row);
        std::array::from_fn(|j| turned[j] * scales[j])
    });
    Chain { camera_mean, rotation, image_from_world, tangent, clamped, scales, m }
}

#[inline(always)]
fn camera_mean(splats: &Splats, view: &View, index: usize) -> [f32; 3] {
    add(mat_vec(&view.rotation, splats.means[index]), view.translation)
}

#[inline(always)]
fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

/// The image position of a mean, pixels; zero for a culled one.
pub(crate) fn pixel(splats: &Splats, view: &View, index: usize) -> [f32; 2] {
    let [x, y, z] = camera_mean(splats, view, index);
    if z > NEAR { [view.focal[0] * x / z + view.principal[0], view.focal[1] * y / z + view.principal[1]] } else { [0.0; 2] }
}

/// Projects one Gaussian; `None` if it is behind the near plane, too transparent to be seen anywhere, or not representable.
#[inline(always)]
pub(crate) fn project(splats: &Splats, view: &View, index: usize) -> Option<Projected> {
    let p = camera_mean(splats, view, index);
    let opacity = sigmoid(splats.raw_opacities[index]);
    // Written so that NaN is culled as well.
    if !(p[2] > NEAR && opacity >= ALPHA_MIN) {
        return None;
    }
    let [m0, m1] = chain(splats, view, index, p).m;
    let (a, b, c) = (dot(m0, m0) + BLUR, dot(m0, m1), dot(m1, m1) + BLUR);
    let n = cross(m0, m1);
    let determinant = dot(n, n) + BLUR * (dot(m0, m0) + dot(m1, m1)) + BLUR * BLUR;
    if !determinant.is_finite() {
        return None;
    }
    let base2 = (0.5 * std::f32::consts::LOG2_E).sqrt();
    let along = base2 * (c / determinant).sqrt();
    let mean = [view.focal[0] * p[0] / p[2] + view.principal[0], view.focal[1] * p[1] / p[2] + view.principal[1]];
    Some(Projected {
        mean,
        depth: p[2],
        opacity,
        log2_opacity: opacity.log2(),
        color: sh::color(splats.means[index], view.center, splats.sh_row(index), splats.active_degree),
        covariance: [a, b, c],
        determinant,
        factor: [along, -along * b / c, base2 / c.sqrt()],
        reach: 2.0 * (opacity / ALPHA_MIN).ln(),
    })
    .filter(|g| g.mean.iter().chain(&g.color).all(|v| v.is_finite()))
}

/// Sums over pixels of what blending sends back to one Gaussian.
///
/// With `v` the cotangent of the exponent at a pixel and `d` the pixel minus the mean, `moments` are the sums of
/// `[v, v d_x, v d_y, v d_x², v d_x d_y, v d_y²]`.
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

/// Cotangents of the parameters of one Gaussian, its SH coefficients excepted.
pub(crate) struct ParameterCotangent {
    pub mean: [f32; 3],
    pub rotation: [f32; 4],
    pub log_scale: [f32; 3],
    pub raw_opacity: f32,
    pub mean2d: [f32; 2],
}

/// Pulls the image cotangent of one Gaussian back to its parameters; `v_sh` (zero on entry) receives that of the SH coefficients.
#[inline(always)]
pub(crate) fn project_vjp(
    splats: &Splats,
    view: &View,
    (index, projected): (usize, &Projected),
    v: &ImageCotangent,
    v_sh: &mut [f32],
) -> ParameterCotangent {
    let chain = chain(splats, view, index, camera_mean(splats, view, index));
    let [v_sum, v_x, v_y, v_xx, v_xy, v_yy] = v.moments;
    let [a, b, c] = projected.covariance.map(|e| e / projected.determinant);
    // The conic is [[c, -b], [-b, a]] / det; the exponent falls with the mean moving away from the pixel.
    let v_mean2d = [c * v_x - b * v_y, a * v_y - b * v_x];
    // v_Σ = -K (v_K) K with v_K = -½ [[v_xx, v_xy], [v_xy, v_yy]].
    let (k, half) = ([[c, -b], [-b, a]], [[0.5 * v_xx, 0.5 * v_xy], [0.5 * v_xy, 0.5 * v_yy]]);
    let v_covariance = mul2(&mul2(&k, &half), &k);
    let v_m: [[f32; 3]; 2] =
        std::array::from_fn(|i| add(scale(chain.m[0], 2.0 * v_covariance[i][0]), scale(chain.m[1], 2.0 * v_covariance[i][1])));

    let log_scale = std::array::from_fn(|j| v_m[0][j] * chain.m[0][j] + v_m[1][j] * chain.m[1][j]);
    let v_turned = v_m.map(|row| [row[0] * chain.scales[0], row[1] * chain.scales[1], row[2] * chain.scales[2]]);
    let v_rotation: Mat3 =
        std::array::from_fn(|i| add(scale(v_turned[0], chain.image_from_world[0][i]), scale(v_turned[1], chain.image_from_world[1][i])));
    let v_image_from_world = v_turned.map(|row| mat_vec(&chain.rotation, row));
    let v_camera_mean = camera_mean_vjp(view, &chain, v_mean2d, &v_image_from_world);
    let v_direction =
        sh::color_vjp((splats.means[index], view.center), (splats.sh_row(index), splats.active_degree), projected.color, v.color, v_sh);
    ParameterCotangent {
        mean: add(mat_vec(&transpose(&view.rotation), v_camera_mean), v_direction),
        rotation: quat_vjp(splats.rotations[index], &v_rotation),
        log_scale,
        // ∂α/∂o · o (1 - o), and the sum of v is already o ∂α/∂o.
        raw_opacity: v_sum * (1.0 - projected.opacity),
        mean2d: v_mean2d,
    }
}

/// Through the projection of the centre and through the Jacobian; a clamped axis passes nothing from the latter to its own coordinate.
#[inline(always)]
fn camera_mean_vjp(view: &View, chain: &Chain, v_mean2d: [f32; 2], v_image_from_world: &[[f32; 3]; 2]) -> [f32; 3] {
    let [x, y, z] = chain.camera_mean;
    let centre = [x, y];
    let mut v = [0.0; 3];
    for i in 0..2 {
        let focal = view.focal[i] / z;
        v[i] += focal * v_mean2d[i];
        v[2] -= focal * (centre[i] / z) * v_mean2d[i];
        // Row i of J W is (focal / z) (W_i - tangent_i W_2).
        let v_focal = dot(v_image_from_world[i], sub(view.rotation[i], scale(view.rotation[2], chain.tangent[i])));
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
    if length <= 1e-12 {
        return [0.0; 4];
    }
    let [w, x, y, z] = raw.map(|c| c / length);
    let unit = [w, x, y, z];
    let v_unit = [
        2.0 * (x * (v[2][1] - v[1][2]) + y * (v[0][2] - v[2][0]) + z * (v[1][0] - v[0][1])),
        2.0 * (w * (v[2][1] - v[1][2]) - 2.0 * x * (v[1][1] + v[2][2]) + y * (v[0][1] + v[1][0]) + z * (v[0][2] + v[2][0])),
        2.0 * (w * (v[0][2] - v[2][0]) + x * (v[0][1] + v[1][0]) - 2.0 * y * (v[0][0] + v[2][2]) + z * (v[1][2] + v[2][1])),
        2.0 * (w * (v[1][0] - v[0][1]) + x * (v[0][2] + v[2][0]) + y * (v[1][2] + v[2][1]) - 2.0 * z * (v[0][0] + v[1][1])),
    ];
    let radial: f32 = (0..4).map(|i| unit[i] * v_unit[i]).sum();
    std::array::from_fn(|i| (v_unit[i] - radial * unit[i]) / length)
}

/// Radius in pixels of three standard deviations along the longer axis, rounded up.
pub(crate) fn radius(projected: &Projected) -> u32 {
    let [a, _, c] = projected.covariance;
    let half_trace = 0.5 * (a + c);
    let longest = half_trace + (half_trace * half_trace - projected.determinant).max(0.1).sqrt();
    (3.0 * longest.sqrt()).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factored_exponent_is_the_quadratic_form() {
        let cloud = lgs_core::GaussianCloud {
            means: vec![[0.1, 0.2, -0.1]],
            rotations: vec![[0.3, -0.5, 0.8, 0.1]],
            log_scales: vec![[-1.0, -2.5, -4.0]],
            raw_opacities: vec![0.3],
            sh: vec![0.1; 3],
            sh_degree: 0,
        };
        let camera = Camera::look_at([0.5, -3.0, 1.0], [0.0; 3], 0.8, 64, 48);
        let g = project(&Splats::from(&cloud), &View::from(&camera), 0).expect("in view");
        let [a, b, c] = g.covariance;
        assert!(((a * c - b * b) / g.determinant - 1.0).abs() < 1e-4);
        let d = [3.0, -2.0];
        let exponent = -0.5 * (c * d[0] * d[0] - 2.0 * b * d[0] * d[1] + a * d[1] * d[1]) / g.determinant;
        let (u, w) = (g.factor[0] * d[0] + g.factor[1] * d[1], g.factor[2] * d[1]);
        assert!((-(u * u + w * w) * std::f32::consts::LN_2 - exponent).abs() < 1e-4 * exponent.abs());
    }

    #[test]
    fn the_norm_of_a_quaternion_has_no_gradient() {
        let v = [[0.3, -1.0, 0.2], [0.7, 0.1, -0.4], [0.5, 0.9, -0.6]];
        let raw = [0.6, -1.2, 0.4, 2.0];
        let g = quat_vjp(raw, &v);
        assert!(g.iter().zip(raw).map(|(a, b)| a * b).sum::<f32>().abs() < 1e-5);
        assert_eq!(quat_vjp([0.0; 4], &v), [0.0; 4]);
    }
}
