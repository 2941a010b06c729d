//! Attempts at a source model: the start of one and, where its motion does not follow what moves, another
//! one with a window that grows more slowly, or with Gaussians that keep still while it grows.

use std::ops::RangeInclusive;

use burn::tensor::{Device, Tensor};
use lgs_core::GaussianCloud;
use lgs_data::dataset::Dataset;
use lgs_model::source::{Captured, InputFrame};
use lgs_model::{TensorFile, TensorFileError};
use serde::{Deserialize, Serialize};

use super::SourceTrainer;
use crate::adam::AdamGroup;
use crate::cameras::CameraRefinement;
use crate::clock::Clock;
use crate::error::TrainError;
use crate::source::background::Background;
use crate::source::density::DensityControl;
use crate::source::flown::{carried, things_in_flight};
use crate::source::following::{Finding, Following};
use crate::source::guide::Guide;
use crate::source::image_levels::ImageLevels;
use crate::source::initial::initial_cloud;
use crate::source::order::FrameOrder;
use crate::source::priors::MotionPriors;
use crate::source::proposals::Proposals;
use crate::source::shading::ShadingSchedule;
use crate::source::smoothing::Smoothing;
use crate::source::{DensifyConfig, LearningRates, SourceConfig};
use crate::thresholds::HASTY_PACE;
use crate::trainable_cloud::TrainableCloud;

/// Name of an attempt in a checkpoint.
const ATTEMPT: &str = "attempt";

/// Which attempt at a source model this is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Attempt {
    /// The first one.
    First,
    /// With a window that grows more slowly.
    Slower,
    /// With Gaussians that keep still while the window grows, so that the network alone explains what is new
    /// in it; the first one had this error at its end.
    Still { error_of_first: f64 },
    /// As the first one, since another was no better.
    FirstAgain,
}

impl Attempt {
    /// Its settings, given those of the first one.
    fn settings(self, first: &SourceConfig) -> SourceConfig {
        let learning_rates = LearningRates { while_growing: 0.0, ..first.learning_rates.clone() };
        // What is removed meanwhile would not be put right.
        let densify = DensifyConfig { prune_extent: 0.0, ..first.densify.clone() };
        match self {
            Self::First => first.clone(),
            Self::Slower => first.growing_slower(),
            Self::Still { .. } => SourceConfig { learning_rates, densify, ..first.clone() },
            Self::FirstAgain => SourceConfig { slower_growth: 0, ..first.clone() },
        }
    }

    /// The one that follows it after some iterations, if another is needed.
    fn next(self, following: &Following, passed: &RangeInclusive<usize>) -> Option<Self> {
        match (self, following.finding(passed)) {
            (Self::First, Finding::TooFast) => Some(Self::Slower),
            (Self::First, Finding::Lost) => Some(Self::Still { error_of_first: following.error() }),
            (Self::Still { error_of_first }, _)
                if following.is_over_in(passed) && following.error() > error_of_first =>
            {
                Some(Self::FirstAgain)
            }
            _ => None,
        }
    }

    /// Why it is begun.
    fn reason(self) -> &'static str {
        match self {
            Self::First => "",
            Self::Slower => {
                "what moves is not followed; training begins anew, with a window that grows more slowly"
            }
            Self::Still { .. } => {
                "what moves is not followed at all times; training begins anew, with Gaussians that keep \
                 still while its window grows"
            }
            Self::FirstAgain => "that is no better; training begins anew as it began at first",
        }
    }
}

/// What a motion has to know of the images, given their last time and the seed.
fn captured(cloud: &GaussianCloud, config: &SourceConfig, (time_window, seed): (f32, u64)) -> Captured {
    let is_normalised = config.deformation.normalised_positions;
    let frame = if is_normalised { InputFrame::around(&cloud.means) } else { InputFrame::IDENTITY };
    Captured { frame, time_window, seed }
}

