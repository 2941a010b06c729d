//! The dynamics of an object of particles (Eq. 4 to 6): from its denoised motion to U, Q and the initial
//! state.
//!
//! For particles that share a motion a linear law is chosen by forecasts and fitted by rollouts; networks
//! learn what it leaves if that is worth it, and stay only if they forecast or describe the motion better.

use crate::config::DistillConfig;
use crate::distilled::DistilledParticles;
use crate::error::DistillError;
use crate::laws::fitted_law::FittedLaw;
use crate::laws::linear::law::Law;
use crate::laws::linear::system::system_of_law;
use crate::laws::selection::{ChosenLaw, choose_law};
use crate::motion::object_motion::ObjectMotion;
use crate::networks::force_ratio::force_ratio;
use crate::networks::training::{Baseline, TrainedNetworks, train_networks};
use crate::networks::velocity_field::VelocityField;
use crate::progress::{DistillProgress, DistillStage};
use crate::report::DistillReport;
use crate::shared_support::SharedSupport;
use lgs_core::geometry::{narrow, wide};
use lgs_dynamics::{PotentialKind, System, SystemConfig};

/// Finds the system behind an object's motion; an error if a fit left the finite numbers.
pub(crate) fn distill_particles(
    motion: ObjectMotion,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<DistilledParticles, DistillError> {
    let of_law = |step| DistillProgress { stage: DistillStage::Law, step, steps: 1, loss: None };
    let object = Object::new(motion, config);
    let law = choose_law(&object.motion, object.support.as_ref(), config);
    progress(of_law(1));
    let mut distilled = match &law {
        Some(chosen) => object.of_law(chosen, seed),
        None => object.without_law(seed),
    };
    if config.neural_remainder && object.is_unexplained(&distilled.report) {
        object.add_networks(&mut distilled, seed, progress);
    }
    if let Some(constrained) = law.and_then(|law| law.constrained).filter(|_| !distilled.report.networks) {
        // An object that has been seen to be rigid need not lose its shape later.
        object.start_as(&mut distilled, &constrained);
    }
    if !distilled.is_finite() {
        return Err(DistillError::Diverged { stage: "distillation" });
    }
    distilled.report.force_ratio = object.force_ratio(&distilled.system);
    Ok(distilled)
}

/// An object's denoised motion with the shared support that it may have.
struct Object<'a> {
    motion: ObjectMotion,
    support: Option<SharedSupport>,
    config: &'a DistillConfig,
}

impl<'a> Object<'a> {
    fn new(motion: ObjectMotion, config: &'a DistillConfig) -> Self {
        let support = SharedSupport::choose(&motion, config);
        Self { motion, support, config }
    }

    /// The system of a chosen law.
    fn of_law(&self, chosen: &ChosenLaw, seed: u64) -> DistilledParticles {
        let ChosenLaw { candidate, fitted, .. } = chosen;
        let mut distilled = DistilledParticles {
            system: system_of_law(self.system_config(), &fitted.law, seed),
            q0: Vec::new(),
            v0: Vec::new(),
            shared_support: None,
            report: DistillReport {
                terms: Some(candidate.terms),
                law: Some(fitted.law),
                forecast_error: Some(chosen.forecast),
                ..self.report()
            },
        };
        self.start_as(&mut distilled, fitted);
        distilled
    }

    /// Takes the initial state of a fit, and its shared support if it has one.
    fn start_as(&self, distilled: &mut DistilledParticles, fitted: &FittedLaw) {
        let Some(motion) = &self.motion.shared else { return };
        (distilled.q0, distilled.v0) = fitted.initial_states(&motion.shared);
        let support = self.support.as_ref().filter(|_| fitted.support.is_some());
        distilled.shared_support = support.map(SharedSupport::indices);
        distilled.report.rigid_constraint = support.is_some();
        distilled.report.window_error = fitted.error;
    }

    /// An untrained system that starts on the paths.
    fn without_law(&self, seed: u64) -> DistilledParticles {
        let config = self.system_config();
        let system = if config.potential == PotentialKind::Mlp {
            System::init(config, seed)
        } else {
            system_of_law(config, &Law::free(wide(self.motion.scales.center)), seed)
        };
        let (q0, v0) = self.start(&system, &VelocityField::NONE);
        DistilledParticles { system, q0, v0, shared_support: None, report: self.report() }
    }

    /// Whether a law leaves enough of the motion for networks to learn.
    fn is_unexplained(&self, report: &DistillReport) -> bool {
        let most = f64::from(self.config.remainder_threshold) * self.motion.displacement;
        report.forecast_error.is_none_or(|error| error > most)
    }

    /// Trains networks on what there is, and keeps them if they are worth it.
    fn add_networks(
        &self,
        distilled: &mut DistilledParticles,
        seed: u64,
        progress: &mut dyn FnMut(DistillProgress),
    ) {
        let support = self.support.as_ref().filter(|_| distilled.report.rigid_constraint);
        let has_force = distilled.report.terms.is_some_and(|terms| terms.has_force());
        let baseline = Baseline {
            system: &distilled.system,
            support,
            force_is_fixed: support.is_some() && !has_force,
            forecast: distilled.report.forecast_error,
            window_error: distilled.report.window_error,
        };
        let trained = train_networks(&self.motion, &baseline, self.config, seed, progress);
        let Some(TrainedNetworks { system, field, forecast, error }) = trained else { return };
        (distilled.q0, distilled.v0) = self.start(&system, &field);
        distilled.report.forecast_error = forecast.or(distilled.report.forecast_error);
        distilled.report.window_error = error;
        distilled.report.networks = true;
        distilled.system = system;
    }

    /// Positions and velocities of all particles at the start of their paths.
    fn start(&self, system: &System, field: &VelocityField) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let all: Vec<usize> = (0..self.motion.paths.len()).collect();
        let state = field.start(system, &self.motion.paths, &all);
        (state.q, state.v)
    }

    fn system_config(&self) -> SystemConfig {
        SystemConfig {
            potential: self.config.potential,
            force: self.config.force,
            hidden: self.config.hidden,
            hidden_layers: self.config.hidden_layers,
            normalisation: self.motion.scales,
        }
    }

    /// The part of the report that precedes any fit.
    fn report(&self) -> DistillReport {
        DistillReport::of_motion(&self.motion)
    }

    /// `‖Q‖/‖∇U‖` over the states of the validation particles; `‖Q‖` without a potential.
    fn force_ratio(&self, system: &System) -> f64 {
        let paths = &self.motion.paths;
        let samples = || 0..paths.samples();
        let states = || self.motion.validation.iter().flat_map(|&j| samples().map(move |s| (j, s)));
        let q: Vec<_> = states().map(|(j, s)| narrow(paths.position(j, s))).collect();
        let v: Vec<_> = states().map(|(j, s)| narrow(paths.velocity(j, s))).collect();
        force_ratio(system, &q, &v)
    }
}
