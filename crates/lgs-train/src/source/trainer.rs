//! One iteration of source training, and the state that a checkpoint needs to continue with the same results.

use burn::tensor::{Device, Tensor};
use lgs_core::{Camera, GaussianCloud};
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::source::{Canonical, Captured, InputFrame, Moment, SourceModel, SourceMotion};
use lgs_model::{TensorFile, TensorFileError};

use super::config::SourceConfig;
use super::config_groups::Antialias;
use super::density::{DensityControl, Replaced};
use super::guide::Guide;
use super::initial::initial_cloud;
use super::order::{FrameOrder, Round};
use super::priors::MotionPriors;
use super::proposals::{Posed, ProposalRound, Proposals};
use super::smoothing::Smoothing;
use crate::adam::AdamGroup;
use crate::checkpoint::{Checkpoints, Stage};
use crate::cloud_tensors::host_rows;
use crate::driver::{StepReport, Trainer};
use crate::error::TrainError;
use crate::trainable_cloud::{CloudGradients, CloudLeaves, TrainableCloud};
use crate::view::{View, report};

/// The state of training a source model between two iterations.
pub struct SourceTrainer<'a> {
    frames: &'a [Frame],
    background: [f32; 3],
    config: SourceConfig,
    device: Device,
    iteration: usize,
    cloud: TrainableCloud,
    network: AdamGroup<1>,
    motion: Box<dyn SourceMotion>,
    density: DensityControl,
    proposals: Proposals<'a>,
    /// The smoothing filter of every Gaussian since their number last changed, if there is one.
    smoothing: Option<Smoothing>,
    order: FrameOrder,
    priors: MotionPriors,
}

impl<'a> SourceTrainer<'a> {
    /// A fresh start. The configuration must have been validated.
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
        if frames.is_empty() {
            return Err(TrainError::NoFrames(dataset.root.clone()));
        }
        let config = config.stretched(frames[0].camera.width);
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
        let smoothing = smoothing(frames, &config, &cloud.means);
        let cloud = TrainableCloud::new(&cloud, device);
        Ok(Self {
            order,
            frames,
            background: dataset.background,
            iteration: 0,
            density: DensityControl::new(dataset, &config.densify, &cloud, seed),
            network: AdamGroup::new(network, [motion.parameters()], device),
            proposals: Proposals::new(dataset, seed),
            smoothing,
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
        self.motion.model(self.drawn(), self.network.values())
    }

    /// The canonical Gaussians as they are drawn.
    fn drawn(&self) -> GaussianCloud {
        let cloud = self.cloud.cloud();
        match &self.smoothing {
            Some(smoothing) => smoothing.applied_on_host(&cloud, &self.device),
            None => cloud,
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

    /// Gaussians for what the model lacks, where an iteration asks for them.
    fn proposed(&self, iteration: usize) -> GaussianCloud {
        let count = self.config.densify.proposals;
        if count == 0 || !self.density.is_due(iteration) {
            return GaussianCloud::default();
        }
        let last_time = self.order.last_time(iteration, &self.config);
        let round = ProposalRound { iteration, last_time, count, sh_degree: self.config.sh_degree };
        self.proposals.find(round, &Now { trainer: self, is_deformed: !self.config.is_warmup(iteration) })
    }

    /// Takes a step along the gradients that still belong to what they were found for.
    fn descend(&mut self, leaves: &CloudLeaves, gradients: &mut burn::tensor::Gradients, iteration: usize) {
        let proposed = self.proposed(iteration);
        let replaced = self.density.adapt(&mut self.cloud, iteration, &proposed);
        let mut by_attribute = leaves.gradients(gradients);
        match replaced {
            Replaced::Nothing => {}
            Replaced::Opacities => by_attribute.raw_opacities = None,
            Replaced::Gaussians => {
                by_attribute = CloudGradients::default();
                self.priors.forget_neighbors();
                self.smoothing = smoothing(self.frames, &self.config, &host_rows(&self.cloud.means.value()));
            }
        }
        let rates = self.config.cloud_rates(iteration);
        self.cloud.step(by_attribute, &rates);
        self.density.disturb(&mut self.cloud, iteration, rates.means);
    }
}

/// The smoothing filter of Gaussians at some positions, if the configuration asks for it.
fn smoothing(frames: &[Frame], config: &SourceConfig, means: &[[f32; 3]]) -> Option<Smoothing> {
    if config.antialias != Antialias::MipSmoothing {
        return None;
    }
    let mut seen = std::collections::BTreeSet::new();
    let distinct = frames.iter().filter(|frame| seen.insert(frame.camera_id));
    let cameras: Vec<Camera> = distinct.map(|frame| frame.camera).collect();
    Some(Smoothing::new(means, &cameras))
}

/// The model as it is in an iteration.
struct Now<'a> {
    trainer: &'a SourceTrainer<'a>,
    is_deformed: bool,
}

impl Posed for Now<'_> {
    fn at(&self, time: f32) -> GaussianCloud {
        let cloud = self.trainer.drawn();
        if self.is_deformed { self.moving(cloud).cloud_at(time) } else { cloud }
    }

    fn moved(&self, canonical: &GaussianCloud, time: f32) -> Vec<[f32; 3]> {
        if self.is_deformed {
            self.moving(canonical.clone()).positions_at(time)
        } else {
            canonical.means.clone()
        }
    }
}

impl Now<'_> {
    fn moving(&self, cloud: GaussianCloud) -> Box<dyn SourceModel> {
        self.trainer.motion.model(cloud, self.trainer.network.values())
    }
}

