//! One iteration of source training, and the state that a checkpoint needs to continue with the same results.

mod attempts;
mod descent;

use burn::tensor::{Device, Tensor};
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::source::{Canonical, Learned, Moment, ShadedSource, SourceModel, SourceMotion};
use lgs_model::{TensorFile, TensorFileError};

use attempts::Attempt;

use super::background::Background;
use super::config::SourceConfig;
use super::density::DensityControl;
use super::following::Following;
use super::image_levels::ImageLevels;
use super::order::FrameOrder;
use super::priors::MotionPriors;
use super::proposals::Proposals;
use super::shading::ShadingSchedule;
use super::smoothing::Smoothing;
use crate::adam::AdamGroup;
use crate::cameras::{CameraRefinement, RefinedCameras};
use crate::checkpoint::{Checkpoints, Stage};
use crate::clock::Clock;
use crate::cloud_tensors::CloudTensors;
use crate::data_summary::DataSummary;
use crate::driver::{Glance, Status, Trainer};
use crate::error::TrainError;
use crate::figures::StepReport;
use crate::trainable_cloud::{CloudLeaves, TrainableCloud};
use crate::view::{Sensor, View};

/// The state of training a source model between two iterations.
pub struct SourceTrainer<'a> {
    dataset: &'a Dataset,
    seed: u64,
    attempt: Attempt,
    /// Until it is known whether the motion follows what moves.
    following: Option<Following>,
    images: ImageLevels<'a>,
    background: Background,
    config: SourceConfig,
    /// Settings of the first attempt.
    first_config: SourceConfig,
    device: Device,
    clock: Clock,
    cloud: TrainableCloud,
    network: AdamGroup<1>,
    motion: Box<dyn SourceMotion>,
    density: DensityControl,
    proposals: Proposals<'a>,
    /// The smoothing filter of every Gaussian since their number last changed.
    smoothing: Smoothing,
    shading: Option<ShadingSchedule>,
    order: FrameOrder,
    priors: MotionPriors,
    cameras: CameraRefinement,
}

impl<'a> SourceTrainer<'a> {
    /// A fresh start. The configuration must have been validated. The source of a still scene is of the kind
    /// `linear`, at rest, whatever kind is asked for.
    ///
    /// # Errors
    /// If the dataset has no training frames, or the kind of source model is not trained from images.
    pub fn new(
        dataset: &'a Dataset,
        config: &SourceConfig,
        seed: u64,
        device: &Device,
    ) -> Result<Self, TrainError> {
        let data = DataSummary::of(dataset).ok_or_else(|| TrainError::NoFrames(dataset.root.clone()))?;
        Self::begun(dataset, config.resolved(&data), seed, device)
    }

    /// The model as it is now.
    #[must_use]
    pub fn model(&self) -> Box<dyn SourceModel> {
        let moved = self.motion.model(self.drawn());
        let on_trial = |shading: &&ShadingSchedule| shading.is_on_trial(self.clock.iteration());
        match self.shading.as_ref().filter(|shading| !on_trial(shading)) {
            Some(shading) => Box::new(ShadedSource::new(moved, shading.learned(&self.cloud))),
            None => moved,
        }
    }

    /// The training cameras as they have been refined; nothing where they are not.
    #[must_use]
    pub fn refined_cameras(&self) -> Option<RefinedCameras> {
        self.cameras.refined()
    }

    /// All that has been learned so far, with the Gaussians as they are drawn.
    fn drawn(&self) -> Learned {
        let learned = self.learned();
        Learned { cloud: self.smoothing.applied_on_host(&learned.cloud, &self.device), ..learned }
    }

    /// All that has been learned so far, on the host.
    fn learned(&self) -> Learned {
        let (cloud, features) = (self.cloud.cloud(), self.cloud.features());
        Learned { cloud, features, parameters: self.network.values() }
    }

    /// Lets the motion adapt to the Gaussians, where it is due.
    fn adapt_motion(&mut self, at: Moment) {
        if !self.motion.is_due(at.iteration) {
            return;
        }
        let _span = tracing::trace_span!("adapt motion").entered();
        if let Some(remade) = self.motion.adapt(&self.learned(), at) {
            self.network.remake(&remade.kept, remade.added);
            if let Some(features) = remade.features {
                self.cloud.replace_features(features);
            }
        }
    }

    /// The time of a frame and the state of the schedule at an iteration.
    fn moment(&self, frame: &Frame, iteration: usize) -> Moment {
        let (first, last) = self.order.span();
        Moment { time: frame.time, iteration, window_end: self.config.window_end(iteration, first, last) }
    }

    /// The Gaussians as they are drawn at a moment.
    fn posed(&self, leaves: &CloudLeaves, network: &Tensor<1>, at: Moment) -> CloudTensors {
        let canonical = Canonical {
            means: leaves.means.clone(),
            rotations: leaves.rotations.clone(),
            features: leaves.features.clone(),
        };
        let poses = self.motion.poses(network.clone(), canonical, at);
        self.smoothing.applied(leaves.tensors()).posed(poses, self.motion.scale_mode())
    }

