//! Gaussians as tensors on the device where training runs.

use burn::tensor::{Device, Int, Tensor, TensorData};
use lgs_core::{GaussianCloud, SH_C0};
use lgs_render::tensor::SplatTensors;

use crate::adam::values;

/// A slice of rows as a `[n, D]` tensor.
pub(crate) fn rows<const D: usize>(values: &[[f32; D]], device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values.as_flattened().to_vec(), [values.len(), D]), device)
}

/// A slice as a `[n]` tensor.
pub(crate) fn vector(values: &[f32], device: &Device) -> Tensor<1> {
    Tensor::from_data(TensorData::new(values.to_vec(), [values.len()]), device)
}

/// Row numbers as a `[n]` tensor.
pub(crate) fn row_indices(rows: impl IntoIterator<Item = usize>, device: &Device) -> Tensor<1, Int> {
    let rows: Vec<i32> = rows.into_iter().map(|row| row as i32).collect();
    Tensor::from_ints(rows.as_slice(), device)
}

/// The rows of a `[n, D]` tensor, on the host.
pub(crate) fn host_rows<const D: usize>(tensor: &Tensor<2>) -> Vec<[f32; D]> {
    values(tensor).as_chunks::<D>().0.to_vec()
}

/// Hamilton products `a ⊗ b` of `[n, 4]` quaternions `[w, x, y, z]`.
pub(crate) fn quat_mul(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let part = |q: &Tensor<2>, i: usize| q.clone().narrow(1, i, 1);
    let term = |i, j| part(a, i) * part(b, j);
    Tensor::cat(
        vec![
            term(0, 0) - term(1, 1) - term(2, 2) - term(3, 3),
            term(0, 1) + term(1, 0) + term(2, 3) - term(3, 2),
            term(0, 2) - term(1, 3) + term(2, 0) + term(3, 1),
            term(0, 3) + term(1, 2) - term(2, 1) + term(3, 0),
        ],
        1,
    )
}

/// Matrices `[n, 4, 4]` of the Hamilton products `q ⊗ ·` of quaternions `[n, 4]`. Where only the other factor
/// has a gradient, [`products`] with them have a graph of a few nodes in place of the dozens of [`quat_mul`].
pub(crate) fn quat_matrices(quaternions: Tensor<2>) -> Tensor<3> {
    let ([n, _], device) = (quaternions.dims(), quaternions.device());
    let columns = row_indices([0, 1, 2, 3, 1, 0, 3, 2, 2, 3, 0, 1, 3, 2, 1, 0], &device);
    let signs = vector(
        &[1.0, -1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0],
        &device,
    );
    (quaternions.select(1, columns) * signs.reshape([1, 16])).reshape([n, 4, 4])
}

/// Products `[n, k]` of matrices `[n, k, k]` with vectors `[n, k]`, row by row.
pub(crate) fn products(matrices: Tensor<3>, vectors: Tensor<2>) -> Tensor<2> {
    let [n, k] = vectors.dims();
    (matrices * vectors.reshape([n, 1, k])).sum_dim(2).reshape([n, k])
}

/// Vectors `[n, 3]` turned by quaternions `[n, 4]`, or by one `[1, 4]`, of any length.
pub(crate) fn quat_rotate(rotations: &Tensor<2>, vectors: Tensor<2>) -> Tensor<2> {
    let ([n, _], device) = (vectors.dims(), vectors.device());
    let squares = rotations.clone().square().sum_dim(1);
    let signs = Tensor::<1>::from_floats([1.0, -1.0, -1.0, -1.0], &device).reshape([1, 4]);
    let back = rotations.clone() * signs / squares.clamp_min(f32::MIN_POSITIVE);
    let vectors = Tensor::cat(vec![Tensor::zeros([n, 1], &device), vectors], 1);
    quat_mul(&quat_mul(rotations, &vectors), &back).narrow(1, 1, 3)
}

/// The raw parameters of n Gaussians, as the rasterizer takes them.
#[derive(Clone)]
pub(crate) struct CloudTensors {
    /// `[n, 3]`, world units.
    pub(crate) means: Tensor<2>,
    /// Quaternions `[n, 4]`, w first.
    pub(crate) rotations: Tensor<2>,
    /// `[n, 3]`.
    pub(crate) log_scales: Tensor<2>,
    /// Logits `[n]`.
    pub(crate) raw_opacities: Tensor<1>,
    /// Spherical-harmonic coefficients `[n, K, 3]`.
    pub(crate) sh: Tensor<3>,
}

