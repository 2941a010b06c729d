//! A motion whose Gaussians are carried, as training learns it.

use burn::tensor::Tensor;
use lgs_core::GaussianCloud;

use super::model::CarriedSource;
use super::path::{CarryingPath, owners};
use crate::source::config::{DELTAS, ScaleMode};
use crate::source::model::SourceModel;
use crate::source::motion::{Canonical, Learned, Moment, Remade, SourceMotion};
use crate::tensor_file::{TensorFile, TensorFileError};

/// A motion of any kind, with paths that carry some of its Gaussians.
pub struct CarriedMotion {
    moved: Box<dyn SourceMotion>,
    paths: Vec<CarryingPath>,
}

impl CarriedMotion {
    /// A motion with paths.
    #[must_use]
    pub fn new(moved: Box<dyn SourceMotion>, paths: Vec<CarryingPath>) -> Self {
        Self { moved, paths }
    }

    /// What moves Gaussians beside the paths.
    #[cfg(test)]
    pub(super) fn moved(&self) -> &dyn SourceMotion {
        &*self.moved
    }

    /// Pose rows `[n, DELTAS]` carried to a time, given the canonical centres `[n, 3]`.
    fn carried(&self, poses: &Tensor<2>, centers: &Tensor<2>, time: f32) -> Tensor<2> {
        let (means, device) = (centers.clone().detach(), centers.device());
        let rows = Tensor::cat(vec![poses.clone(), centers.clone()], 1);
        let row = |values: &[f32]| Tensor::<1>::from_floats(values, &device).reshape([1, values.len()]);
        let away = |path: &CarryingPath| {
            let offset = means.clone() - row(&path.start());
            offset.square().sum_dim(1).sqrt().div_scalar(path.reach)
        };
        let (nearest, owner) = Tensor::cat(self.paths.iter().map(away).collect(), 1).min_dim_with_indices(1);
        let is_carried = nearest.lower_elem(1.0);
        let mut carried = poses.clone();
        for (number, path) in (0..).zip(&self.paths) {
            let own = owner.clone().equal_elem(number).bool_and(is_carried.clone()).float();
            let (matrix, added) = path.carried(time).of_rows();
            let matrix = row(matrix.as_flattened()).reshape([DELTAS + 3, DELTAS]);
            carried = carried + own * (rows.clone().matmul(matrix) + row(&added) - poses.clone());
        }
        carried
    }
}

impl SourceMotion for CarriedMotion {
    fn init(&self, seed: u64) -> Vec<f32> {
        self.moved.init(seed)
    }

    fn parameters(&self) -> usize {
        self.moved.parameters()
    }

    fn features(&self) -> usize {
        self.moved.features()
    }

    fn fresh_features(&self, cloud: &GaussianCloud) -> Vec<f32> {
        self.moved.fresh_features(cloud)
    }

    fn poses(&self, network: Tensor<1>, canonical: Canonical, at: Moment) -> Tensor<2> {
        let centers = canonical.means.clone();
        self.carried(&self.moved.poses(network, canonical, at), &centers, at.time)
    }

    fn prior(&self, network: &Tensor<1>, canonical: &Canonical, at: Moment) -> Option<Tensor<1>> {
        self.moved.prior(network, canonical, at)
    }

    fn is_due(&self, iteration: usize) -> bool {
        self.moved.is_due(iteration)
    }

    fn adapt(&mut self, learned: &Learned, at: Moment) -> Option<Remade> {
        self.moved.adapt(learned, at)
    }

    fn forget_gaussians(&mut self) {
        self.moved.forget_gaussians();
    }

    fn observe(&mut self, gradients: &Tensor<2>) {
        self.moved.observe(gradients);
    }

    fn observes(&self) -> bool {
        self.moved.observes()
    }

    fn insert_into(&self, file: &mut TensorFile) {
        self.moved.insert_into(file);
    }

    fn restore(&mut self, file: &TensorFile, gaussians: usize) -> Result<(), TensorFileError> {
        self.moved.restore(file, gaussians)
    }

    fn scale_mode(&self) -> ScaleMode {
        self.moved.scale_mode()
    }

    fn model(&self, learned: Learned) -> Box<dyn SourceModel> {
        let canonical = learned.cloud.means.clone();
        let owners = owners(&self.paths, &canonical);
        Box::new(CarriedSource::new(self.moved.model(learned), self.paths.clone(), (owners, canonical)))
    }
}
