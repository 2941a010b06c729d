//! All inputs but the harmonics as one buffer for kernels to read, and the cotangents of these inputs, which
//! one buffer holds input by input.

use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::tensor::{Shape, TensorData};
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeBackend, CubeTensor, contiguous, units};

use super::super::ops::ViewSpec;
use super::chain::parameters;
use super::frame::{Frame, HEADER, PARAMETERS, header};
use super::pose::{MOTION, see_moved};

/// Numbers of a Gaussian's cotangents: centre (0), quaternion (3), log scales (7), opacity logit (10),
/// projected centre (11), and what it adds to that of the pose (13).
pub(super) const GRADIENTS: usize = 19;
/// Gaussians by whose multiples the cotangents of inputs begin: devices bind buffers from multiples of 256
/// bytes on.
const ALIGNED: usize = 64;

/// Writes the camera, moved by the pose, and by Gaussian centre, quaternion, log scales and opacity logit.
#[cube(launch)]
fn pack(
    header: &[f32],
    motion: &[f32],
    means: &[f32],
    rotations: &[f32],
    log_scales: &[f32],
    raw_opacities: &[f32],
    packed: &mut [f32],
) {
    let i = ABSOLUTE_POS;
    if i < raw_opacities.len() {
        let at = parameters(i);
        for k in 0..3usize {
            packed[at + k] = means[3usize * i + k];
            packed[at + 7usize + k] = log_scales[3usize * i + k];
        }
        for k in 0..4usize {
            packed[at + 3usize + k] = rotations[4usize * i + k];
        }
        packed[at + 10usize] = raw_opacities[i];
    }
    if i == 0usize {
        for k in 0..HEADER {
            packed[k] = header[k];
        }
        see_moved(packed, motion);
    }
}

/// The inputs of a view as one buffer.
pub(super) fn packed(view: &ViewSpec, inputs: &[CubeTensor; 7]) -> CubeTensor {
    let [means, rotations, log_scales, raw_opacities, _, _, pose] = inputs;
    let (device, n) = (&means.device, means.shape()[0]);
    let header = CubeBackend::float_from_data(TensorData::new(header(view), [HEADER]), device);
    if n == 0 {
        return header;
    }
    let out = lgs_tensor::cube::empty(means, [HEADER + n * PARAMETERS], header.dtype);
    let (cubes, dim) = units(&out.client, n);
    let [motion, means, rotations, log_scales, raw_opacities] =
        [pose, means, rotations, log_scales, raw_opacities]
            .map(|input| contiguous(input.clone()).into_buffer_arg());
    let [header, to] = [header, out.clone()].map(CubeTensor::into_buffer_arg);
    pack::launch(&out.client, cubes, dim, header, motion, means, rotations, log_scales, raw_opacities, to);
    out
}

/// Where the cotangents of an input begin whose numbers follow so many others of each Gaussian.
#[cube]
pub(super) fn section(numbers: usize, frame: &Frame) -> usize {
    (frame.gaussians as usize + (ALIGNED - 1)) / ALIGNED * ALIGNED * numbers
}

/// Floats of the cotangents of so many Gaussians.
pub(super) fn cotangents(gaussians: usize) -> usize {
    gaussians.next_multiple_of(ALIGNED) * GRADIENTS
}

/// The cotangents of `n` Gaussians: of centres, quaternions, log scales, opacity logits, projected centres,
/// and what each adds to that of the pose.
pub(super) fn cut(out: &CubeTensor, n: usize) -> [CubeTensor; 6] {
    let sections = [(0, 3), (3, 4), (7, 3), (10, 1), (11, 2), (13, MOTION)];
    sections.map(|(first, width)| {
        let shape: Shape = if width == 1 { [n].into() } else { [n, width].into() };
        let bytes = |floats: usize| (floats * size_of::<f32>()) as u64;
        let begin = n.next_multiple_of(ALIGNED) * first;
        let behind = cotangents(n) - begin - n * width;
        let handle = out.handle.clone().offset_start(bytes(begin)).offset_end(bytes(behind));
        CubeTensor::new_contiguous(out.client.clone(), out.device.clone(), shape, handle, out.dtype)
    })
}
