//! The time that training is going to take, from a few timed steps.
//!
//! Steps of the source are timed with few and with all Gaussians of its budget, on small and on full images,
//! and with and without motion; between these the time of a step is taken to be linear in pixels and
//! Gaussians. Stages 2 and 3 draw the same Gaussians on the same images.

use std::time::Instant;

use burn::tensor::Device;
use lgs_data::dataset::Dataset;

use crate::checkpoint::Stage;
use crate::config::TrainConfig;
use crate::data_summary::DataSummary;
use crate::device::has_kernels;
use crate::driver::Trainer;
use crate::error::TrainError;
use crate::source::{SourceConfig, SourceTrainer};
use crate::thresholds::{
    GROWTH_END, PROBE_FRAMES, PROBE_STEPS, STEPS_OF_DISTILLATION, STEPS_PER_FITTED_FRAME,
};
use crate::window::learns_no_motion;

/// The time that training is expected to take.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Seconds from the start of the source to every hundredth of its schedule, 0 first.
    pub source: Vec<f64>,
    /// Seconds of every later stage.
    pub stages: Vec<(Stage, f64)>,
    /// Seconds of all training if the scene needs no more Gaussians than it starts with.
    pub least_secs: f64,
}

impl Estimate {
    /// Seconds of all training if the scene takes all Gaussians of its budget.
    #[must_use]
    pub fn secs(&self) -> f64 {
        self.source.last().unwrap_or(&0.0) + self.stages.iter().map(|(_, secs)| secs).sum::<f64>()
    }

    /// Seconds that are expected to have passed within a stage when a part of it, in [0, 1], is done.
    #[must_use]
    pub fn within(&self, stage: Stage, part: f64) -> f64 {
        if stage == Stage::Source {
            let hundredth = (part.clamp(0.0, 1.0) * (self.source.len() - 1) as f64) as usize;
            return self.source[hundredth];
        }
        part * self.stages.iter().find(|(own, _)| *own == stage).map_or(0.0, |(_, secs)| *secs)
    }

    /// Seconds of the stages after one.
    #[must_use]
    pub fn after(&self, stage: Stage) -> f64 {
        self.stages.iter().filter(|(own, _)| *own > stage).map(|(_, secs)| secs).sum()
    }
}

/// Times a few steps on the machine as it is now. Nothing for a source that is imported.
///
/// # Errors
/// If the source cannot be trained at all.
pub fn estimate(
    dataset: &Dataset,
    config: &TrainConfig,
    device: &Device,
) -> Result<Option<Estimate>, TrainError> {
    let Some(data) = DataSummary::of(dataset).filter(|_| config.source.import.is_empty()) else {
        return Ok(None);
    };
    let source = config.source.resolved(&data);
    let probe = Probe { dataset: &few_frames(dataset), source: &source, device };
    let most = most_gaussians(&source, &data);
    let first = first_gaussians(&source, &data).min(most);
    let costs = StepCosts {
        small: probe.secs(first, source.coarse_levels, Motion::Moving)?,
        full: probe.secs(first, 0, Motion::Moving)?,
        all: probe.secs(most, 0, Motion::Moving)?,
        still: probe.secs(most, 0, Motion::Still)?,
    };
    let of = |costs: &StepCosts| {
        let later = if learns_no_motion(dataset, config) { Vec::new() } else { stages(config, &data, costs) };
        Estimate { source: costs.curve(&source), stages: later, least_secs: 0.0 }
    };
    Ok(Some(Estimate { least_secs: of(&costs.without_growth()).secs(), ..of(&costs) }))
}

/// Seconds of a step.
struct StepCosts {
    /// With the first Gaussians on the smallest images.
    small: f64,
    /// With the first Gaussians on full images.
    full: f64,
    /// With all Gaussians of the budget on full images.
    all: f64,
    /// The same without motion.
    still: f64,
}

impl StepCosts {
    /// Those of a scene that stays with its first Gaussians.
    fn without_growth(&self) -> Self {
        Self { all: self.full, still: self.still * self.full / self.all, ..*self }
    }

    /// Seconds of a step at an iteration of the source.
    fn at(&self, iteration: usize, source: &SourceConfig) -> f64 {
        // Pixels fall to a quarter with every level.
        let pixels = |level: usize| 0.25_f64.powi(level as i32);
        let coarsest = pixels(source.coarse_levels);
        let size = (pixels(source.level(iteration)) - coarsest) / (1.0 - coarsest).max(1e-9);
        let grown = (iteration as f64 / (GROWTH_END * source.densify.before as f64).max(1.0)).min(1.0);
        let of_few = self.small + size.clamp(0.0, 1.0) * (self.full - self.small);
        of_few * (1.0 + grown * (self.all / self.full - 1.0))
    }

