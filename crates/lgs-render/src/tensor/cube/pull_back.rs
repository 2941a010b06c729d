//! From the cotangents of entries, summed in the order of their numbers, to those of parameters:
//! `crate::project_vjp`, a unit per Gaussian.

use cubecl::prelude::*;

use crate::projected::LEAST_ENERGY;

use super::blend_vjp::{COTANGENTS, no_cotangents};
use super::chain::{Chain, chain, dot, normal, parameters};
use super::color_vjp::color_vjp;
use super::frame::{Frame, PROJECTED};
use super::pack::section;
use super::pose::{MOTION, pose_vjp};

/// `2 ln 2`.
const TWICE_LN_2: f32 = 2.0 * std::f32::consts::LN_2;

/// Cotangents of the parameters, input by input ([`super::pack::cut`]), and `[n, K, 3]` of the harmonics.
#[cube(launch)]
pub(super) fn pull_back(
    packed: &[f32],
    sh: &[f32],
    projected: &[f32],
    spans: &[u32],
    sums: &[f32],
    out: &mut [f32],
    v_sh: &mut [f32],
    frame: Frame,
    #[comptime] degree: u32,
) {
    let i = ABSOLUTE_POS;
    if i < frame.gaussians as usize {
        if spans[2usize * i + 1usize] > 0u32 {
            let v = total(sums, i);
            let chain = chain(packed, i);
            let v_direction = color_vjp(packed, (sh, projected), i, &v, v_sh, &frame, degree);
            let (v_camera, turned) = shape_vjp(packed, projected, i, &chain, &v, out, &frame);
            leave_centre(packed, i, &v_camera, &v_direction, out);
            let at = section(13usize, &frame) + i * MOTION;
            pose_vjp(packed, &chain, &v_camera, &turned, &v_direction, out, at);
        } else {
            leave_none(i, out, v_sh, &frame);
        }
    }
}

/// Writes that a Gaussian without entries has no cotangents.
#[cube]
fn leave_none(i: usize, out: &mut [f32], v_sh: &mut [f32], frame: &Frame) {
    for k in 0..3usize {
        out[3usize * i + k] = 0.0f32;
        out[section(7usize, frame) + 3usize * i + k] = 0.0f32;
    }
    for k in 0..4usize {
        out[section(3usize, frame) + 4usize * i + k] = 0.0f32;
    }
    out[section(10usize, frame) + i] = 0.0f32;
    out[section(11usize, frame) + 2usize * i] = 0.0f32;
    out[section(11usize, frame) + 2usize * i + 1usize] = 0.0f32;
    for k in 0..MOTION {
        out[section(13usize, frame) + MOTION * i + k] = 0.0f32;
    }
    let stride = frame.coefficients as usize * 3usize;
    for k in 0..stride {
        v_sh[i * stride + k] = 0.0f32;
    }
}

/// The sums `[n, COTANGENTS]` of the cotangents of each Gaussian's entries, a unit per number.
#[cube(launch)]
pub(super) fn sum_entries(spans: &[u32], v_entries: &[f32], sums: &mut [f32]) {
    if ABSOLUTE_POS < sums.len() {
        let (i, number) = (ABSOLUTE_POS / COTANGENTS, ABSOLUTE_POS % COTANGENTS);
        let begin = spans[2usize * i] as usize;
        let end = begin + spans[2usize * i + 1usize] as usize;
        let mut sum = 0.0f32;
        for entry in begin..end {
            sum += v_entries[entry * COTANGENTS + number];
        }
        sums[ABSOLUTE_POS] = sum;
    }
}

/// The sum of the cotangents of a Gaussian's entries.
#[cube]
fn total(sums: &[f32], i: usize) -> Array<f32> {
    let mut v = no_cotangents();
    #[unroll]
    for k in 0..COTANGENTS {
        v[k] = sums[i * COTANGENTS + k];
    }
    v
}

