//! An object's denoised motion, and the systems that describe it: of a law, of networks, of a body held
//! rigid.

use crate::Trajectories;
use crate::anchors::choose_anchors;
use crate::config::{DistillConfig, SharedMotionKind};
use crate::dense::{V3, norm2, wide};
use crate::distill::{DistillProgress, Distilled};
use crate::fitted_law::FittedLaw;
use crate::law::Law;
use crate::law_select::{ChosenLaw, choose_law};
use crate::law_system::{normalisation, system_of_law};
use crate::network_fit::{VelocityField, start_of};
use crate::network_training::Training;
use crate::pose::PoseKind;
use crate::report::{DistillReport, PathKind};
use crate::shared_motion::SharedMotion;
use crate::targets::Paths;
use lgs_dynamics::{ForceKind, Normalisation, PotentialKind, System, SystemConfig};

/// Particles that errors and scales are measured on.
pub(crate) const JUDGES: usize = 200;
/// Networks have to forecast better than the law alone by this factor.
const WORTH_IT: f64 = 0.5;
/// Or they have to describe the window better by this factor, and stay near for three windows
/// ([`Training::stays`]): a motion whose turning point lies in the held-out part cannot be forecast, and is
/// still described.
const DESCRIBES: f64 = 0.5;
/// An affine motion is preferred to a rigid one only if the rigid residual is this many times larger …
const RIGID_SLACK: f64 = 1.5;
/// … and exceeds it by this part of the displacement.
const RIGID_TOLERANCE: f64 = 0.02;

/// An object's denoised motion.
pub(crate) struct Seen {
    motion: Option<SharedMotion>,
    paths: Paths,
    degree: usize,
    anchors: Vec<usize>,
    judges: Vec<usize>,
    normalisation: Normalisation,
    noise: f64,
    pub(crate) displacement: f64,
}

impl Seen {
    pub(crate) fn new(trajectories: &Trajectories, weights: Option<&[f32]>, config: &DistillConfig) -> Self {
        let noise = trajectories.independent_noise();
        let displacement = trajectories.rms_displacement();
        let motion = shared_motion(trajectories, weights, config, noise, displacement);
        let (paths, degree, anchors) = match &motion {
            Some(motion) => {
                let (smooth, degree) = motion.smooth(config.degrees());
                let anchors = choose_anchors(motion, &smooth, config.anchors);
                (Paths::shared(motion, &smooth, f64::from(trajectories.dt())), degree, anchors)
            }
            None => {
                let (paths, degree) = Paths::independent(trajectories, config.degrees(), JUDGES);
                (paths, degree, Vec::new())
            }
        };
        let judges = paths.spread(JUDGES);
        let duration = f64::from(trajectories.dt()) * trajectories.times.len() as f64;
        let normalisation = scales(&paths, &judges, duration);
        Self { motion, paths, degree, anchors, judges, normalisation, noise, displacement }
    }

    fn system_config(&self, config: &DistillConfig) -> SystemConfig {
        SystemConfig {
            potential: config.potential,
            force: config.force,
            hidden: config.hidden,
            hidden_layers: config.hidden_layers,
            normalisation: self.normalisation,
        }
    }

    /// The linear law, where the configuration's U can hold one and the particles share a motion.
    pub(crate) fn choose_law(&self, config: &DistillConfig) -> Option<ChosenLaw> {
        let motion = self.motion.as_ref().filter(|_| config.potential == PotentialKind::QuadraticMlp)?;
        let center = wide(self.normalisation.center);
        choose_law(motion, center, &self.anchors, config.force == ForceKind::Structured, config)
    }

    /// The law as a system.
    pub(crate) fn of_law(&self, chosen: &ChosenLaw, config: &DistillConfig, seed: u64) -> Distilled {
        let rigid_constraint = chosen.candidate.rigid_constraint;
        let (q0, v0) = match &self.motion {
            Some(motion) => chosen.fitted.initial_states(motion, f64::from(self.paths.dt())),
            None => (Vec::new(), Vec::new()),
        };
        let report = DistillReport {
            terms: Some(chosen.candidate.terms),
            law: Some(chosen.fitted.law),
            rigid_constraint,
            forecast_error: Some(chosen.forecast),
            window_error: chosen.fitted.error,
            ..self.report()
        };
        let anchors = rigid_constraint.then(|| self.anchors.iter().map(|&i| i as u32).collect());
        Distilled {
            system: system_of_law(self.system_config(config), &chosen.fitted.law, seed),
            q0,
            v0,
            anchors,
            report,
        }
    }

    /// Starts the object as a body that one support holds rigid: what has been seen to be rigid need not lose
    /// its shape later.
    pub(crate) fn hold(&self, distilled: &mut Distilled, held: &FittedLaw) {
        let Some(motion) = &self.motion else { return };
        (distilled.q0, distilled.v0) = held.initial_states(motion, f64::from(self.paths.dt()));
        distilled.anchors = Some(self.anchors.iter().map(|&i| i as u32).collect());
        distilled.report.rigid_constraint = true;
        distilled.report.window_error = held.error;
    }

