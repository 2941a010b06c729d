//! The camera's pose: the motion under which it sees the scene, and the gradient by it
//! (`crate::project_vjp`): what each Gaussian adds to it, and their sum.

use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{exponential, matrix};
use lgs_tensor::cube::sums::sums;
use lgs_tensor::cube::{CubeBackend, CubeTensor};

use super::chain::Chain;

/// Numbers of a motion of the scene in camera axes: rotation vector, translation.
pub(super) const MOTION: usize = 6;

/// Moves the camera that a buffer begins with ([`super::frame::header`]) as
/// [`lgs_core::Camera::seeing_moved`] does; without a motion it stays as it is to the last bit.
#[cube]
pub(super) fn see_moved(packed: &mut [f32], motion: &[f32]) {
    let mut size = 0.0f32;
    for k in 0..MOTION {
        size += motion[k].abs();
    }
    if size > 0.0f32 {
        let turn = matrix(&exponential(motion, 0usize));
        let mut pose = Array::<f32>::new(12usize);
        for k in 0..12usize {
            pose[k] = packed[k];
        }
        for row in 0..3usize {
            for k in 0..3usize {
                packed[3usize * row + k] = turn[3usize * row] * pose[k]
                    + turn[3usize * row + 1usize] * pose[3usize + k]
                    + turn[3usize * row + 2usize] * pose[6usize + k];
            }
            packed[9usize + row] = turn[3usize * row] * pose[9usize]
                + turn[3usize * row + 1usize] * pose[10usize]
                + turn[3usize * row + 2usize] * pose[11usize]
                + motion[3usize + row];
        }
        // The centre is −Wᵀ t, which only the shift moves.
        for k in 0..3usize {
            packed[18usize + k] = packed[18usize + k]
                - packed[k] * motion[3usize]
                - packed[3usize + k] * motion[4usize]
                - packed[6usize + k] * motion[5usize];
        }
    }
}

/// Writes the cotangent of a small motion `p → p + ω × p + τ` of a Gaussian in camera axes as (ω, τ), given
/// those of its centre in camera axes, of the rows of `J W` in the Gaussian's axes, and of its centre by the
/// colour alone.
///
/// The motion turns the camera's rotation W by ω, and moves its centre by −Wᵀτ, on which directions of view
/// depend.
#[cube]
pub(super) fn pose_vjp(
    packed: &[f32],
    chain: &Chain,
    v_camera: &Array<f32>,
    turned: &Array<f32>,
    v_direction: &Array<f32>,
    out: &mut [f32],
    at: usize,
) {
    // Row i of J W is (focal / z) (W_i - tangent_i W_2).
    let mut rows = Array::<f32>::new(9usize);
    for k in 0..3usize {
        rows[6usize + k] = 0.0f32;
    }
    for row in 0..2usize {
        let focal = packed[12usize + row] / chain.camera[2usize];
        for k in 0..3usize {
            let v_world = turned[3usize * row] * chain.rotation[3usize * k]
                + turned[3usize * row + 1usize] * chain.rotation[3usize * k + 1usize]
                + turned[3usize * row + 2usize] * chain.rotation[3usize * k + 2usize];
            rows[3usize * row + k] = focal * v_world;
            rows[6usize + k] = rows[6usize + k] - chain.tangent[row] * focal * v_world;
        }
    }
    for k in 0..3usize {
        let (next, last) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
        let mut turn = chain.camera[next] * v_camera[last] - chain.camera[last] * v_camera[next];
        let mut shift = v_camera[k];
        for j in 0..3usize {
            turn += rows[3usize * last + j] * packed[3usize * next + j]
                - rows[3usize * next + j] * packed[3usize * last + j];
            shift += packed[3usize * k + j] * v_direction[j];
        }
        out[at + k] = turn;
        out[at + 3usize + k] = shift;
    }
}

/// The sum `[MOTION]` of rows, of which there is one at least.
pub(super) fn summed(rows: &CubeTensor) -> CubeTensor {
    let sum = sums(rows, [1, rows.shape()[0], MOTION]);
    CubeBackend::float_reshape(sum, [MOTION].into())
}
