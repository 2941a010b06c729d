//! Training U and Q: acceleration matching at visited states, then rollouts (Eq. 7) with a growing horizon.
//!
//! Matching comes first because a force that is right everywhere rolls out right, and each state teaches by
//! itself; rollouts then remove what smoothing and discretisation have left. Starting velocities are
//! corrected by one linear field for the whole object (twelve unknowns), not per particle, so that they
//! cannot fit noise.

use crate::adam::{Adam, clip, cosine};
use crate::config::{MatchingConfig, RolloutConfig};
use crate::dense::{narrow, sub, wide};
use crate::targets::Paths;
use lgs_core::linear;
use lgs_dynamics::{
    Edit, RolloutSpec, State, StateCotangents, Supports, System, VelocityPolicy, acceleration_vjp, rollout,
    rollout_vjp,
};
use rand::RngExt;

/// Only Q.
const FORCE_ONLY: Edit = Edit { velocity_scale: 1.0, potential_scale: 0.0, force_scale: 1.0 };

/// Unknowns of a linear velocity field.
const FIELD: usize = 12;

/// How rollouts of a training run go.
#[derive(Clone, Copy)]
pub(crate) struct Hold<'a> {
    /// Supports of all particles of the paths, which are then rolled out together; none: particles are
    /// independent.
    pub(crate) supports: Option<&'a Supports>,
    /// Whether Q is left as it is.
    pub(crate) force_is_fixed: bool,
}

impl<'a> Hold<'a> {
    /// A rollout of full steps.
    pub(crate) fn spec(&self, dt: f32, steps: usize) -> RolloutSpec<'a> {
        let spec = RolloutSpec::new(dt, steps);
        match self.supports {
            Some(supports) => spec.aligned(supports, VelocityPolicy::Rigid),
            None => spec,
        }
    }
}

/// What is reported while a network trains.
pub(crate) struct Tick {
    /// Step done.
    pub(crate) step: usize,
    /// Its loss.
    pub(crate) loss: f32,
}

/// Fits the parameters to the accelerations of the paths. The loss is the mean squared error in units of the
/// acceleration scale.
pub(crate) fn match_accelerations(
    system: &mut System,
    paths: &Paths,
    config: &MatchingConfig,
    seed: u64,
    tick: &mut dyn FnMut(Tick),
) {
    let mut adam = Adam::new(system.params.len());
    let unit = system.config.normalisation.acceleration;
    for step in 0..config.steps {
        let mut rng = lgs_core::stream(seed, "acceleration matching", step as u64);
        let (mut q, mut v, mut target) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..config.batch {
            let (particle, sample) = (rng.random_range(0..paths.len()), rng.random_range(0..paths.samples()));
            q.push(narrow(paths.position(particle, sample)));
            v.push(narrow(paths.velocity(particle, sample)));
            target.push(narrow(paths.acceleration(particle, sample)));
        }
        let found = system.accelerations(&q, &v, &Edit::default());
        let weight = 2.0 / (unit * unit * config.batch as f32);
        let errors: Vec<[f32; 3]> = found.iter().zip(&target).map(|(&a, &b)| linear::sub(a, b)).collect();
        let loss = errors.iter().map(|&e| linear::dot(e, e)).sum::<f32>() * 0.5 * weight;
        let cotangents: Vec<_> = errors.iter().map(|&e| linear::scale(e, weight)).collect();
        let mut gradient = acceleration_vjp(system, &q, &v, &Edit::default(), &cotangents).params;
        add_force_penalty(system, &q, &v, config.force_penalty, &mut gradient);
        clip(&mut gradient);
        adam.step(&mut system.params, &gradient, cosine(config.learning_rate, step, config.steps));
        tick(Tick { step, loss });
    }
}

/// Adds the gradient of `weight · mean |Q/σ_a|²` (G30).
fn add_force_penalty(system: &System, q: &[[f32; 3]], v: &[[f32; 3]], weight: f32, gradient: &mut [f32]) {
    if weight == 0.0 || system.config.force == lgs_dynamics::ForceKind::None {
        return;
    }
    let unit = system.config.normalisation.acceleration;
    let factor = 2.0 * weight / (unit * unit * q.len() as f32);
    let cotangents: Vec<_> = system.forces(q, v).iter().map(|&f| linear::scale(f, factor)).collect();
    let own = acceleration_vjp(system, q, v, &FORCE_ONLY, &cotangents).params;
    gradient.iter_mut().zip(own).for_each(|(g, o)| *g += o);
}

/// A correction of starting velocities that is linear in the position.
#[derive(Clone, Debug)]
pub(crate) struct VelocityField {
    /// Shift, then the linear map row by row, in units of the speed scale at distances of the length scale.
    values: [f32; FIELD],
}

impl VelocityField {
    /// No correction.
    pub(crate) const NONE: Self = Self { values: [0.0; FIELD] };

    /// The corrected velocity.
    pub(crate) fn apply(&self, system: &System, q: [f32; 3], v: [f32; 3]) -> [f32; 3] {
        let n = &system.config.normalisation;
        let x: [f32; 3] = std::array::from_fn(|i| (q[i] - n.center[i]) / n.length);
        std::array::from_fn(|i| v[i] + n.speed * (self.values[i] + linear::dot(x, self.row(i))))
    }

