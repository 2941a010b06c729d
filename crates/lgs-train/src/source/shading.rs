//! Learning how Gaussians are lit over time ([`lgs_model::Shading`]), once their number is final: what
//! motion and constant colours explain is theirs, and brightness gets what is left.

use burn::tensor::{Device, Gradients, Tensor};
use lgs_model::{Shading, ShadingTimes, TensorFile, TensorFileError};

use super::config_groups::ShadingConfig;
use crate::adam::AdamGroup;
use crate::cloud_tensors::CloudTensors;

/// Name of the group in a checkpoint.
const LOG_GAINS: &str = "shading";

/// The logarithms of the factors of all Gaussians' colours `[n, times]`, while they are learned.
pub(super) struct ShadingTrainer {
    config: ShadingConfig,
    /// The iteration after which they are learned.
    after: usize,
    times: ShadingTimes,
    log_gains: Option<AdamGroup<2>>,
}

/// The logarithms of one step's graph: the two columns around its time, and the weight of the second.
pub(super) struct ShadingLeaf {
    log_gains: Tensor<2>,
    column: usize,
    part: f32,
}

impl ShadingTrainer {
    /// Nothing learned yet; `span` are the first and the last time of the training images.
    pub(super) fn new(config: &ShadingConfig, after: usize, span: [f32; 2]) -> Self {
        let times = ShadingTimes { span, count: config.times.max(2) };
        Self { config: config.clone(), after, times, log_gains: None }
    }

    fn is_due(&self, iteration: usize) -> bool {
        let [first, last] = self.times.span;
        self.config.times > 1 && iteration > self.after && first < last
    }

    /// The tracked logarithms for a step at a time; nothing where they are not learned yet.
    pub(super) fn leaf(
        &mut self,
        gaussians: usize,
        (iteration, time): (usize, f32),
        device: &Device,
    ) -> Option<ShadingLeaf> {
        if !self.is_due(iteration) {
            return None;
        }
        let shape = [gaussians, self.times.count];
        let zeros = || AdamGroup::new(vec![0.0; gaussians * self.times.count], shape, device);
        let (column, part) = self.times.at(time);
        Some(ShadingLeaf { log_gains: self.log_gains.get_or_insert_with(zeros).leaf(), column, part })
    }

    /// Takes a step along the leaf's gradient.
    pub(super) fn step(&mut self, leaf: &ShadingLeaf, gradients: &mut Gradients) {
        if let Some(group) = &mut self.log_gains {
            group.step(self.config.rate, leaf.log_gains.grad_remove(gradients));
        }
    }

    /// What has been learned; nothing before anything was.
    pub(super) fn shading(&self) -> Option<Shading> {
        self.log_gains.as_ref().map(|group| Shading::new(self.times, group.values()))
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        if let Some(group) = &self.log_gains {
            group.insert_into(file, LOG_GAINS);
        }
    }

    /// Reads what [`Self::insert_into`] wrote, for a number of Gaussians.
    ///
    /// # Errors
    /// If something is absent, not finite or of another shape.
    pub(super) fn restore(
        &mut self,
        file: &TensorFile,
        gaussians: usize,
        device: &Device,
    ) -> Result<(), TensorFileError> {
        let shape = [Some(gaussians), Some(self.times.count)];
        let is_there = file.names().any(|name| name == LOG_GAINS);
        let read = || AdamGroup::read_from(file, LOG_GAINS, shape, device);
        self.log_gains = is_there.then(read).transpose()?;
        Ok(())
    }
}

impl ShadingLeaf {
    fn column(&self, index: usize) -> Tensor<2> {
        self.log_gains.clone().narrow(1, index, 1)
    }

    /// Gaussians in the colours that they have at the step's time.
    pub(super) fn applied(&self, cloud: CloudTensors) -> CloudTensors {
        let [before, after] = [self.column, self.column + 1].map(|index| self.column(index));
        let gains = (before.clone() + (after - before).mul_scalar(self.part)).exp();
        let n = cloud.len();
        cloud.lit(gains.reshape([n]))
    }

    /// The loss with the cost of factors that are not one, and of their changes.
    pub(super) fn regularised(&self, loss: Tensor<1>, config: &ShadingConfig) -> Tensor<1> {
        let [before, after] = [self.column, self.column + 1].map(|index| self.column(index));
        let size = (before.clone().square() + after.clone().square()).mean();
        let change = (after - before).square().mean();
        loss + size.mul_scalar(config.weight) + change.mul_scalar(config.change_weight)
    }
}