impl<'a> SourceTrainer<'a> {
    /// The start of a training with resolved settings.
    pub(super) fn begun(
        dataset: &'a Dataset,
        config: SourceConfig,
        seed: u64,
        device: &Device,
    ) -> Result<Self, TrainError> {
        let frames = dataset.split("train");
        let (guide, things) = (Guide::new(dataset, &config.guide), things_in_flight(dataset, &config.guide));
        let cloud = initial_cloud(dataset, &config, (guide.tracks(), &things), seed);
        let order = FrameOrder::new(frames, &config, seed);
        let captured = captured(&cloud, &config, (order.span().1, seed));
        let moved = config.kind.motion(&config.motion(), captured);
        let motion = carried(moved.ok_or(TrainError::NotTrained(config.kind))?, (&things, guide.tracks()));
        let smoothing = Smoothing::asked(frames, config.antialias, &cloud.means);
        let shading = ShadingSchedule::new(&config, order.span().into());
        let times = shading.as_ref().map_or(0, ShadingSchedule::columns);
        let cloud = TrainableCloud::new(&cloud, device).with_columns(motion.features(), times);
        Ok(Self {
            dataset,
            seed,
            attempt: Attempt::First,
            following: Following::new(&config, dataset, order.span()),
            order,
            images: ImageLevels::new(frames),
            background: Background::new(dataset, config.random_background, seed),
            clock: Clock::new(config.iterations),
            density: DensityControl::new(dataset, &config.densify, &cloud, seed),
            network: AdamGroup::new(motion.init(seed), [motion.parameters()], device),
            proposals: Proposals::new(dataset, seed),
            smoothing,
            shading,
            cloud,
            motion,
            priors: MotionPriors::new(guide, dataset.extent(), &config, device),
            cameras: CameraRefinement::new(dataset, &config.cameras, config.iterations, device),
            first_config: config.clone(),
            config,
            device: device.clone(),
        })
    }

    /// Begins anew where the images say, after some iterations of the schedule, that what moves is not
    /// followed; `mse` `[1]` is the error of the image of the last of them, which is of some time.
    pub(super) fn judge_motion(&mut self, passed: &RangeInclusive<usize>, (time, mse): (f32, &Tensor<1>)) {
        let Some(following) = &mut self.following else { return };
        following.observe((self.clock.iteration(), time), mse);
        let Some(next) = self.attempt.next(following, passed) else { return };
        // Under a budget the pace is another than one, and the time is over when training is.
        let (pace, is_over) = (self.clock.pace(), following.is_over_in(passed));
        if pace > HASTY_PACE || is_over && (pace - 1.0).abs() > f64::EPSILON {
            tracing::warn!("what moves is not followed, and the budget leaves no time for another attempt");
            return;
        }
        tracing::info!("{}", next.reason());
        self.begin(next);
    }

    /// The start of another attempt.
    fn begin(&mut self, attempt: Attempt) {
        let first_config = self.first_config.clone();
        let config = attempt.settings(&first_config);
        let clock = self.clock.begun_again(config.iterations);
        // It can be begun: the kind of source model is trained from images, as training has shown.
        if let Ok(trainer) = Self::begun(self.dataset, config, self.seed, &self.device) {
            *self = Self { clock, attempt, first_config, ..trainer };
        }
    }

    pub(super) fn insert_attempt_into(&self, file: &mut TensorFile) {
        let attempt = serde_json::to_string(&self.attempt).expect("an attempt is plain data");
        file.set_metadata(ATTEMPT, attempt);
        if let Some(following) = &self.following {
            following.insert_into(file);
        }
    }

    /// Goes on with the attempt of a checkpoint.
    pub(super) fn restore_attempt(&mut self, file: &TensorFile) -> Result<(), TensorFileError> {
        let attempt = file.metadata_json(ATTEMPT)?;
        if attempt != self.attempt {
            self.begin(attempt);
        }
        self.following.take_if(|following| !following.is_in(file));
        if let Some(following) = &mut self.following {
            following.restore(file, &self.device)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
