//! One iteration of source training, and the state that a checkpoint needs to continue with the same results.

use std::ops::RangeInclusive;

use burn::tensor::{Device, Tensor};
use lgs_core::stream;
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::source::{Canonical, Captured, InputFrame, Moment, SourceModel, SourceMotion};
use lgs_model::{TensorFile, TensorFileError};
use rand::RngExt;

use super::config::SourceConfig;
use super::density::{DensityControl, Replaced};
use super::guide::Guide;
use super::image_levels::ImageLevels;
use super::initial::initial_cloud;
use super::order::{FrameOrder, Round};
use super::priors::MotionPriors;
use crate::adam::AdamGroup;
use crate::checkpoint::{Checkpoints, Stage};
use crate::clock::Clock;
use crate::data_summary::DataSummary;
use crate::driver::{StepReport, Trainer};
use crate::error::TrainError;
use crate::trainable_cloud::{CloudGradients, CloudLeaves, TrainableCloud};
use crate::view::{View, report};

/// The state of training a source model between two iterations.
pub struct SourceTrainer<'a> {
    images: ImageLevels<'a>,
    background: [f32; 3],
    is_transparent: bool,
    seed: u64,
    config: SourceConfig,
    device: Device,
    clock: Clock,
    cloud: TrainableCloud,
    network: AdamGroup<1>,
    motion: Box<dyn SourceMotion>,
    density: DensityControl,
    order: FrameOrder,
    priors: MotionPriors,
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
        let frames = dataset.split("train");
        let data = DataSummary::of(dataset).ok_or_else(|| TrainError::NoFrames(dataset.root.clone()))?;
        let config = config.resolved(&data);
        let guide = Guide::new(dataset, &config.guide);
        let cloud = initial_cloud(dataset, &config, guide.tracks(), seed);
        let frame = if config.deformation.normalised_positions {
            InputFrame::around(&cloud.means)
        } else {
            InputFrame::IDENTITY
        };
        let order = FrameOrder::new(frames, &config, seed);
        let captured = Captured { frame, time_window: order.span().1, seed };
        let motion =
            config.kind.motion(&config.motion(), captured).ok_or(TrainError::NotTrained(config.kind))?;
        let network = motion.init(seed);
        let cloud = TrainableCloud::new(&cloud, device);
        Ok(Self {
            order,
            images: ImageLevels::new(frames),
            background: dataset.background,
            is_transparent: frames.iter().any(Frame::has_alpha),
            seed,
            clock: Clock::new(config.iterations),
            density: DensityControl::new(dataset, &config.densify, &cloud, seed),
            network: AdamGroup::new(network, [motion.parameters()], device),
            cloud,
            motion,
            priors: MotionPriors::new(guide, dataset.extent(), &config, device),
            config,
            device: device.clone(),
        })
    }

    /// The model as it is now.
    #[must_use]
    pub fn model(&self) -> Box<dyn SourceModel> {
        self.motion.model(self.cloud.cloud(), self.network.values())
    }

    /// The colour behind everything at a step: the dataset's or, where images have transparent pixels, for
    /// some of the steps a random one.
    fn background_at(&self, step: usize) -> [f32; 3] {
        if !self.is_transparent || self.config.random_background == 0.0 {
            return self.background;
        }
        let mut random = stream(self.seed, "background", step as u64);
        if random.random_range(0.0..1.0) < self.config.random_background {
            std::array::from_fn(|_| random.random_range(0.0..1.0))
        } else {
            self.background
        }
    }

    /// The time of a frame and the state of the schedule at an iteration.
    fn moment(&self, frame: &Frame, iteration: usize) -> Moment {
        let (first, last) = self.order.span();
        Moment { time: frame.time, iteration, window_end: self.config.window_end(iteration, first, last) }
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
        let canonical =
            Canonical { means: self.cloud.means.value(), rotations: self.cloud.rotations.value() };
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

    /// Takes a step along the gradients that still belong to what they were found for, after what the passed
    /// iterations of the schedule ask of the density.
    fn descend(
        &mut self,
        leaves: &CloudLeaves,
        gradients: &mut burn::tensor::Gradients,
        passed: RangeInclusive<usize>,
    ) {
        let adapted = passed.map(|iteration| self.density.adapt(&mut self.cloud, iteration));
        let replaced = adapted.max().unwrap_or(Replaced::Nothing);
        let iteration = self.clock.iteration();
        let mut by_attribute = leaves.gradients(gradients);
        match replaced {
            Replaced::Nothing => {}
            Replaced::Opacities => by_attribute.raw_opacities = None,
            Replaced::Gaussians => {
                by_attribute = CloudGradients::default();
                self.priors.forget_neighbors();
            }
        }
        self.cloud.step(by_attribute, &self.config.cloud_rates(iteration));
    }
}

