//! The tensors of one step's graph, and their gradients.

use burn::tensor::{Gradients, Tensor};

use crate::cloud_tensors::CloudTensors;

/// The tracked leaves of one step's graph; also, attribute by attribute, their gradients.
pub(crate) struct CloudLeaves {
    pub(crate) means: Tensor<2>,
    pub(crate) rotations: Tensor<2>,
    pub(crate) log_scales: Tensor<2>,
    pub(crate) raw_opacities: Tensor<2>,
    pub(super) sh_constant: Tensor<2>,
    pub(super) sh_rest: Option<Tensor<2>>,
    pub(crate) features: Option<Tensor<2>>,
    pub(crate) shading: Option<Tensor<2>>,
}

/// Gradients of a cloud's attributes; an attribute without one takes no step.
#[derive(Default)]
pub(crate) struct CloudGradients {
    pub(crate) means: Option<Tensor<2>>,
    pub(super) rotations: Option<Tensor<2>>,
    pub(super) log_scales: Option<Tensor<2>>,
    pub(crate) raw_opacities: Option<Tensor<2>>,
    pub(super) sh_constant: Option<Tensor<2>>,
    pub(super) sh_rest: Option<Tensor<2>>,
    pub(super) features: Option<Tensor<2>>,
    pub(super) shading: Option<Tensor<2>>,
}

impl CloudLeaves {
    pub(crate) fn tensors(&self) -> CloudTensors {
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
            raw_opacities: self.raw_opacities.clone().reshape([n]),
            sh: sh.reshape([n, coefficients, 3]),
        }
    }

    /// Takes the leaves' gradients.
    pub(crate) fn gradients(&self, gradients: &mut Gradients) -> CloudGradients {
        CloudGradients {
            means: self.means.grad_remove(gradients),
            rotations: self.rotations.grad_remove(gradients),
            log_scales: self.log_scales.grad_remove(gradients),
            raw_opacities: self.raw_opacities.grad_remove(gradients),
            sh_constant: self.sh_constant.grad_remove(gradients),
            sh_rest: self.sh_rest.as_ref().and_then(|rest| rest.grad_remove(gradients)),
            features: self.features.as_ref().and_then(|features| features.grad_remove(gradients)),
            shading: self.shading.as_ref().and_then(|shading| shading.grad_remove(gradients)),
        }
    }
}