impl CloudTensors {
    /// A cloud on a device.
    pub(crate) fn new(cloud: &GaussianCloud, device: &Device) -> Self {
        let sh = TensorData::new(cloud.sh.clone(), [cloud.len(), cloud.sh_stride() / 3, 3]);
        Self {
            means: rows(&cloud.means, device),
            rotations: rows(&cloud.rotations, device),
            log_scales: rows(&cloud.log_scales, device),
            raw_opacities: vector(&cloud.raw_opacities, device),
            sh: Tensor::from_data(sh, device),
        }
    }

    /// The cloud on the host.
    pub(crate) fn cloud(&self, sh_degree: usize) -> GaussianCloud {
        GaussianCloud {
            means: host_rows(&self.means),
            rotations: host_rows(&self.rotations),
            log_scales: host_rows(&self.log_scales),
            raw_opacities: values(&self.raw_opacities),
            sh: values(&self.sh),
            sh_degree,
        }
    }

    /// The same Gaussians as constants of a graph.
    pub(crate) fn autodiff(self) -> Self {
        Self {
            means: self.means.autodiff(),
            rotations: self.rotations.autodiff(),
            log_scales: self.log_scales.autodiff(),
            raw_opacities: self.raw_opacities.autodiff(),
            sh: self.sh.autodiff(),
        }
    }

    /// The Gaussians with their colours multiplied by factors `[n]` ([`lgs_model::Shading`]).
    pub(crate) fn lit(self, gains: Tensor<1>) -> Self {
        let [n, coefficients, _] = self.sh.dims();
        // A colour is a half more than its harmonics give.
        let half = |coefficient: usize| if coefficient == 0 { 0.5 / SH_C0 } else { 0.0 };
        let halves: Vec<f32> = (0..3 * coefficients).map(|column| half(column / 3)).collect();
        let halves = vector(&halves, &self.sh.device()).reshape([1, 3 * coefficients]);
        let lit = (self.sh.reshape([n, 3 * coefficients]) + halves.clone()) * gains.reshape([n, 1]) - halves;
        Self { sh: lit.reshape([n, coefficients, 3]), ..self }
    }

    /// Number of Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.means.dims()[0]
    }

    /// Some of the Gaussians, by row.
    pub(crate) fn select(&self, rows: &Tensor<1, Int>) -> Self {
        Self {
            means: self.means.clone().select(0, rows.clone()),
            rotations: self.rotations.clone().select(0, rows.clone()),
            log_scales: self.log_scales.clone().select(0, rows.clone()),
            raw_opacities: self.raw_opacities.clone().select(0, rows.clone()),
            sh: self.sh.clone().select(0, rows.clone()),
        }
    }

    /// These Gaussians and others behind them.
    pub(crate) fn followed_by(self, others: Self) -> Self {
        if self.len() == 0 {
            return others;
        }
        if others.len() == 0 {
            return self;
        }
        Self {
            means: Tensor::cat(vec![self.means, others.means], 0),
            rotations: Tensor::cat(vec![self.rotations, others.rotations], 0),
            log_scales: Tensor::cat(vec![self.log_scales, others.log_scales], 0),
            raw_opacities: Tensor::cat(vec![self.raw_opacities, others.raw_opacities], 0),
            sh: Tensor::cat(vec![self.sh, others.sh], 0),
        }
    }

    /// The rasterizer's input; `probe` `[n, 2]` receives the gradient by the projected centres.
    pub(crate) fn splats(self, probe: Tensor<2>) -> SplatTensors {
        let Self { means, rotations, log_scales, raw_opacities, sh } = self;
        let pose = Tensor::zeros([6], &means.device());
        SplatTensors { means, rotations, log_scales, raw_opacities, sh, means2d_probe: probe, pose }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DeviceName;
    use lgs_core::linear;

    #[test]
    fn products_by_matrices_of_quaternions_are_hamilton_products() {
        let device = DeviceName::Cpu.device();
        let (a, b) =
            ([[0.4, -0.2, 0.7, 0.5], [1.0, 0.3, -0.6, 0.1]], [[-0.3, 0.9, 0.2, 0.6], [0.2, 0.4, 0.8, -0.5]]);
        let by_matrices = products(quat_matrices(rows(&a, &device)), rows(&b, &device));
        let by_parts = quat_mul(&rows(&a, &device), &rows(&b, &device));
        let found: [Vec<[f32; 4]>; 2] = [host_rows(&by_matrices), host_rows(&by_parts)];
        for (row, (a, b)) in a.into_iter().zip(b).enumerate() {
            let expected = linear::quat_mul(a, b);
            for i in 0..4 {
                assert!(found.iter().all(|rows| (rows[row][i] - expected[i]).abs() < 1e-6), "{found:?}");
            }
        }
    }
}
