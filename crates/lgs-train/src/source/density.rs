//! Adaptive density during training (method §3.4): when it acts, and what it does to the trained cloud.

use burn::tensor::Tensor;
use lgs_core::{Camera, Stream, stream};
use lgs_data::dataset::{Dataset, SceneBox};
use lgs_model::{TensorFile, TensorFileError};
use lgs_render::tensor::RasterTensors;

use super::config_groups::DensifyConfig;
use super::densify::{Attributes, DensifyPlan, new_shapes};
use super::statistics::DensifyStatistics;
use crate::adam::values;
use crate::cloud_tensors::{host_rows, row_indices, rows};
use crate::thresholds::RESET_OPACITY;
use crate::trainable_cloud::TrainableCloud;

/// Parameters that an iteration has replaced, so that their gradients have lost their meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Replaced {
    /// All parameters are as they were.
    Nothing,
    /// Opacities were reset.
    Opacities,
    /// Densification has changed the number of Gaussians.
    Gaussians,
}

/// The statistics since the last densification, and the scene's limits.
pub(super) struct DensityControl {
    config: DensifyConfig,
    statistics: DensifyStatistics,
    extent: f32,
    bounds: SceneBox,
    has_white_background: bool,
    seed: u64,
}

impl DensityControl {
    /// Control of the density of a fresh cloud.
    pub(super) fn new(dataset: &Dataset, config: &DensifyConfig, cloud: &TrainableCloud, seed: u64) -> Self {
        Self {
            config: config.clone(),
            statistics: DensifyStatistics::new(cloud.len(), &cloud.means.device()),
            extent: dataset.extent(),
            bounds: dataset.scene_box(),
            has_white_background: dataset.background == [1.0; 3],
            seed,
        }
    }

    /// Adds an iteration's gradient `[n, 2]` by the projected centres to the statistics.
    pub(super) fn observe(
        &mut self,
        gradient: &Tensor<2>,
        drawn: &RasterTensors,
        camera: &Camera,
        iteration: usize,
    ) {
        if iteration < self.config.before {
            self.statistics.observe(gradient, &drawn.radii, camera);
        }
    }

    /// Densifies and resets opacities where an iteration calls for it.
    pub(super) fn adapt(&mut self, cloud: &mut TrainableCloud, iteration: usize) -> Replaced {
        let config = &self.config;
        if iteration >= config.before {
            return Replaced::Nothing;
        }
        let is_due = |interval: usize| interval > 0 && iteration.is_multiple_of(interval);
        let is_reset = is_due(config.opacity_reset_interval)
            || (self.has_white_background && iteration == config.white_reset_at);
        let mut replaced = if is_reset { Replaced::Opacities } else { Replaced::Nothing };
        if iteration > config.after && is_due(config.interval) {
            let _span = tracing::trace_span!("densify").entered();
            let plan = self.plan(cloud, iteration);
            densify(cloud, &plan, &mut stream(self.seed, "split", iteration as u64));
            self.statistics = DensifyStatistics::new(cloud.len(), &cloud.means.device());
            replaced = Replaced::Gaussians;
        }
        if is_reset {
            cloud.cap_opacity(RESET_OPACITY);
        }
        replaced
    }

    fn plan(&self, cloud: &TrainableCloud, iteration: usize) -> DensifyPlan {
        let log_scales: Vec<[f32; 3]> = host_rows(&cloud.log_scales.value());
        let max_scales: Vec<f32> = log_scales.iter().map(|s| s[0].max(s[1]).max(s[2]).exp()).collect();
        let opacities: Vec<f32> =
            cloud.raw_opacities.values().iter().map(|o| 1.0 / (1.0 + (-o).exp())).collect();
        let reach = self.config.prune_outside * self.bounds.half_side;
        let is_outside =
            |p: &[f32; 3]| reach > 0.0 && (0..3).any(|i| (p[i] - self.bounds.center[i]).abs() > reach);
        let outside: Vec<bool> = host_rows(&cloud.means.value()).iter().map(is_outside).collect();
        let attributes = Attributes {
            gradients: &self.statistics.means(),
            max_scales: &max_scales,
            opacities: &opacities,
            extent: self.extent,
            outside: &outside,
        };
        DensifyPlan::new(&self.config, attributes, iteration)
    }

    /// Adds the statistics to a checkpoint.
    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        self.statistics.insert_into(file);
    }

    /// Reads the statistics of the Gaussians of a cloud from a checkpoint.
    pub(super) fn restore(
        &mut self,
        file: &TensorFile,
        cloud: &TrainableCloud,
    ) -> Result<(), TensorFileError> {
        self.statistics = DensifyStatistics::read_from(file, cloud.len(), &cloud.means.device())?;
        Ok(())
    }
}

/// Carries a plan out on a cloud and its moments: kept Gaussians first, then clones and children.
fn densify(cloud: &mut TrainableCloud, plan: &DensifyPlan, random: &mut Stream) {
    let device = cloud.means.device();
    let parents = row_indices(plan.clone.iter().chain(&plan.split).copied(), &device);
    let [means, rotations, log_scales] =
        [&cloud.means, &cloud.rotations, &cloud.log_scales].map(|group| group.value());
    let of_parents = |tensor: Tensor<2>| values(&tensor.select(0, parents.clone()));
    let (means, log_scales) = if parents.dims()[0] == 0 {
        (Vec::new(), Vec::new())
    } else {
        new_shapes(
            plan,
            of_parents(means).as_chunks().0,
            of_parents(rotations).as_chunks().0,
            of_parents(log_scales).as_chunks().0,
            random,
        )
    };
    let order: Vec<usize> = plan.keep.iter().copied().chain(plan.parents()).collect();
    cloud.reselect(&order, plan.keep.len());
    cloud.means.set_last(rows(&means, &device));
    cloud.log_scales.set_last(rows(&log_scales, &device));
}
