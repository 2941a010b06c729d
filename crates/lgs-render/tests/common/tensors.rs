//! Values and gradients of tensor operations against a vector's.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_render::tensor::{SplatTensors, ViewSpec};

use super::Vector;

pub(crate) const MAX_ABS: f64 = 2e-4;
pub(crate) const RELATIVE_L2: f64 = 1e-5;

/// A tensor of a vector's values, tracked.
pub(crate) fn tracked<const D: usize>(vector: &Vector, name: &str, device: &Device) -> Tensor<D> {
    constant(vector, name, device).require_grad()
}

pub(crate) fn constant<const D: usize>(vector: &Vector, name: &str, device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(vector.get(name), vector.shape(name)), device)
}

pub(crate) fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("f32 values")
}

/// How a vector is drawn.
pub(crate) fn view_of(vector: &Vector) -> ViewSpec {
    ViewSpec {
        camera: vector.camera(),
        background: vector.rows::<3>("background")[0],
        active_degree: vector.number("sh_degree") as usize,
    }
}

/// The Gaussians of a vector, tracked.
fn tracked_splats(vector: &Vector, device: &Device) -> SplatTensors {
    let n = vector.shape("means")[0];
    SplatTensors {
        means: tracked(vector, "means", device),
        rotations: tracked(vector, "quats", device),
        log_scales: tracked(vector, "log_scales", device),
        raw_opacities: tracked(vector, "opacity_logits", device),
        sh: tracked(vector, "sh", device),
        means2d_probe: Tensor::<2>::zeros([n, 2], device).require_grad(),
        pose: Tensor::<1>::zeros([6], device).require_grad(),
    }
}

/// Compares values and gradients on an autodiff device with a vector's, and gives the gradient by the pose,
/// of which the vectors say nothing.
pub(crate) fn check_tensors(
    vector: &Vector,
    device: &Device,
    draw: impl Fn(&SplatTensors, ViewSpec) -> (Tensor<3>, Tensor<2>),
) -> Vec<f32> {
    let splats = tracked_splats(vector, device);
    let (image, transmittance) = draw(&splats, view_of(vector));
    let check = |found: Vec<f32>, name: &str| {
        assert_values_close(
            &format!("{}: {name}", vector.name),
            &found,
            &vector.get(name),
            MAX_ABS,
            RELATIVE_L2,
        )
    };
    check(values(image.clone()), "image");
    check(values(transmittance.clone()), "final_transmittance");

    let loss = (image * constant(vector, "loss_weight_image", device)).sum()
        + (transmittance * constant(vector, "loss_weight_transmittance", device)).sum();
    let grads = loss.backward();
    let check = |found: Option<Vec<f32>>, name: &str| check_gradient(vector, found, name);
    check(splats.means.grad(&grads).map(values), "grad_means");
    check(splats.rotations.grad(&grads).map(values), "grad_quats");
    check(splats.log_scales.grad(&grads).map(values), "grad_log_scales");
    check(splats.raw_opacities.grad(&grads).map(values), "grad_opacity_logits");
    check(splats.sh.grad(&grads).map(values), "grad_sh");
    check(splats.means2d_probe.grad(&grads).map(values), "grad_means2d");
    values(splats.pose.grad(&grads).expect("a gradient by the pose"))
}

fn check_gradient(vector: &Vector, found: Option<Vec<f32>>, name: &str) {
    let found = found.unwrap_or_else(|| panic!("{}: {name} is missing", vector.name));
    assert_gradient_close(&format!("{}: {name}", vector.name), &found, &vector.get(name));
}