impl Trainer for SourceTrainer<'_> {
    fn stage(&self) -> Stage {
        Stage::Source
    }

    fn steps(&self) -> usize {
        self.config.iterations
    }

    fn step_index(&self) -> usize {
        self.iteration
    }

    fn gaussians(&self) -> usize {
        self.cloud.len()
    }

    fn step(&mut self) -> StepReport {
        let iteration = self.iteration + 1;
        let frame = &self.frames[self.order.next(iteration, &self.config)];
        let at = self.moment(frame, iteration);
        let is_deformed = !self.config.is_warmup(iteration);
        let (leaves, network) = (self.cloud.leaves(), self.network.leaf());
        let mut cloud = leaves.tensors();
        if let Some(smoothing) = &self.smoothing {
            cloud = smoothing.applied(cloud);
        }
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
            background: self.background,
            ssim_weight: self.config.ssim_weight,
            sh_degree: self.config.active_degree(iteration),
            device: &device,
        };
        let compared = view.compare(&cloud.splats(probe.clone()));
        let loss = compared.loss.clone();
        let total = if is_deformed { self.with_priors(loss, &network, means, at) } else { loss };
        let total = self.density.regularised(total, &leaves);
        let mut gradients = tracing::trace_span!("backward").in_scope(|| total.backward());
        if let Some(gradient) = probe.grad_remove(&mut gradients) {
            self.density.observe(&gradient, &compared.drawn, &frame.camera, iteration);
        }
        self.descend(&leaves, &mut gradients, iteration);
        self.network.step(self.config.deformation_rate(iteration), network.grad_remove(&mut gradients));
        self.iteration = iteration;
        report(&compared.loss, &[compared.mse])
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = Checkpoints::start();
        self.cloud.insert_into(&mut file, "canonical");
        self.network.insert_into(&mut file, "network");
        self.density.insert_into(&mut file);
        self.priors.insert_into(&mut file);
        if let Some(smoothing) = &self.smoothing {
            smoothing.insert_into(&mut file);
        }
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
        if self.smoothing.is_some() {
            self.smoothing = Some(Smoothing::read_from(file, self.cloud.len())?);
        }
        let round = Round {
            number: file.metadata_json("round")?,
            used: file.metadata_json("used")?,
            began: file.metadata_json("began")?,
        };
        self.order.restore(round, &self.config);
        self.iteration = step;
        Ok(())
    }
}