impl Trainer for SourceTrainer<'_> {
    fn stage(&self) -> Stage {
        Stage::Source
    }

    fn steps(&self) -> usize {
        self.clock.steps()
    }

    fn step_index(&self) -> usize {
        self.clock.taken()
    }

    fn clock(&mut self) -> Option<&mut Clock> {
        Some(&mut self.clock)
    }

    fn gaussians(&self) -> usize {
        self.cloud.len()
    }

    fn step(&mut self) -> StepReport {
        let passed = self.clock.advance();
        let iteration = self.clock.iteration();
        let level = self.images.level(self.config.level(iteration));
        let frame = &level[self.order.next((iteration, self.clock.taken()), &self.config)];
        let at = self.moment(frame, iteration);
        let is_deformed = !self.config.is_warmup(iteration);
        let (leaves, network) = (self.cloud.leaves(), self.network.leaf());
        let mut cloud = leaves.tensors();
        if is_deformed {
            let poses =
                self.motion.poses(network.clone(), leaves.means.clone(), leaves.rotations.clone(), at);
            cloud = cloud.posed(poses, self.motion.scale_mode());
        }
        let means = cloud.means.clone();
        let device = self.device.clone().autodiff();
        let probe = Tensor::<2>::zeros([cloud.len(), 2], &device).require_grad();
        let view = View {
            frame,
            background: self.background_at(self.clock.taken()),
            ssim_weight: self.config.ssim_weight,
            sh_degree: self.config.active_degree(iteration),
            device: &device,
        };
        let compared = view.compare(&cloud.splats(probe.clone()));
        let loss = compared.loss.clone();
        let total = if is_deformed { self.with_priors(loss, &network, means, at) } else { loss };
        let mut gradients = tracing::trace_span!("backward").in_scope(|| total.backward());
        if let Some(gradient) = probe.grad_remove(&mut gradients) {
            self.density.observe(&gradient, &compared.drawn, &frame.camera, iteration);
        }
        self.descend(&leaves, &mut gradients, passed);
        self.network.step(self.config.deformation_rate(iteration), network.grad_remove(&mut gradients));
        report(&compared.loss, &[compared.mse])
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = Checkpoints::start();
        self.clock.insert_into(&mut file);
        self.cloud.insert_into(&mut file, "canonical");
        self.network.insert_into(&mut file, "network");
        self.density.insert_into(&mut file);
        self.priors.insert_into(&mut file);
        let round = self.order.round();
        for (key, value) in
            [("round", round.number), ("used", round.used as u64), ("began", round.began as u64)]
        {
            file.set_metadata(key, value.to_string());
        }
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        self.cloud = TrainableCloud::read_from(file, "canonical", self.config.sh_degree, &self.device)?;
        self.network = AdamGroup::read_from(file, "network", [Some(self.motion.parameters())], &self.device)?;
        self.density.restore(file, &self.cloud)?;
        self.priors.restore(file, self.cloud.len())?;
        let round = Round {
            number: file.metadata_json("round")?,
            used: file.metadata_json("used")?,
            began: file.metadata_json("began")?,
        };
        self.order.restore(round, &self.config);
        self.clock.restore(file, step)
    }
}