    /// A frame as it is compared at an iteration.
    fn view<'f>(
        &self,
        (frame, sensor): (&'f Frame, &'f Sensor),
        iteration: usize,
        device: &'f Device,
    ) -> View<'f> {
        View {
            frame,
            sensor,
            background: self.background.at(self.clock.taken()),
            ssim_weight: self.config.ssim_weight,
            sh_degree: self.config.active_degree(iteration),
            device,
        }
    }

    /// The photometric loss with the priors of the motion, in whose pose the Gaussians are drawn.
    fn with_priors(
        &mut self,
        photometric: Tensor<1>,
        network: &Tensor<1>,
        means: Tensor<2>,
        at: Moment,
    ) -> Tensor<1> {
        let _span = tracing::trace_span!("priors of motion").entered();
        let canonical = Canonical {
            means: self.cloud.means.value(),
            rotations: self.cloud.rotations.value(),
            features: None,
        };
        let loss = match self.motion.prior(network, &canonical, at) {
            Some(prior) => photometric + prior,
            None => photometric,
        };
        match self.priors.gradient(&canonical.means, &means.clone().inner(), at) {
            // The inner product with a constant has that constant as its gradient.
            Some(gradient) => loss + (means * gradient.autodiff()).sum(),
            None => loss,
        }
    }
}

impl Trainer for SourceTrainer<'_> {
    fn status(&self) -> Status {
        Status::of(Stage::Source, &self.clock, self.cloud.len())
    }

    fn clock(&mut self) -> Option<&mut Clock> {
        Some(&mut self.clock)
    }

    fn glance(&self) -> Glance {
        Glance::Source(self.model().into())
    }

    fn step(&mut self) -> StepReport {
        let passed = self.clock.advance();
        let iteration = self.clock.iteration();
        let level = self.images.level(self.config.level(iteration));
        let frame = &level[self.order.next((iteration, self.clock.taken()), &self.config)];
        let at = self.moment(frame, iteration);
        let is_deformed = !self.config.is_warmup(iteration);
        if is_deformed {
            self.adapt_motion(at);
        }
        let (leaves, network) = (self.cloud.leaves(), self.network.leaf());
        let cloud = if is_deformed {
            self.posed(&leaves, &network, at)
        } else {
            self.smoothing.applied(leaves.tensors())
        };
        let shading = self.shading.as_ref().zip(leaves.shading.as_ref());
        let lit = shading.and_then(|(schedule, leaf)| schedule.at(iteration, frame.time, leaf));
        let cloud = lit.iter().fold(cloud, |cloud, lit| lit.applied(cloud));
        let (means, device) = (cloud.means.clone(), self.device.clone().autodiff());
        let probe = Tensor::<2>::zeros([cloud.len(), 2], &device).require_grad();
        let sensor = self.cameras.sensor(frame, iteration);
        let view = self.view((frame, &sensor), iteration, &device);
        let compared = view.compare(cloud.splats(probe.clone()));
        let loss = compared.loss.clone();
        let total = if is_deformed { self.with_priors(loss, &network, means, at) } else { loss };
        let total = self.density.regularised(total, &leaves);
        let behind = &compared.drawn.transmittance;
        let total = lit.iter().fold(total, |total, lit| lit.regularised(total, behind));
        let mut gradients = tracing::trace_span!("backward").in_scope(|| total.backward());
        if let Some(gradient) = probe.grad_remove(&mut gradients) {
            self.density.observe(&gradient, &compared.drawn, &frame.camera, iteration);
        }
        self.cameras.step(frame, &sensor, iteration, &mut gradients);
        self.descend((&leaves, &network), &mut gradients, passed.clone());
        self.judge_brightness(&passed);
        self.judge_motion(&passed, (frame.time, &compared.mse));
        StepReport::on_device(&compared.loss, &[compared.mse])
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = Checkpoints::start();
        self.clock.insert_into(&mut file);
        self.cloud.insert_into(&mut file, "canonical");
        self.network.insert_into(&mut file, "network");
        self.motion.insert_into(&mut file);
        self.density.insert_into(&mut file);
        self.priors.insert_into(&mut file);
        self.smoothing.insert_into(&mut file);
        self.order.insert_into(&mut file);
        self.cameras.insert_into(&mut file);
        self.insert_attempt_into(&mut file);
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        self.restore_attempt(file)?;
        self.clock.restore(file, step)?;
        let (iteration, mut names) = (self.clock.iteration(), file.names());
        let is_kept = names.any(|name| name.starts_with("canonical.shading"));
        self.shading.take_if(|shading| shading.is_judged_by(iteration) && !is_kept);
        let times = self.shading.as_ref().map_or(0, ShadingSchedule::columns);
        self.cloud = TrainableCloud::read_from(file, "canonical", self.config.sh_degree, &self.device)?
            .with_columns_of((file, "canonical"), self.motion.features(), times)?;
        self.motion.restore(file, self.cloud.len())?;
        self.network = AdamGroup::read_from(file, "network", [Some(self.motion.parameters())], &self.device)?;
        self.density.restore(file, &self.cloud)?;
        self.priors.restore(file, self.cloud.len())?;
        self.smoothing.restore(file, self.cloud.len())?;
        self.order.restore(file, &self.config)?;
        self.cameras.restore(file, &self.device)
    }
}
