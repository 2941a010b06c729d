//! Attempts at a source model: the start of one and, where its motion does not follow what moves, another
//! one with a window that grows more slowly.

use std::ops::RangeInclusive;

use burn::tensor::{Device, Tensor};
use lgs_core::GaussianCloud;
use lgs_data::dataset::Dataset;
use lgs_model::source::{Captured, InputFrame};
use lgs_model::{TensorFile, TensorFileError};

use super::SourceTrainer;
use crate::adam::AdamGroup;
use crate::cameras::CameraRefinement;
use crate::clock::Clock;
use crate::error::TrainError;
use crate::source::SourceConfig;
use crate::source::background::Background;
use crate::source::density::DensityControl;
use crate::source::flown::{carried, things_in_flight};
use crate::source::following::Following;
use crate::source::guide::Guide;
use crate::source::image_levels::ImageLevels;
use crate::source::initial::initial_cloud;
use crate::source::order::FrameOrder;
use crate::source::priors::MotionPriors;
use crate::source::proposals::Proposals;
use crate::source::shading::ShadingSchedule;
use crate::source::smoothing::Smoothing;
use crate::thresholds::HASTY_PACE;
use crate::trainable_cloud::TrainableCloud;

/// Name of the number of attempts before this one in a checkpoint.
const ATTEMPTS: &str = "attempts";

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
        let guide = Guide::new(dataset, &config.guide);
        let things = things_in_flight(dataset, &config.guide);
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
            is_another_attempt: false,
            following: Following::new(&config),
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
            config,
            device: device.clone(),
        })
    }

    /// Begins anew where the images say, after some iterations of the schedule, that what moves is not
    /// followed; `mse` `[1]` is the error of the image of the last of them.
    pub(super) fn judge_motion(&mut self, passed: &RangeInclusive<usize>, mse: &Tensor<1>) {
        let Some(following) = &mut self.following else { return };
        following.observe(self.clock.iteration(), mse);
        if !following.is_judged_in(passed) {
            return;
        }
        let is_followed = following.is_followed();
        self.following = None;
        if is_followed {
            return;
        }
        if self.clock.pace() > HASTY_PACE {
            tracing::warn!("what moves is not followed, and the budget leaves no time for another attempt");
            return;
        }
        tracing::info!(
            times_slower = self.config.slower_growth,
            "what moves is not followed; training begins anew, with a window that grows more slowly"
        );
        self.begin_again();
    }

    /// The start of an attempt with a window that grows more slowly.
    fn begin_again(&mut self) {
        let config = self.config.growing_slower();
        let clock = self.clock.begun_again(config.iterations);
        // It can be begun: the kind of source model is trained from images, as training has shown.
        if let Ok(trainer) = Self::begun(self.dataset, config, self.seed, &self.device) {
            *self = Self { clock, is_another_attempt: true, ..trainer };
        }
    }

    pub(super) fn insert_attempt_into(&self, file: &mut TensorFile) {
        file.set_metadata(ATTEMPTS, u8::from(self.is_another_attempt).to_string());
        if let Some(following) = &self.following {
            following.insert_into(file);
        }
    }

    /// Goes on with the attempt of a checkpoint.
    pub(super) fn restore_attempt(&mut self, file: &TensorFile) -> Result<(), TensorFileError> {
        if file.metadata_json::<u8>(ATTEMPTS)? > 0 && !self.is_another_attempt {
            self.begin_again();
        }
        self.following.take_if(|following| !following.is_in(file));
        if let Some(following) = &mut self.following {
            following.restore(file, &self.device)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure, stream};
    use lgs_data::dataset::Frame;
    use rand::RngExt;

    use crate::device::DeviceName;
    use crate::driver::Trainer;
    use crate::source::{DensifyConfig, LearningRates};

    const SIZE: u32 = 32;

    /// What four cameras see at eight times: a grey disc or, after the first of them where `flickers` is set,
    /// noise that no motion explains.
    fn dataset(flickers: bool) -> Dataset {
        let frame = |index: usize| {
            let (moment, camera_id) = (index / 4, index % 4);
            let angle = std::f32::consts::TAU * camera_id as f32 / 4.0;
            let eye = [4.0 * angle.cos(), 4.0 * angle.sin(), 1.0];
            let camera = Camera::look_at(eye, [0.0; 3], 0.6, SIZE, SIZE);
            let mut random = stream(index as u64, "noise of images", 0);
            let pixel = |p: usize| {
                let at = [p as u32 % SIZE, p as u32 / SIZE].map(|x| x as f32 - 0.5 * SIZE as f32);
                let is_inside = at[0].hypot(at[1]) < 0.4 * SIZE as f32;
                let is_noise = flickers && moment > 0;
                match (is_noise, is_inside) {
                    (true, _) => [255 * random.random_range(0..2_u8), 0, 0, 255],
                    (false, true) => [90, 90, 90, 255],
                    (false, false) => [255; 4],
                }
            };
            let rgba: Vec<u8> = (0..camera.pixels()).map(pixel).collect::<Vec<_>>().into_flattened();
            let (name, exposure) = (format!("{index}"), Exposure::IDENTITY);
            Frame { name, camera_id, camera, time: moment as f32 / 8.0, exposure, pixels: rgba.into() }
        };
        let splits = [("train".to_owned(), (0..32).map(frame).collect())].into();
        Dataset { splits, ..Dataset::none([1.0; 3]) }
    }

    /// A short schedule whose colours are soon as good as they can be.
    fn config() -> SourceConfig {
        let quick = SourceConfig::quick();
        let densify = DensifyConfig { after: 120, before: 400, ..quick.densify };
        let learning_rates = LearningRates { sh: 0.1, while_growing: 1.0, ..quick.learning_rates };
        SourceConfig {
            iterations: 800,
            warmup_iterations: 80,
            window_steps: 4,
            window_interval: 5,
            initial_gaussians: 300,
            learning_rates,
            densify,
            ..quick
        }
    }

    fn trainer<'a>(dataset: &'a Dataset, config: &SourceConfig) -> SourceTrainer<'a> {
        SourceTrainer::new(dataset, config, 1, &DeviceName::Cpu.device()).expect("a trainer")
    }

    /// Where the Gaussians are after some steps.
    fn trained(trainer: &mut SourceTrainer, steps: usize) -> Vec<[f32; 3]> {
        while !trainer.is_finished() && trainer.step_index() < steps {
            trainer.step();
        }
        trainer.model().positions_at(0.6)
    }

    #[test]
    fn what_is_not_followed_is_tried_again_with_a_slower_window_once() {
        let (flickering, still, config) = (dataset(true), dataset(false), config());
        let mut other = trainer(&flickering, &config);
        let expected = trained(&mut other, usize::MAX);
        assert!(other.is_another_attempt && other.following.is_none());
        // Judged after 295 iterations; the window takes 60 iterations instead of 15.
        assert_eq!(other.step_index(), 295 + 845);
        assert_eq!((other.config.window_interval, other.config.densify.before), (20, 445));
        let mut once = trainer(&still, &config);
        trained(&mut once, usize::MAX);
        assert!(!once.is_another_attempt && once.step_index() == 800);
        for stopped_at in [100, 295, 400] {
            let mut first = trainer(&flickering, &config);
            trained(&mut first, stopped_at);
            let file = first.checkpoint();
            let mut second = trainer(&flickering, &config);
            second.restore(&file, stopped_at).expect("a checkpoint");
            assert!(trained(&mut second, usize::MAX) == expected, "stopped at {stopped_at}");
        }
    }
}
