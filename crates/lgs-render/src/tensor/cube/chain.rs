//! From a Gaussian's parameters to its covariance on the image: `crate::view::Chain` on the device.

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::matrix;

use crate::view::TINY_QUATERNION;

use super::frame::{HEADER, PARAMETERS};

/// Intermediate matrices, row by row.
#[derive(CubeType)]
pub(super) struct Chain {
    /// Centre in camera axes.
    pub(super) camera: Array<f32>,
    /// Clamped x/z and y/z.
    pub(super) tangent: Array<f32>,
    /// Rotation of the Gaussian, 3×3.
    pub(super) rotation: Array<f32>,
    /// `J W`, 2×3.
    pub(super) world: Array<f32>,
    /// Standard deviations.
    pub(super) scales: Array<f32>,
    /// `M = J W R S`, 2×3.
    pub(super) m: Array<f32>,
}

/// Place of the parameters of Gaussian number `i`.
#[cube]
pub(super) fn parameters(i: usize) -> usize {
    HEADER + i * PARAMETERS
}

/// The rotation of a raw quaternion; a (near) zero one is the identity.
#[cube]
fn rotation(packed: &[f32], at: usize) -> Array<f32> {
    let (a, b, c, d) = (packed[at], packed[at + 1usize], packed[at + 2usize], packed[at + 3usize]);
    let norm = (a * a + b * b + c * c + d * d).sqrt();
    let tiny = norm <= TINY_QUATERNION;
    let inverse = 1.0f32 / select(tiny, 1.0f32, norm);
    let mut unit = Array::<f32>::new(4usize);
    unit[0usize] = select(tiny, 1.0f32, a * inverse);
    unit[1usize] = select(tiny, 0.0f32, b * inverse);
    unit[2usize] = select(tiny, 0.0f32, c * inverse);
    unit[3usize] = select(tiny, 0.0f32, d * inverse);
    matrix(&unit)
}

/// The chain of Gaussian number `i`.
#[cube]
pub(super) fn chain(packed: &[f32], i: usize) -> Chain {
    let at = parameters(i);
    let mut camera = Array::<f32>::new(3usize);
    for row in 0..3usize {
        camera[row] = packed[3usize * row] * packed[at]
            + packed[3usize * row + 1usize] * packed[at + 1usize]
            + packed[3usize * row + 2usize] * packed[at + 2usize]
            + packed[9usize + row];
    }
    let rotation = rotation(packed, at + 3usize);
    let mut scales = Array::<f32>::new(3usize);
    for axis in 0..3usize {
        scales[axis] = packed[at + 7usize + axis].exp();
    }
    let mut tangent = Array::<f32>::new(2usize);
    let mut world = Array::<f32>::new(6usize);
    let mut m = Array::<f32>::new(6usize);
    for row in 0..2usize {
        let limit = packed[16usize + row];
        tangent[row] = (camera[row] / camera[2usize]).max(-limit).min(limit);
        let focal = packed[12usize + row] / camera[2usize];
        for k in 0..3usize {
            world[3usize * row + k] = (packed[3usize * row + k] - packed[6usize + k] * tangent[row]) * focal;
        }
        for k in 0..3usize {
            let turned = world[3usize * row] * rotation[k]
                + world[3usize * row + 1usize] * rotation[3usize + k]
                + world[3usize * row + 2usize] * rotation[6usize + k];
            m[3usize * row + k] = turned * scales[k];
        }
    }
    Chain { camera, tangent, rotation, world, scales, m }
}

/// The vector product of the rows of `M`.
#[cube]
pub(super) fn normal(m: &Array<f32>) -> Array<f32> {
    let mut n = Array::<f32>::new(3usize);
    n[0usize] = m[1usize] * m[5usize] - m[2usize] * m[4usize];
    n[1usize] = m[2usize] * m[3usize] - m[0usize] * m[5usize];
    n[2usize] = m[0usize] * m[4usize] - m[1usize] * m[3usize];
    n
}

/// The scalar product of three entries of a matrix, from `at`, with three of another, from `with`.
#[cube]
pub(super) fn dot(a: &Array<f32>, at: usize, b: &Array<f32>, with: usize) -> f32 {
    a[at] * b[with] + a[at + 1usize] * b[with + 1usize] + a[at + 2usize] * b[with + 2usize]
}

/// The unit direction from the camera to Gaussian number `i`, and the distance in the fourth place; at the
/// camera itself the direction is z.
#[cube]
pub(super) fn direction(packed: &[f32], i: usize) -> Array<f32> {
    let at = parameters(i);
    let mut out = Array::<f32>::new(4usize);
    let x = packed[at] - packed[18usize];
    let y = packed[at + 1usize] - packed[19usize];
    let z = packed[at + 2usize] - packed[20usize];
    let length = (x * x + y * y + z * z).sqrt();
    let far = length > 1e-12f32;
    let inverse = 1.0f32 / select(far, length, 1.0f32);
    out[0usize] = select(far, x * inverse, 0.0f32);
    out[1usize] = select(far, y * inverse, 0.0f32);
    out[2usize] = select(far, z * inverse, 1.0f32);
    out[3usize] = select(far, length, 3.0e38f32);
    out
}
