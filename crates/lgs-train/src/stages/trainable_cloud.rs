//! The arrays of a Gaussian cloud as parameters, with the moments of their optimisers.

use burn::tensor::{Device, Gradients, Tensor};
use lgs_core::GaussianCloud;
use lgs_model::{TensorFile, TensorFileError};

use super::cloud_tensors::CloudTensors;
use super::config::TuneGaussiansConfig;
use crate::adam::{AdamGroup, values};

/// Colours' direction-dependent part learns slower by this (reference section 2.6).
const SH_REST_DIVISOR: f64 = 20.0;

/// Trainable arrays of a cloud; the constant and the direction-dependent part of the colours apart, as their
/// rates differ.
pub(super) struct TrainableCloud {
    means: AdamGroup<2>,
    rotations: AdamGroup<2>,
    log_scales: AdamGroup<2>,
    raw_opacities: AdamGroup<1>,
    sh_constant: AdamGroup<2>,
    /// None at degree 0.
    sh_rest: Option<AdamGroup<2>>,
}

/// The leaves of one step's graph.
pub(super) struct CloudLeaves {
    pub(super) means: Tensor<2>,
    rotations: Tensor<2>,
    log_scales: Tensor<2>,
    raw_opacities: Tensor<1>,
    sh_constant: Tensor<2>,
    sh_rest: Option<Tensor<2>>,
}

impl CloudLeaves {
    pub(super) fn tensors(&self) -> CloudTensors {
        let n = self.means.dims()[0];
        let constant = self.sh_constant.clone();
        let sh = match &self.sh_rest {
            Some(rest) => Tensor::cat(vec![constant, rest.clone()], 1),
            None => constant,
        };
        let coefficients = sh.dims()[1] / 3;
        CloudTensors {
            means: self.means.clone(),
            rotations: self.rotations.clone(),
            log_scales: self.log_scales.clone(),
            raw_opacities: self.raw_opacities.clone(),
            sh: sh.reshape([n, coefficients, 3]),
        }
    }
}

impl TrainableCloud {
    pub(super) fn new(cloud: &GaussianCloud, device: &Device) -> Self {
        let (n, stride) = (cloud.len(), cloud.sh_stride());
        let columns = |from: usize, to: usize| {
            cloud.sh.chunks_exact(stride).flat_map(move |row| row[from..to].iter().copied()).collect()
        };
        Self {
            means: AdamGroup::new(cloud.means.as_flattened().to_vec(), [n, 3], device),
            rotations: AdamGroup::new(cloud.rotations.as_flattened().to_vec(), [n, 4], device),
            log_scales: AdamGroup::new(cloud.log_scales.as_flattened().to_vec(), [n, 3], device),
            raw_opacities: AdamGroup::new(cloud.raw_opacities.clone(), [n], device),
            sh_constant: AdamGroup::new(columns(0, 3), [n, 3], device),
            sh_rest: (stride > 3).then(|| AdamGroup::new(columns(3, stride), [n, stride - 3], device)),
        }
    }

    pub(super) fn leaves(&self) -> CloudLeaves {
        CloudLeaves {
            means: self.means.leaf(),
            rotations: self.rotations.leaf(),
            log_scales: self.log_scales.leaf(),
            raw_opacities: self.raw_opacities.leaf(),
            sh_constant: self.sh_constant.leaf(),
            sh_rest: self.sh_rest.as_ref().map(AdamGroup::leaf),
        }
    }

    pub(super) fn cloud(&self, sh_degree: usize) -> GaussianCloud {
        let sh = values(&self.leaves().tensors().sh.inner());
        GaussianCloud {
            means: self.means.values().as_chunks().0.to_vec(),
            rotations: self.rotations.values().as_chunks().0.to_vec(),
            log_scales: self.log_scales.values().as_chunks().0.to_vec(),
            raw_opacities: self.raw_opacities.values(),
            sh,
            sh_degree,
        }
    }

    /// A step along the gradients, `of_means` that of the means.
    pub(super) fn descend(
        &mut self,
        leaves: &CloudLeaves,
        of_means: Option<Tensor<2>>,
        gradients: &Gradients,
        config: &TuneGaussiansConfig,
        rate: f64,
    ) {
        self.means.step(rate * config.means_learning_rate, of_means);
        self.rotations.step(rate * config.rotations_learning_rate, leaves.rotations.grad(gradients));
        self.log_scales.step(rate * config.scales_learning_rate, leaves.log_scales.grad(gradients));
        self.raw_opacities.step(rate * config.opacities_learning_rate, leaves.raw_opacities.grad(gradients));
        self.sh_constant.step(rate * config.colors_learning_rate, leaves.sh_constant.grad(gradients));
        if let (Some(group), Some(leaf)) = (&mut self.sh_rest, &leaves.sh_rest) {
            group.step(rate * config.colors_learning_rate / SH_REST_DIVISOR, leaf.grad(gradients));
        }
    }

    pub(super) fn save(&self, file: &mut TensorFile, name: &str) {
        self.means.insert_into(file, &format!("{name}.means"));
        self.rotations.insert_into(file, &format!("{name}.rotations"));
        self.log_scales.insert_into(file, &format!("{name}.log_scales"));
        self.raw_opacities.insert_into(file, &format!("{name}.raw_opacities"));
        self.sh_constant.insert_into(file, &format!("{name}.sh_constant"));
        if let Some(rest) = &self.sh_rest {
            rest.insert_into(file, &format!("{name}.sh_rest"));
        }
    }

    /// Reads what [`Self::save`] wrote for a cloud of the same size and degree as `like`.
    pub(super) fn restore(
        file: &TensorFile,
        name: &str,
        like: &GaussianCloud,
        device: &Device,
    ) -> Result<Self, TensorFileError> {
        let n = Some(like.len());
        let matrix = |field: &str, width: usize| {
            AdamGroup::read_from(file, &format!("{name}.{field}"), [n, Some(width)], device)
        };
        let rest = like.sh_stride() - 3;
        Ok(Self {
            means: matrix("means", 3)?,
            rotations: matrix("rotations", 4)?,
            log_scales: matrix("log_scales", 3)?,
            raw_opacities: AdamGroup::read_from(file, &format!("{name}.raw_opacities"), [n], device)?,
            sh_constant: matrix("sh_constant", 3)?,
            sh_rest: if rest > 0 { Some(matrix("sh_rest", rest)?) } else { None },
        })
    }
}