/// Writes cotangents of everything but the colour; gives those of the centre in camera axes, and of the rows
/// of `J W` in the Gaussian's axes.
#[cube]
fn shape_vjp(
    packed: &[f32],
    projected: &[f32],
    i: usize,
    chain: &Chain,
    v: &Array<f32>,
    out: &mut [f32],
    frame: &Frame,
) -> (Array<f32>, Array<f32>) {
    let conic = conic(projected, i);
    let v_x = conic[0usize] * v[1usize] + conic[1usize] * v[2usize];
    let v_y = conic[1usize] * v[1usize] + conic[2usize] * v[2usize];
    let centre = section(11usize, frame) + 2usize * i;
    out[centre] = v_x;
    out[centre + 1usize] = v_y;
    let opacity = 1.0f32 / (1.0f32 + (-packed[parameters(i) + 10usize]).exp());
    out[section(10usize, frame) + i] = v[0usize] * (1.0f32 - opacity);
    let v_m = axes_vjp(packed, chain, &covariance_vjp(&conic, v), v[0usize]);
    let scales = section(7usize, frame) + 3usize * i;
    for axis in 0..3usize {
        out[scales + axis] = v_m[axis] * chain.m[axis] + v_m[3usize + axis] * chain.m[3usize + axis];
    }
    let mut turned = Array::<f32>::new(6usize);
    for k in 0..3usize {
        turned[k] = v_m[k] * chain.scales[k];
        turned[3usize + k] = v_m[3usize + k] * chain.scales[k];
    }
    quaternion_vjp(packed, i, &rotation_vjp(chain, &turned), out, frame);
    let v_camera = centre_vjp(packed, chain, (v_x, v_y), &turned);
    (v_camera, turned)
}

/// The conic `[xx, xy, yy]` of a projected Gaussian.
#[cube]
fn conic(projected: &[f32], i: usize) -> Array<f32> {
    let g = i * PROJECTED;
    let (f0, f1, f2) = (projected[g + 2usize], projected[g + 3usize], projected[g + 4usize]);
    let mut k = Array::<f32>::new(3usize);
    k[0usize] = TWICE_LN_2 * f0 * f0;
    k[1usize] = TWICE_LN_2 * f0 * f1;
    k[2usize] = TWICE_LN_2 * (f1 * f1 + f2 * f2);
    k
}

/// Cotangent `K (½ v) K` of the covariance `[xx, xy, yy]`, given the moments.
#[cube]
fn covariance_vjp(k: &Array<f32>, v: &Array<f32>) -> Array<f32> {
    let (xx, xy, yy) = (0.5f32 * v[3usize], 0.5f32 * v[4usize], 0.5f32 * v[5usize]);
    let (a, b) = (k[0usize] * xx + k[1usize] * xy, k[0usize] * xy + k[1usize] * yy);
    let (c, d) = (k[1usize] * xx + k[2usize] * xy, k[1usize] * xy + k[2usize] * yy);
    let mut out = Array::<f32>::new(3usize);
    out[0usize] = a * k[0usize] + b * k[1usize];
    out[1usize] = a * k[1usize] + b * k[2usize];
    out[2usize] = c * k[1usize] + d * k[2usize];
    out
}

/// Cotangent of `M = J W R S`, given those of the covariance and of the logarithm of the opacity.
#[cube]
fn axes_vjp(packed: &[f32], chain: &Chain, v: &Array<f32>, v_log_opacity: f32) -> Array<f32> {
    let m = &chain.m;
    let mut out = Array::<f32>::new(6usize);
    for k in 0..3usize {
        out[k] = 2.0f32 * (v[0usize] * m[k] + v[1usize] * m[3usize + k]);
        out[3usize + k] = 2.0f32 * (v[1usize] * m[k] + v[2usize] * m[3usize + k]);
    }
    let blur = packed[22usize];
    let n = normal(m);
    let area = dot(&n, 0usize, &n, 0usize);
    let widened = blur * (dot(m, 0usize, m, 0usize) + dot(m, 3usize, m, 3usize)) + blur * blur;
    let determinant = area + widened;
    if packed[23usize] > 0.5f32 && area / determinant > LEAST_ENERGY {
        let by_area = v_log_opacity * widened / (area * determinant);
        let by_blur = -(v_log_opacity * blur / determinant);
        for k in 0..3usize {
            let (next, last) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
            out[k] =
                out[k] + (m[3usize + next] * n[last] - m[3usize + last] * n[next]) * by_area + m[k] * by_blur;
            out[3usize + k] =
                out[3usize + k] + (n[next] * m[last] - n[last] * m[next]) * by_area + m[3usize + k] * by_blur;
        }
    }
    out
}

