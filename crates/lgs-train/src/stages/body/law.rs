//! An object that follows a law in generalised coordinates: its start, the law's parameters and the place of
//! its joint or centre of mass are the unknowns.

use std::ops::Range;

use glam::DMat3;
use lgs_core::linear::{norm, quat_mul, scale, sub};
use lgs_mechanics::coordinates::{Bodies, Embedding, State};
use lgs_mechanics::terms::Entry;
use lgs_mechanics::{Edit, Sensitivity, System};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene};

use super::{Positions, Response, Responses, geometry};
use crate::stages::initial_pose::mean;
use crate::stages::observation::displacement_of;
use crate::stages::thresholds::{
    LEAST_UNIT, PRIOR_DEVIATION, UNIT_IN_DEVIATIONS, UNIT_IN_VALUES, UNKNOWN_PROBE,
};

/// One object and the units of its unknowns: changes of the configuration at t = 0, of its velocity, of the
/// law's parameters, and of the geometry of its coordinates.
pub(in crate::stages) struct LawBody {
    base: GeneralisedDynamics,
    /// Root mean square distance from the centre of each body, world units.
    radii: Vec<f32>,
    units: Vec<f64>,
    /// Whether the law changes the shape of its body.
    deforms: bool,
}

impl LawBody {
    pub(super) fn new(scene: &LagrangianScene, object: usize, base: &GeneralisedDynamics) -> Self {
        let points = &scene.dynamic_gaussians.means[scene.objects[object].members.clone()];
        let radius = |rows: Range<usize>| {
            let points = &points[rows];
            let center = mean(points);
            let square: f32 = points.iter().map(|&p| norm(sub(p, center)).powi(2)).sum();
            (square / (3 * points.len().max(1)) as f32).sqrt().max(f32::MIN_POSITIVE)
        };
        let radii: Vec<f32> = base.bodies.ranges(points.len()).into_iter().map(radius).collect();
        let mean_radius = f64::from(radii.iter().sum::<f32>() / radii.len() as f32);
        Self {
            units: units(base, mean_radius, scene.motion.time_window),
            deforms: scene.objects[object].deforms(),
            base: base.clone(),
            radii,
        }
    }

    pub(super) fn radii(&self) -> &[f32] {
        &self.radii
    }

    pub(super) fn deforms(&self) -> bool {
        self.deforms
    }

    pub(super) fn unknowns(&self) -> usize {
        self.units.len()
    }

    /// The dynamics after a change of start and parameters, and after one of the geometry as well.
    fn changed(&self, by: &[f64]) -> [GeneralisedDynamics; 2] {
        let change: Vec<f64> = by.iter().zip(&self.units).map(|(by, unit)| by * unit).collect();
        let mut changed = self.base.clone();
        let (n, m) = (changed.start.v.len(), changed.law.parameters.len());
        changed.start.x = changed.law.coordinates.retract(&changed.start.x, &change[..n]);
        changed.start.v.iter_mut().zip(&change[n..2 * n]).for_each(|(v, change)| *v += change);
        let table = changed.law.table();
        let parameters = changed.law.parameters.iter_mut().zip(&change[2 * n..]);
        for ((parameter, change), (described, _)) in parameters.zip(&table) {
            // No damping becomes negative, and no moment of inertia one that no body of this shape has.
            let [lower, upper] = described.absolute_bounds();
            *parameter = (*parameter + change).clamp(lower, upper);
        }
        let mut reshaped = changed.clone();
        geometry::change(&change[2 * n + m..], &mut reshaped);
        [changed, reshaped]
    }

    pub(super) fn change(&self, by: &[f64], scene: &mut LagrangianScene, object: usize) {
        let [changed, reshaped] = self.changed(by);
        let members = scene.objects[object].members.clone();
        let moved = self.base.placed(&scene.dynamic_gaussians.means[members.clone()], &changed.start);
        let velocities = reshaped.start_velocities(&moved.q, lgs_dynamics::Edit::default());
        scene.velocities[members.clone()].copy_from_slice(&velocities);
        scene.dynamic_gaussians.means[members.clone()].copy_from_slice(&moved.q);
        for rows in scene.objects[object].bodies().into_iter().filter(|rows| !rows.is_empty()) {
            let turn = moved.rotation[rows.start - members.start];
            scene.dynamic_gaussians.turn_harmonics(rows, turn);
        }
        for (rotation, &turn) in scene.dynamic_gaussians.rotations[members].iter_mut().zip(&moved.rotation) {
            *rotation = quat_mul(turn, *rotation);
        }
        scene.objects[object].dynamics =
            Dynamics::Generalised(reshaped.with_impacts(f64::from(scene.motion.time_window)));
    }

