//! Adaptive density during training (method §3.4): when it acts, and what it does to the trained cloud.

use burn::tensor::{Tensor, activation::sigmoid};
use lgs_core::{Camera, Stream, stream};
use lgs_data::dataset::{Dataset, SceneBox};
use lgs_model::{TensorFile, TensorFileError};
use lgs_render::tensor::RasterTensors;

use super::config_groups::{DensifyConfig, DensifyMethod};
use super::densify::{Attributes, DensifyPlan, most_opaque, new_shapes};
use super::noise::{Shapes, shifts};
use super::relocation::{Relocation, share};
use super::statistics::DensifyStatistics;
use crate::adam::values;
use crate::cloud_tensors::{host_rows, row_indices, rows};
use crate::thresholds::RESET_OPACITY;
use crate::trainable_cloud::{CloudLeaves, NewGaussians, TrainableCloud};

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
        if self.config.method == DensifyMethod::Classical && iteration < self.config.before {
            self.statistics.observe(gradient, &drawn.radii, camera);
        }
    }

    /// Whether an iteration densifies.
    pub(super) fn is_due(&self, iteration: usize) -> bool {
        let DensifyConfig { after, before, interval, .. } = self.config;
        iteration > after && iteration < before && iteration.is_multiple_of(interval)
    }

    /// Densifies, adds what was proposed and resets opacities where an iteration calls for it.
    pub(super) fn adapt(
        &mut self,
        cloud: &mut TrainableCloud,
        iteration: usize,
        proposed: &NewGaussians,
    ) -> Replaced {
        let config = &self.config;
        if iteration >= config.before {
            return Replaced::Nothing;
        }
        let reset = config.opacity_reset_interval;
        let is_reset = config.method == DensifyMethod::Classical
            && (reset > 0 && iteration.is_multiple_of(reset)
                || (self.has_white_background && iteration == config.white_reset_at));
        let mut replaced = if is_reset { Replaced::Opacities } else { Replaced::Nothing };
        if self.is_due(iteration) {
            let _span = tracing::trace_span!("densify").entered();
            match config.method {
                DensifyMethod::Classical => {
                    let plan = self.plan(cloud, iteration);
                    densify(cloud, &plan, &mut stream(self.seed, "split", iteration as u64));
                }
                DensifyMethod::Mcmc => self.relocate(cloud, iteration),
            }
            self.add(cloud, proposed);
            self.statistics = DensifyStatistics::new(cloud.len(), &cloud.means.device());
            replaced = Replaced::Gaussians;
        }
        if is_reset {
            cloud.cap_opacity(RESET_OPACITY);
        }
        replaced
    }

    /// Appends Gaussians; where there are too many then, the faintest others give way.
    fn add(&self, cloud: &mut TrainableCloud, proposed: &NewGaussians) {
        if proposed.cloud.is_empty() {
            return;
        }
        let (n, limit) = (cloud.len(), self.config.max_gaussians);
        let over = if limit > 0 { (n + proposed.cloud.len()).saturating_sub(limit) } else { 0 };
        let keep = most_opaque(&opacities(cloud), n - over.min(proposed.cloud.len()).min(n - 1));
        cloud.append(&keep, proposed);
    }

    /// Moves dead Gaussians onto live ones and adds new ones; what shares has no moments afterwards.
    fn relocate(&self, cloud: &mut TrainableCloud, iteration: usize) {
        let (opacities, outside) = (opacities(cloud), self.outside(cloud));
        let mut random = stream(self.seed, "relocation", iteration as u64);
        let plan = Relocation::new(&self.config, &opacities, &outside, &mut random);
        let (raw_opacities, log_scales) =
            (cloud.raw_opacities.values(), host_rows(&cloud.log_scales.value()));
        let shared = plan.families.iter().flat_map(|&(parent, size)| {
            let row = share(raw_opacities[parent], log_scales[parent], size, self.config.min_opacity);
            std::iter::repeat_n(row, size)
        });
        let (raw_opacities, log_scales): (Vec<f32>, Vec<[f32; 3]>) = shared.unzip();
        cloud.reselect(&plan.order(), plan.keep.len());
        let device = cloud.means.device();
        cloud.raw_opacities.set_last(rows(raw_opacities.as_chunks::<1>().0, &device));
        cloud.log_scales.set_last(rows(&log_scales, &device));
    }

    /// Lets faint Gaussians wander after a step with a learning rate of positions, if the method asks for it.
    pub(super) fn disturb(&self, cloud: &mut TrainableCloud, iteration: usize, rate: f64) {
        let factor = self.config.mcmc.noise * rate as f32 / self.extent.powi(2);
        if self.config.method != DensifyMethod::Mcmc || !(factor > 0.0 && factor.is_finite()) {
            return;
        }
        let _span = tracing::trace_span!("noise").entered();
        let shapes = Shapes {
            rotations: cloud.rotations.value(),
            log_scales: cloud.log_scales.value(),
            raw_opacities: cloud.raw_opacities.value(),
        };
        cloud.means.shift(shifts(shapes, factor, &mut stream(self.seed, "noise", iteration as u64)));
    }

    /// A loss `[1]` with the weights of opacities and sizes.
    pub(super) fn regularised(&self, mut loss: Tensor<1>, leaves: &CloudLeaves) -> Tensor<1> {
        let DensifyConfig { opacity_weight, scale_weight, .. } = self.config;
        if opacity_weight > 0.0 {
            loss = loss + sigmoid(leaves.raw_opacities.clone()).mean().mul_scalar(opacity_weight);
        }
        if scale_weight > 0.0 {
            let per_length = scale_weight / self.extent.max(f32::MIN_POSITIVE);
            loss = loss + leaves.log_scales.clone().exp().mean().mul_scalar(per_length);
        }
        loss
    }

    fn plan(&self, cloud: &TrainableCloud, iteration: usize) -> DensifyPlan {
        let log_scales: Vec<[f32; 3]> = host_rows(&cloud.log_scales.value());
        let max_scales: Vec<f32> = log_scales.iter().map(|s| s[0].max(s[1]).max(s[2]).exp()).collect();
        let (opacities, outside) = (opacities(cloud), self.outside(cloud));
        let attributes = Attributes {
            gradients: &self.statistics.means(),
            max_scales: &max_scales,
            opacities: &opacities,
            extent: self.extent,
            outside: &outside,
        };
        DensifyPlan::new(&self.config, attributes, iteration)
    }

    /// Which Gaussians lie too far out to be kept.
    fn outside(&self, cloud: &TrainableCloud) -> Vec<bool> {
        let reach = self.config.prune_outside * self.bounds.half_side;
        let is_outside =
            |p: &[f32; 3]| reach > 0.0 && (0..3).any(|i| (p[i] - self.bounds.center[i]).abs() > reach);
        host_rows(&cloud.means.value()).iter().map(is_outside).collect()
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

/// Opacities of a cloud, in (0, 1).
fn opacities(cloud: &TrainableCloud) -> Vec<f32> {
    cloud.raw_opacities.values().iter().map(|o| 1.0 / (1.0 + (-o).exp())).collect()
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