    /// Seconds from the start of the source to every hundredth of its schedule.
    fn curve(&self, source: &SourceConfig) -> Vec<f64> {
        let iterations = source.iterations as f64 / 100.0;
        let secs = |hundredth: i32| {
            iterations * self.at((iterations * (f64::from(hundredth) + 0.5)) as usize + 1, source)
        };
        let mut sum = 0.0;
        let sums = (0..100).map(|hundredth| {
            sum += secs(hundredth);
            sum
        });
        std::iter::once(0.0).chain(sums).collect()
    }
}

/// Seconds of the stages.
fn stages(config: &TrainConfig, data: &DataSummary, costs: &StepCosts) -> Vec<(Stage, f64)> {
    let step = costs.still;
    let gaussians = |c: &crate::stages::TuneGaussiansConfig| {
        step * c.resolved(data.size[0], data.viewing_distance).iterations as f64
    };
    let fit = &config.fit_dynamics;
    let frames = if fit.frames == 0 { data.images } else { fit.frames.min(data.images) };
    let all = [
        (Stage::Distill, costs.all * STEPS_OF_DISTILLATION),
        (Stage::RefineGaussians, gaussians(&config.refine_gaussians)),
        (Stage::FitDynamics, step * STEPS_PER_FITTED_FRAME * (fit.steps * frames) as f64),
        (Stage::TuneGaussians, gaussians(&config.tune_gaussians)),
    ];
    all.into_iter().filter(|(stage, _)| config.last_stage.includes(*stage)).collect()
}

/// The number of Gaussians that training starts with, before they are thinned to the budget.
fn first_gaussians(source: &SourceConfig, data: &DataSummary) -> usize {
    if data.points > 0 { data.points } else { source.initial_gaussians }
}

/// The largest number of Gaussians that training may end with.
fn most_gaussians(source: &SourceConfig, data: &DataSummary) -> usize {
    match source.densify.max_gaussians {
        0 => first_gaussians(source, data),
        most => most,
    }
}

/// A dataset with a few of the training images, without points.
fn few_frames(dataset: &Dataset) -> Dataset {
    let frames = dataset.split("train");
    let n = frames.len().min(PROBE_FRAMES);
    let few = (0..n).map(|i| frames[i * frames.len() / n].clone()).collect();
    let mut small = Dataset::none(dataset.background);
    small.splits.insert("train".to_owned(), few);
    small
}

/// Whether the Gaussians of timed steps are moved by the source's motion.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Motion {
    Still,
    Moving,
}

/// Steps to be timed.
struct Probe<'a> {
    dataset: &'a Dataset,
    source: &'a SourceConfig,
    device: &'a Device,
}

impl Probe<'_> {
    /// Seconds of a step with so many Gaussians, on images halved so many times.
    fn secs(&self, gaussians: usize, level: usize, motion: Motion) -> Result<f64, TrainError> {
        // So long that no step of it is on a finer level, and nothing else of the schedule is due.
        let iterations = 1_000_000;
        let mut config = SourceConfig {
            iterations,
            coarse_levels: level,
            coarse_share: 1.0,
            warmup_iterations: if motion == Motion::Moving { 0 } else { iterations },
            window_steps: 1,
            initial_gaussians: gaussians,
            sh_interval: 1,
            ..self.source.clone()
        };
        (config.densify.before, config.guide.weight) = (0, 0.0);
        (config.densify.max_gaussians, config.densify.per_pixel) = (0, 0.0);
        let mut trainer = SourceTrainer::new(self.dataset, &config, 0, self.device)?;
        // A device compiles kernels for every degree of harmonics, each of which comes with a step.
        let untimed = if has_kernels(self.device) { 2 + config.sh_degree } else { 1 };
        // The figures of a step say that it is done on the device, too.
        for _ in 0..untimed {
            trainer.step().figures();
        }
        let begun = Instant::now();
        for step in 1..=PROBE_STEPS {
            let report = trainer.step();
            if step == PROBE_STEPS {
                report.figures();
            }
        }
        Ok(begun.elapsed().as_secs_f64() / PROBE_STEPS as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_shrinks_with_what_is_done() {
        let source: Vec<f64> = (0..=100).map(|i| 0.02 * f64::from(i * i)).collect();
        let stages = vec![(Stage::RefineGaussians, 30.0), (Stage::TuneGaussians, 60.0)];
        let estimate = Estimate { source, stages, least_secs: 100.0 };
        assert_eq!(estimate.secs(), 290.0);
        assert_eq!(estimate.within(Stage::Source, 0.5), 50.0);
        assert_eq!(estimate.within(Stage::TuneGaussians, 0.5), 30.0);
        assert_eq!(
            [Stage::Source, Stage::Distill, Stage::FitDynamics].map(|s| estimate.after(s)),
            [90.0, 90.0, 60.0]
        );
    }
}