    /// An untrained system that starts on the paths.
    pub(crate) fn plain(&self, config: &DistillConfig, seed: u64) -> Distilled {
        let config = self.system_config(config);
        let law = Law::free(wide(self.normalisation.center));
        let system = if config.potential == PotentialKind::Mlp {
            System::init(config, seed)
        } else {
            system_of_law(config, &law, seed)
        };
        let (q0, v0) = self.start(&system, &VelocityField::NONE);
        Distilled { system, q0, v0, anchors: None, report: self.report() }
    }

    fn start(&self, system: &System, field: &VelocityField) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let all: Vec<usize> = (0..self.paths.len()).collect();
        let state = start_of(system, field, &self.paths, &all);
        (state.q, state.v)
    }

    /// Trains networks on the first part of the window; if they forecast the rest better than what is there,
    /// trains them on all of it.
    pub(crate) fn train_networks(
        &self,
        distilled: &mut Distilled,
        config: &DistillConfig,
        seed: u64,
        progress: &mut dyn FnMut(DistillProgress),
    ) {
        let samples = self.paths.samples();
        let known = samples - ((samples as f32 * config.held_out) as usize).clamp(1, samples / 2);
        let training = Training::new(&self.paths, &self.anchors, distilled, config);
        let mut better = true;
        if let Some(forecast) = distilled.report.forecast_error {
            let (system, field) = training.run(&distilled.system, known, seed, progress);
            let error = training.error(&system, &field, known..samples);
            better = error <= WORTH_IT * forecast;
            if better {
                distilled.report.forecast_error = Some(error);
            }
        }
        let (system, field) = training.run(&distilled.system, samples, seed, progress);
        let error = training.error(&system, &field, 0..samples);
        if !better && (error > DESCRIBES * distilled.report.window_error || !training.stays(&system, &field))
        {
            return;
        }
        (distilled.q0, distilled.v0) = self.start(&system, &field);
        distilled.report.window_error = error;
        distilled.report.networks = true;
        distilled.system = system;
    }

    /// The part of the report that precedes any fit.
    fn report(&self) -> DistillReport {
        let paths = match self.motion.as_ref().map(|motion| motion.kind) {
            Some(PoseKind::Rigid) => PathKind::Rigid,
            Some(PoseKind::Affine) => PathKind::Affine,
            None => PathKind::Independent,
        };
        DistillReport {
            particles: self.paths.len(),
            paths,
            independent_noise: self.noise,
            shared_residual: self.motion.as_ref().map_or(0.0, |motion| motion.residual),
            displacement: self.displacement,
            degree: self.degree,
            terms: None,
            law: None,
            rigid_constraint: false,
            forecast_error: None,
            window_error: 0.0,
            networks: false,
            force_ratio: 0.0,
        }
    }

    /// `‖Q‖/‖∇U‖` at visited states.
    pub(crate) fn force_ratio(&self, system: &System) -> f64 {
        let states =
            || self.judges.iter().flat_map(|&j| (0..self.paths.samples()).step_by(5).map(move |s| (j, s)));
        let q: Vec<_> = states().map(|(j, s)| crate::dense::narrow(self.paths.position(j, s))).collect();
        let v: Vec<_> = states().map(|(j, s)| crate::dense::narrow(self.paths.velocity(j, s))).collect();
        let size = |rows: &[[f32; 3]]| rows.iter().map(|&r| norm2(wide(r))).sum::<f64>().sqrt();
        let (force, gradient) = (size(&system.forces(&q, &v)), size(&system.potential_gradients(&q)));
        if gradient > 0.0 { force / gradient } else { force }
    }
}

/// The motion that the particles share, if they do.
fn shared_motion(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    config: &DistillConfig,
    noise: f64,
    displacement: f64,
) -> Option<SharedMotion> {
    let fit = |kind| SharedMotion::fit(trajectories, weights, kind).refined(trajectories, weights);
    match config.shared_motion {
        SharedMotionKind::None => None,
        SharedMotionKind::Rigid => Some(fit(PoseKind::Rigid)),
        SharedMotionKind::Affine => Some(fit(PoseKind::Affine)),
        SharedMotionKind::Auto => {
            let (rigid, affine) = (fit(PoseKind::Rigid), fit(PoseKind::Affine));
            let rigid_enough = rigid.residual <= RIGID_SLACK * affine.residual
                || rigid.residual <= affine.residual + RIGID_TOLERANCE * displacement;
            let better = if rigid_enough { rigid } else { affine };
            (better.residual <= 1.5 * noise + f64::from(config.shared_residual) * displacement)
                .then_some(better)
        }
    }
}

/// Scales of the motion.
fn scales(paths: &Paths, judges: &[usize], duration: f64) -> Normalisation {
    let (mut q, mut v, mut a): (Vec<V3>, Vec<V3>, Vec<V3>) = (Vec::new(), Vec::new(), Vec::new());
    for &j in judges {
        for s in 0..paths.samples() {
            q.push(paths.position(j, s));
            v.push(paths.velocity(j, s));
            a.push(paths.acceleration(j, s));
        }
    }
    normalisation(&q, &v, &a, duration)
}
