//! Training of an object's networks, and the decision whether they stay.

use super::descent::Tick;
use super::matching::match_accelerations;
use super::rollouts::{Lesson, Pupil};
use super::velocity_field::VelocityField;
use crate::config::DistillConfig;
use crate::motion::object_motion::ObjectMotion;
use crate::motion::paths::Paths;
use crate::progress::{DistillProgress, DistillStage};
use crate::shared_support::SharedSupport;
use crate::thresholds::{CONSTRAINED_STEPS, MOST_REACH, NETWORK_GAIN, SAMPLE_SIZE};
use glam::DVec3;
use lgs_core::geometry::wide;
use lgs_dynamics::{Supports, System};

/// The system that networks start from.
pub(crate) struct Baseline<'a> {
    /// The law as a system, or an untrained one.
    pub(crate) system: &'a System,
    /// The shared support, where the system's law needs the rigid constraint.
    pub(crate) support: Option<&'a SharedSupport>,
    /// Whether Q is left as it is.
    pub(crate) force_is_fixed: bool,
    /// The law's forecast error; none without a law.
    pub(crate) forecast: Option<f64>,
    /// The law's error inside of the window.
    pub(crate) window_error: f64,
}

/// A system whose networks are worth it.
pub(crate) struct TrainedNetworks {
    /// U and Q.
    pub(crate) system: System,
    /// Correction of the starting velocities.
    pub(crate) field: VelocityField,
    /// Forecast error, where it is the networks'.
    pub(crate) forecast: Option<f64>,
    /// Error inside of the window.
    pub(crate) error: f64,
}

/// Trains networks on the first part of the window and on all of it; they come back if they forecast the rest
/// better than the baseline, or describe the window better.
pub(crate) fn train_networks(
    motion: &ObjectMotion,
    baseline: &Baseline<'_>,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Option<TrainedNetworks> {
    let samples = motion.paths.samples();
    let known = samples - config.held_out_samples(samples);
    let training = Training::new(motion, baseline, config);
    let forecast = baseline.forecast.map(|_| {
        let pupil = training.run(baseline.system, known, seed, progress);
        training.error(&pupil, known..samples)
    });
    let pupil = training.run(baseline.system, samples, seed, progress);
    let error = training.error(&pupil, 0..samples);
    let forecasts_better = match (forecast, baseline.forecast) {
        (Some(own), Some(of_law)) => own <= NETWORK_GAIN * of_law,
        _ => true,
    };
    let describes_better = || error <= NETWORK_GAIN * baseline.window_error && training.stays(&pupil);
    (forecasts_better || describes_better()).then(|| TrainedNetworks {
        system: pupil.system,
        field: pupil.field,
        forecast: forecast.filter(|_| forecasts_better),
        error,
    })
}

/// The particles that networks are trained on: some of the object's, or the members of its shared support.
struct Training<'a> {
    config: &'a DistillConfig,
    paths: Paths,
    validation: Vec<usize>,
    supports: Option<Supports>,
    force_is_fixed: bool,
}

impl<'a> Training<'a> {
    fn new(motion: &ObjectMotion, baseline: &Baseline<'_>, config: &'a DistillConfig) -> Self {
        let particles = match baseline.support {
            Some(support) => support.particles.clone(),
            None => motion.paths.spread(config.matching.particles),
        };
        let paths = motion.paths.part(&particles, motion.paths.samples());
        let (validation, supports) = match baseline.support {
            Some(_) => {
                let all: Vec<u32> = (0..paths.len() as u32).collect();
                ((0..paths.len()).collect(), Some(Supports::shared(&all, paths.len())))
            }
            None => (paths.spread(SAMPLE_SIZE), None),
        };
        Self { config, paths, validation, supports, force_is_fixed: baseline.force_is_fixed }
    }

    fn lesson<'b>(&'b self, paths: &'b Paths) -> Lesson<'b> {
        Lesson { paths, supports: self.supports.as_ref(), force_is_fixed: self.force_is_fixed }
    }

    /// Position error of the validation particles at some samples.
    fn error(&self, pupil: &Pupil, samples: std::ops::Range<usize>) -> f64 {
        self.lesson(&self.paths).error(pupil, &self.validation, samples)
    }

    /// Whether a rollout to three windows stays near where the object was in the first.
    fn stays(&self, pupil: &Pupil) -> bool {
        let samples = self.paths.samples();
        let seen = || {
            let paths = &self.paths;
            self.validation.iter().flat_map(move |&j| (0..samples).map(move |s| paths.position(j, s)))
        };
        let center = seen().sum::<DVec3>() / (self.validation.len() * samples) as f64;
        let limit = MOST_REACH * seen().map(|p| p.distance(center)).fold(0.0, f64::max);
        let states = self.lesson(&self.paths).rollout(pupil, &self.validation, 3 * (samples - 1));
        states.iter().flat_map(|state| &state.q).all(|&q| wide(q).distance(center) <= limit)
    }

    /// Matching (of independent particles) and rollouts on the first `samples` samples; rollouts count only
    /// if they lower the error.
    fn run(
        &self,
        system: &System,
        samples: usize,
        seed: u64,
        progress: &mut dyn FnMut(DistillProgress),
    ) -> Pupil {
        let all: Vec<usize> = (0..self.paths.len()).collect();
        let paths = self.paths.part(&all, samples);
        let mut pupil = Pupil { system: system.clone(), field: VelocityField::NONE };
        let tell = |stage, steps| {
            move |tick: Tick| DistillProgress { stage, step: tick.step + 1, steps, loss: Some(tick.loss) }
        };
        let (matching, mut rollouts) = (&self.config.matching, self.config.rollout.clone());
        if self.supports.is_some() {
            // Internal forces of a rigid object do not show in accelerations: rollouts have to teach
            // everything.
            (rollouts.steps, rollouts.learning_rate) =
                (CONSTRAINED_STEPS * rollouts.steps, matching.learning_rate);
        } else {
            let told = tell(DistillStage::Matching, matching.steps);
            match_accelerations(&mut pupil.system, &paths, matching, seed, &mut |tick| progress(told(tick)));
        }
        let unrefined = pupil.clone();
        let told = tell(DistillStage::Rollout, rollouts.steps);
        self.lesson(&paths).refine(&mut pupil, &rollouts, seed, &mut |tick| progress(told(tick)));
        let is_better = self.error(&pupil, 0..samples) <= self.error(&unrefined, 0..samples);
        if is_better { pupil } else { unrefined }
    }
}
