//! SSIM and the photometric loss in plain tensor operations.

use crate::window::{RADIUS, weights};
use burn::tensor::{Device, Tensor, TensorData};

/// Mean SSIM of two images `[H, W, 3]`, a tensor of one value.
#[must_use]
pub fn ssim(a: &Tensor<3>, b: &Tensor<3>) -> Tensor<1> {
    let blurred = |t: Tensor<3>| blur(&t);
    let (mean_a, mean_b) = (blurred(a.clone()), blurred(b.clone()));
    let variance_a = blurred(a.clone() * a.clone()) - mean_a.clone() * mean_a.clone();
    let variance_b = blurred(b.clone() * b.clone()) - mean_b.clone() * mean_b.clone();
    let covariance = blurred(a.clone() * b.clone()) - mean_a.clone() * mean_b.clone();
    let (c1, c2) = (0.01 * 0.01, 0.03 * 0.03);
    let numerator = (mean_a.clone() * mean_b.clone()).mul_scalar(2.0).add_scalar(c1)
        * covariance.mul_scalar(2.0).add_scalar(c2);
    let denominator = (mean_a.clone() * mean_a + mean_b.clone() * mean_b).add_scalar(c1)
        * (variance_a + variance_b).add_scalar(c2);
    (numerator / denominator).mean()
}

/// `(1 - λ) mean|image - target| + λ (1 - SSIM)`, a tensor of one value.
#[must_use]
pub fn photometric_loss(image: &Tensor<3>, target: &Tensor<3>, lambda: f32) -> Tensor<1> {
    let absolute = (image.clone() - target.clone()).abs().mean();
    absolute.mul_scalar(1.0 - lambda) + ssim(image, target).neg().add_scalar(1.0).mul_scalar(lambda)
}

/// The 11×11 window with zero padding as two banded matrices.
fn blur(image: &Tensor<3>) -> Tensor<3> {
    let [height, width, _] = image.dims();
    let device = image.device();
    let rows = band_matrix(height, &device).matmul(image.clone().reshape([height, width * 3]));
    let planes = rows.reshape([height, width, 3]).permute([1, 0, 2]).reshape([width, height * 3]);
    band_matrix(width, &device).matmul(planes).reshape([width, height, 3]).permute([1, 0, 2])
}

fn band_matrix(size: usize, device: &Device) -> Tensor<2> {
    let window = weights();
    let mut values = vec![0.0; size * size];
    for i in 0..size {
        for (tap, weight) in window.iter().enumerate() {
            if let Some(j) = (i + tap).checked_sub(RADIUS).filter(|&j| j < size) {
                values[i * size + j] = *weight;
            }
        }
    }
    Tensor::from_data(TensorData::new(values, [size, size]), device)
}