    pub(super) fn responses(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Responses {
        let positions = self.positions(alone, change, times);
        let parts = bodies_of(alone);
        let of_time = |(q, rates): (&Vec<[f32; 3]>, Vec<Vec<[f32; 3]>>)| -> Vec<Response> {
            let of_part = |rows: Range<usize>| {
                let center = mean(&q[rows.clone()]);
                let offsets: Vec<[f32; 3]> = q[rows.clone()].iter().map(|&p| sub(p, center)).collect();
                let displacement = |rates: &Vec<[f32; 3]>| {
                    let rates = &rates[rows.clone()];
                    displacement_of(&offsets, rates, self.deforms)
                };
                Response { center, by_unknown: rates.iter().map(displacement).collect() }
            };
            parts.ranges(q.len()).into_iter().map(of_part).collect()
        };
        positions.iter().zip(self.rates(alone, change, times)).map(of_time).collect()
    }

    pub(super) fn information_of_trajectories(&self, alone: &LagrangianScene, times: &[f32]) -> Vec<f64> {
        let particles = alone.dynamic_gaussians.len().max(1) as f64;
        let n = self.unknowns();
        let mut information = vec![0.0; n * n];
        for rates in self.rates(alone, &vec![0.0; n], times) {
            let product = |a: &[[f32; 3]], b: &[[f32; 3]]| {
                let pairs = a.as_flattened().iter().zip(b.as_flattened());
                pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>() / particles
            };
            let cells = information.iter_mut().enumerate();
            cells.for_each(|(cell, sum)| *sum += product(&rates[cell / n], &rates[cell % n]));
        }
        information
    }

    /// Positions of the particles of `alone` after a change, by time.
    pub(super) fn positions(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Positions {
        let [changed, reshaped] = self.changed(change);
        let points = self.started(alone, &changed.start);
        let times: Vec<f64> = times.iter().map(|&t| f64::from(t)).collect();
        let states = reshaped.states(lgs_dynamics::Edit::default(), &times);
        let reshaped = GeneralisedDynamics { bodies: bodies_of(alone), ..reshaped };
        states.iter().map(|state| reshaped.placed(&points, state).q).collect()
    }

    /// The particles of `alone` in a changed start.
    fn started(&self, alone: &LagrangianScene, start: &State) -> Vec<[f32; 3]> {
        let base = GeneralisedDynamics { bodies: bodies_of(alone), ..self.base.clone() };
        base.placed(&alone.dynamic_gaussians.means, start).q
    }

    /// Derivatives of the particles' positions: by time, unknown and particle. Those by start and parameters
    /// are exact, those by the geometry central differences.
    fn rates(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Vec<Vec<[f32; 3]>>> {
        let [changed, reshaped] = self.changed(change);
        let points = self.started(alone, &changed.start);
        let moving = GeneralisedDynamics { bodies: bodies_of(alone), ..reshaped.clone() };
        let exact = |at: &Sensitivity| -> Vec<Vec<[f32; 3]>> {
            let of_unknown = |unknown: usize| {
                let column = at.position.column(unknown) * self.units[unknown];
                let rates = moving.carried(&points, &at.state, column.as_slice());
                rates.iter().map(|rate| rate.as_vec3().to_array()).collect()
            };
            (0..at.position.ncols()).map(of_unknown).collect()
        };
        let mut rates: Vec<Vec<Vec<[f32; 3]>>> = sensitivities(&reshaped, times).iter().map(exact).collect();
        for unknown in self.unknowns() - geometry::unknowns(&self.base)..self.unknowns() {
            let [ahead, behind] = [UNKNOWN_PROBE, -UNKNOWN_PROBE].map(|probe| {
                let mut by = change.to_vec();
                by[unknown] += probe;
                self.positions(alone, &by, times)
            });
            let rate = |(&a, &b): (&[f32; 3], &[f32; 3])| scale(sub(a, b), (0.5 / UNKNOWN_PROBE) as f32);
            for ((of_time, ahead), behind) in rates.iter_mut().zip(&ahead).zip(&behind) {
                of_time.push(ahead.iter().zip(behind).map(rate).collect());
            }
        }
        rates
    }
}

/// Which particles of a scene of one object belong to which of its bodies.
fn bodies_of(alone: &LagrangianScene) -> Bodies {
    alone.objects[0].dynamics.generalised().map(|dynamics| dynamics.bodies.clone()).unwrap_or_default()
}

/// The states at some times with their derivatives; those at the start where the motion cannot be followed.
fn sensitivities(dynamics: &GeneralisedDynamics, times: &[f32]) -> Vec<Sensitivity> {
    let times: Vec<f64> = times.iter().map(|&t| f64::from(t)).collect();
    let system = System::new(&dynamics.law, Edit::NONE);
    let at_start = || system.sensitivities(&dynamics.start, &vec![0.0; times.len()]);
    system.sensitivities(&dynamics.start, &times).or_else(|_| at_start()).unwrap_or_default()
}

/// Units of all unknowns: of the configuration one radius or radian, of its velocity the same over the
/// captured window, of the parameters as far as stage 1 has left them open; constants have none.
fn units(dynamics: &GeneralisedDynamics, radius: f64, time_window: f32) -> Vec<f64> {
    let GeneralisedDynamics { law, start, .. } = dynamics;
    let embedding = Embedding::new(&law.coordinates, &start.x);
    let n = start.v.len();
    // A change by one radian moves points at the distance of a radius by a radius.
    let length_of = |freedom: usize| {
        let mut unit = vec![0.0; n];
        unit[freedom] = 1.0;
        let rates = embedding.rates(&start.x, &unit);
        let turns = rates.iter().any(|rate| rate.linear != DMat3::ZERO);
        if turns { radius } else { rates.iter().map(|rate| rate.to.length()).fold(0.0, f64::max) }
    };
    let of_start: Vec<f64> =
        (0..n).map(|freedom| radius / length_of(freedom).max(f64::MIN_POSITIVE)).collect();
    let mut units = of_start.clone();
    units.extend(of_start.iter().map(|unit| unit / f64::from(time_window)));
    let table = law.table();
    let unit = |(i, value): (usize, &f64)| match law.deviations.get(i) {
        _ if table[i].0.entry == Entry::Constant => 0.0,
        Some(&deviation) if deviation > 0.0 => {
            let of_prior = table[i].0.spread / PRIOR_DEVIATION;
            (UNIT_IN_DEVIATIONS * deviation).min(of_prior).max(LEAST_UNIT)
        }
        _ => (UNIT_IN_VALUES * value.abs()).max(LEAST_UNIT),
    };
    units.extend(law.parameters.iter().enumerate().map(unit));
    units.extend(geometry::units(dynamics, radius));
    units
}