    fn row(&self, i: usize) -> [f32; 3] {
        [self.values[3 + 3 * i], self.values[4 + 3 * i], self.values[5 + 3 * i]]
    }

    /// Cotangents of the values, given those of the velocities.
    fn pull_back(system: &System, q: &[[f32; 3]], v_v0: &[[f32; 3]]) -> [f32; FIELD] {
        let n = &system.config.normalisation;
        let mut out = [0.0; FIELD];
        for (q, v) in q.iter().zip(v_v0) {
            for i in 0..3 {
                out[i] += n.speed * v[i];
                for j in 0..3 {
                    out[3 + 3 * i + j] += n.speed * v[i] * (q[j] - n.center[j]) / n.length;
                }
            }
        }
        out
    }
}

/// Fits parameters and the velocity field to the positions of the paths by rollouts (Eq. 7, in units of the
/// length scale).
pub(crate) fn refine_by_rollouts(
    system: &mut System,
    field: &mut VelocityField,
    paths: &Paths,
    config: &RolloutConfig,
    hold: Hold<'_>,
    seed: u64,
    tick: &mut dyn FnMut(Tick),
) {
    let (mut adam, mut field_adam) = (Adam::new(system.params.len()), Adam::new(FIELD));
    let window = paths.samples() - 1;
    let fixed: Vec<_> =
        system.layout().into_iter().filter(|e| e.name.starts_with("force.")).map(|e| e.range).collect();
    for step in 0..config.steps {
        let mut rng = lgs_core::stream(seed, "rollout distillation", step as u64);
        let chosen: Vec<usize> = match hold.supports {
            Some(_) => (0..paths.len()).collect(),
            None => {
                (0..config.particles.min(paths.len())).map(|_| rng.random_range(0..paths.len())).collect()
            }
        };
        let first = config.first_horizon.min(window);
        let horizon = (first + (window - first) * 2 * step / config.steps.max(1)).min(window);
        let (loss, mut gradient, mut of_field) =
            rollout_gradient(system, field, paths, &chosen, horizon, config.force_penalty, hold);
        if hold.force_is_fixed {
            fixed.iter().for_each(|range| gradient[range.clone()].fill(0.0));
        }
        clip(&mut gradient);
        clip(&mut of_field);
        adam.step(&mut system.params, &gradient, cosine(config.learning_rate, step, config.steps));
        field_adam.step(
            &mut field.values,
            &of_field,
            cosine(config.velocity_learning_rate, step, config.steps),
        );
        tick(Tick { step, loss });
    }
}

/// Loss of a batch of rollouts, and its gradients by the parameters and the velocity field.
fn rollout_gradient(
    system: &System,
    field: &VelocityField,
    paths: &Paths,
    chosen: &[usize],
    horizon: usize,
    force_penalty: f32,
    hold: Hold<'_>,
) -> (f32, Vec<f32>, [f32; FIELD]) {
    let start = start_of(system, field, paths, chosen);
    let spec = hold.spec(paths.dt(), horizon);
    let states = rollout(system, &start, &spec);
    let unit = system.config.normalisation.length;
    let weight = 2.0 / (unit * unit * (chosen.len() * horizon) as f32);
    let mut loss = 0.0;
    let cotangents: Vec<StateCotangents> = states
        .iter()
        .enumerate()
        .map(|(sample, state)| {
            let errors =
                state.q.iter().zip(chosen).map(|(&q, &j)| narrow(sub(wide(q), paths.position(j, sample))));
            let q: Vec<_> = errors
                .map(|e| {
                    loss += 0.5 * weight * linear::dot(e, e);
                    linear::scale(e, weight)
                })
                .collect();
            StateCotangents { q, ..StateCotangents::default() }
        })
        .collect();
    let mut gradients = rollout_vjp(system, &spec, &states, &cotangents);
    let middle = &states[horizon / 2];
    add_force_penalty(system, &middle.q, &middle.v, force_penalty, &mut gradients.params);
    let of_field = VelocityField::pull_back(system, &start.q, &gradients.v0);
    (loss, gradients.params, of_field)
}

/// The start of some particles.
pub(crate) fn start_of(system: &System, field: &VelocityField, paths: &Paths, chosen: &[usize]) -> State {
    let q: Vec<[f32; 3]> = chosen.iter().map(|&j| narrow(paths.position(j, 0))).collect();
    let v =
        chosen.iter().zip(&q).map(|(&j, &q)| field.apply(system, q, narrow(paths.velocity(j, 0)))).collect();
    State::at_start(q, v)
}

/// Root mean square position error of rollouts of these particles at samples `from..to` of the paths
/// (infinite if not finite).
pub(crate) fn rollout_error(
    system: &System,
    field: &VelocityField,
    paths: &Paths,
    chosen: &[usize],
    samples: std::ops::Range<usize>,
    hold: Hold<'_>,
) -> f64 {
    let states =
        rollout(system, &start_of(system, field, paths, chosen), &hold.spec(paths.dt(), samples.end - 1));
    let mut sum = 0.0;
    for sample in samples.clone() {
        for (&q, &j) in states[sample].q.iter().zip(chosen) {
            sum += crate::dense::norm2(sub(wide(q), paths.position(j, sample)));
        }
    }
    let mean = sum / (samples.len() * chosen.len()).max(1) as f64;
    if mean.is_finite() { mean.sqrt() } else { f64::INFINITY }
}