/// Cotangent of the rotation matrix, row by row.
#[cube]
fn rotation_vjp(chain: &Chain, turned: &Array<f32>) -> Array<f32> {
    let mut v = Array::<f32>::new(9usize);
    for row in 0..3usize {
        for k in 0..3usize {
            v[3usize * row + k] =
                turned[k] * chain.world[row] + turned[3usize + k] * chain.world[3usize + row];
        }
    }
    v
}

/// Cotangent of the raw quaternion, given that of the rotation matrix.
#[cube]
fn quaternion_vjp(packed: &[f32], i: usize, v: &Array<f32>, out: &mut [f32], frame: &Frame) {
    let at = section(3usize, frame) + 4usize * i;
    let q = parameters(i) + 3usize;
    let (a, b, c, d) = (packed[q], packed[q + 1usize], packed[q + 2usize], packed[q + 3usize]);
    let length = (a * a + b * b + c * c + d * d).sqrt();
    if length > crate::view::TINY_QUATERNION {
        let inverse = 1.0f32 / length;
        let (w, x, y, z) = (a * inverse, b * inverse, c * inverse, d * inverse);
        let v_w = 2.0f32
            * (x * (v[7usize] - v[5usize]) + y * (v[2usize] - v[6usize]) + z * (v[3usize] - v[1usize]));
        let v_x = 2.0f32
            * (w * (v[7usize] - v[5usize]) - 2.0f32 * x * (v[4usize] + v[8usize])
                + y * (v[1usize] + v[3usize])
                + z * (v[2usize] + v[6usize]));
        let v_y = 2.0f32
            * (w * (v[2usize] - v[6usize]) + x * (v[1usize] + v[3usize])
                - 2.0f32 * y * (v[0usize] + v[8usize])
                + z * (v[5usize] + v[7usize]));
        let v_z = 2.0f32
            * (w * (v[3usize] - v[1usize]) + x * (v[2usize] + v[6usize]) + y * (v[5usize] + v[7usize])
                - 2.0f32 * z * (v[0usize] + v[4usize]));
        let radial = w * v_w + x * v_x + y * v_y + z * v_z;
        out[at] = (v_w - radial * w) * inverse;
        out[at + 1usize] = (v_x - radial * x) * inverse;
        out[at + 2usize] = (v_y - radial * y) * inverse;
        out[at + 3usize] = (v_z - radial * z) * inverse;
    } else {
        for k in 0..4usize {
            out[at + k] = 0.0f32;
        }
    }
}

/// The cotangent of the centre in camera axes through its projection and through the Jacobian; a clamped axis
/// passes nothing from the latter to its own coordinate.
#[cube]
fn centre_vjp(packed: &[f32], chain: &Chain, v_centre: (f32, f32), turned: &Array<f32>) -> Array<f32> {
    let z = chain.camera[2usize];
    let mut v = Array::<f32>::new(3usize);
    v[2usize] = 0.0f32;
    for row in 0..2usize {
        let focal = packed[12usize + row] / z;
        let slope = chain.camera[row] / z;
        let by_centre = select(row == 0usize, v_centre.0, v_centre.1);
        let mut v_focal = 0.0f32;
        let mut v_tangent = 0.0f32;
        for k in 0..3usize {
            // Row i of J W is (focal / z) (W_i - tangent_i W_2).
            let v_world = turned[3usize * row] * chain.rotation[3usize * k]
                + turned[3usize * row + 1usize] * chain.rotation[3usize * k + 1usize]
                + turned[3usize * row + 2usize] * chain.rotation[3usize * k + 2usize];
            let forward = packed[6usize + k];
            v_focal += v_world * (packed[3usize * row + k] - forward * chain.tangent[row]);
            v_tangent -= focal * v_world * forward;
        }
        let free = slope == chain.tangent[row];
        v[row] = focal * by_centre + select(free, v_tangent / z, 0.0f32);
        v[2usize] = v[2usize]
            - focal * slope * by_centre
            - focal / z * v_focal
            - select(free, slope / z * v_tangent, 0.0f32);
    }
    v
}

/// Writes the cotangent of the centre, given that in camera axes and that by the direction of view.
#[cube]
fn leave_centre(packed: &[f32], i: usize, v: &Array<f32>, v_direction: &Array<f32>, out: &mut [f32]) {
    for k in 0..3usize {
        out[3usize * i + k] = packed[k] * v[0usize]
            + packed[3usize + k] * v[1usize]
            + packed[6usize + k] * v[2usize]
            + v_direction[k];
    }
}
