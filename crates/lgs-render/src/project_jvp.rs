//! How a Gaussian on the image changes with a small affine motion of it in the world: the forward derivative
//! of `project`, one Gaussian at a time.

use crate::project_vjp::energy_vjp;
use crate::projected::Projected;
use crate::sh;
use crate::splats::Splats;
use crate::view::{Chain, View};
use lgs_core::PixelFilter;
use lgs_core::linear::{Mat3, add, cross, dot, mat_vec, scale, sub, transpose};

/// A small affine motion `p → p + shift + linear · (p − center)` of Gaussians, which takes their covariances
/// along: a rotation vector's cross-product matrix turns them and their harmonics, a symmetric matrix strains
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineMotion {
    /// What does not move but by the shift, world units.
    pub center: [f32; 3],
    /// World units.
    pub shift: [f32; 3],
    /// Rows of the matrix.
    pub linear: Mat3,
}

/// How a Gaussian's exponent and colour change with a motion.
///
/// With `d` the pixel minus the projected mean, the natural logarithm of alpha changes by the product of
/// `exponent` with `[1, d_x, d_y, d_x², d_x d_y, d_y²]`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SplatTangent {
    pub exponent: [f32; 6],
    pub color: [f32; 3],
}

/// The tangents of one Gaussian by some motions.
pub(crate) fn project_jvp<'a>(
    splats: &'a Splats<'a>,
    view: &'a View,
    (index, projected): (usize, &'a Projected),
    motions: &'a [AffineMotion],
) -> impl Iterator<Item = SplatTangent> + 'a {
    let chain = view.chain(splats, index);
    let gradient_of_color = gradient_of_color(splats, view, (index, projected));
    motions.iter().map(move |motion| {
        let mean = splats.means[index];
        let v_mean = add(motion.shift, mat_vec(&motion.linear, sub(mean, motion.center)));
        // Of the camera's direction in the axes of the body, which the body's rotation takes back.
        let turned = cross(rotation_vector(&motion.linear), sub(mean, view.center));
        let color = gradient_of_color.map(|gradient| dot(gradient, sub(v_mean, turned)));
        SplatTangent { exponent: exponent(view, &chain, projected.factor, (v_mean, &motion.linear)), color }
    })
}

/// The rotation vector of a small linear map.
fn rotation_vector(linear: &Mat3) -> [f32; 3] {
    [linear[2][1] - linear[1][2], linear[0][2] - linear[2][0], linear[1][0] - linear[0][1]].map(|x| 0.5 * x)
}

/// The gradient of each channel by the mean; zero where a channel is clamped.
fn gradient_of_color(
    splats: &Splats<'_>,
    view: &View,
    (index, projected): (usize, &Projected),
) -> [[f32; 3]; 3] {
    if splats.active_degree == 0 {
        return [[0.0; 3]; 3];
    }
    let row = splats.sh_row(index);
    let mut unused = vec![0.0; row.len()];
    std::array::from_fn(|channel| {
        let one = std::array::from_fn(|c| f32::from(u8::from(c == channel)));
        let (at, sh) = ((splats.means[index], view.center), (row, splats.active_degree));
        sh::color_vjp(at, sh, projected.color, one, &mut unused)
    })
}

/// The tangent of the exponent, given the velocity of the mean and its gradient in space.
fn exponent(view: &View, chain: &Chain, factor: [f32; 3], (v_mean, linear): ([f32; 3], &Mat3)) -> [f32; 6] {
    let [v_x, v_y, v_z] = mat_vec(&view.rotation, v_mean);
    let [x, y, z] = chain.camera_mean;
    let slopes = [(v_x - x / z * v_z) / z, (v_y - y / z * v_z) / z];
    let v_mean2d = [view.focal[0] * slopes[0], view.focal[1] * slopes[1]];
    // The rows of J W, and with them M = J W R S.
    let back = transpose(linear);
    let v_axes: [[f32; 3]; 2] = std::array::from_fn(|i| {
        let row = chain.image_from_world[i];
        let v_tangent = if chain.clamped[i] { 0.0 } else { slopes[i] };
        let by_camera = add(scale(row, -v_z / z), scale(view.rotation[2], -view.focal[i] / z * v_tangent));
        let turned = mat_vec(&transpose(&chain.rotation), add(by_camera, mat_vec(&back, row)));
        std::array::from_fn(|j| turned[j] * chain.scales[j])
    });
    let opacity = match view.filter {
        PixelFilter::Dilation => 0.0,
        PixelFilter::Mip => {
            let by_axes = energy_vjp(&chain.m, view.blur, 1.0);
            dot(by_axes[0], v_axes[0]) + dot(by_axes[1], v_axes[1])
        }
    };
    polynomial(factor, opacity, v_mean2d, (&chain.m, &v_axes))
}

/// Coefficients of the tangent of the exponent `ln o - ½ dᵀ K d`, given the changes of `ln o`, of the mean,
/// and of M, with K the inverse of `M Mᵀ + b I`.
fn polynomial(
    [f0, f1, f2]: [f32; 3],
    opacity: f32,
    v_mean2d: [f32; 2],
    ([m0, m1], [v_m0, v_m1]): (&[[f32; 3]; 2], &[[f32; 3]; 2]),
) -> [f32; 6] {
    let (aa, ab, bb) = (2.0 * dot(*v_m0, *m0), dot(*v_m0, *m1) + dot(*m0, *v_m1), 2.0 * dot(*v_m1, *m1));
    // The conic K = 2 ln 2 · FᵀF, and half of K Σ' K.
    let base = 2.0 * std::f32::consts::LN_2;
    let (k00, k01, k11) = (base * f0 * f0, base * f0 * f1, base * (f1 * f1 + f2 * f2));
    let left = [[k00 * aa + k01 * ab, k00 * ab + k01 * bb], [k01 * aa + k11 * ab, k01 * ab + k11 * bb]];
    [
        opacity,
        k00 * v_mean2d[0] + k01 * v_mean2d[1],
        k01 * v_mean2d[0] + k11 * v_mean2d[1],
        0.5 * (left[0][0] * k00 + left[0][1] * k01),
        left[0][0] * k01 + left[0][1] * k11,
        0.5 * (left[1][0] * k01 + left[1][1] * k11),
    ]
}
