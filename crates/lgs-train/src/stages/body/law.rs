//! An object that follows a law in generalised coordinates: its start, the law's parameters and the place of
//! its joint or centre of mass are the unknowns.

use glam::Vec3;
use lgs_core::linear::{quat_mul, scale, sub};
use lgs_mechanics::coordinates::Embedding;
use lgs_mechanics::terms::Entry;
use lgs_mechanics::{Edit, Sensitivity, System};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene};

use super::{Response, geometry};
use crate::stages::initial_pose::{mean, spin};

/// Unit of a parameter in its standard deviations after stage 1, so that the weak prior of the fit (method
/// §6) leaves it ten times the freedom that the tracks do, whose noise is correlated and known roughly.
const UNIT_IN_DEVIATIONS: f64 = 30.0;
/// Unit of a parameter without a known deviation, as a part of its value.
const UNIT_IN_VALUES: f64 = 0.3;

/// Least unit of a parameter that is fitted: rounding must not make it zero.
const LEAST_UNIT: f64 = 1e-150;

/// Step of the central differences by an unknown of the geometry, in its unit.
const PROBE: f64 = 0.01;

/// One object and the units of its unknowns: changes of the configuration at t = 0, of its velocity, of the
/// law's parameters, and of the geometry of its coordinates.
pub(in crate::stages) struct LawBody {
    base: GeneralisedDynamics,
    /// Root mean square distance from the centre, world units.
    radius: f32,
    units: Vec<f64>,
}

impl LawBody {
    pub(super) fn new(scene: &LagrangianScene, object: usize, base: &GeneralisedDynamics) -> Self {
        let points = &scene.dynamic_gaussians.means[scene.objects[object].members.clone()];
        let center = mean(points);
        let squares: f32 = points.iter().map(|&p| sub(p, center).iter().map(|x| x * x).sum::<f32>()).sum();
        let radius = (squares / (3 * points.len().max(1)) as f32).sqrt().max(f32::MIN_POSITIVE);
        Self { units: units(base, f64::from(radius), scene.motion.time_window), base: base.clone(), radius }
    }

    pub(super) fn radius(&self) -> f32 {
        self.radius
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
            // Bounds at zero hold in every unit: no damping becomes negative.
            let lower = if described.bounds[0] == 0.0 { 0.0 } else { f64::NEG_INFINITY };
            *parameter = (*parameter + change).max(lower);
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
        for (rotation, &turn) in scene.dynamic_gaussians.rotations[members].iter_mut().zip(&moved.rotation) {
            *rotation = quat_mul(turn, *rotation);
        }
        scene.objects[object].dynamics =
            Dynamics::Generalised(reshaped.with_impacts(f64::from(scene.motion.time_window)));
    }

    pub(super) fn responses(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Response> {
        let positions = self.positions(alone, change, times);
        let mut responses = Vec::with_capacity(times.len());
        for (q, rates) in positions.iter().zip(self.rates(alone, change, times)) {
            let center = mean(q);
            let offsets: Vec<[f32; 3]> = q.iter().map(|&p| sub(p, center)).collect();
            let displacement = |rates: &Vec<[f32; 3]>| {
                let ([tx, ty, tz], [rx, ry, rz]) = (mean(rates), spin(&offsets, rates));
                [tx, ty, tz, rx, ry, rz].map(f64::from)
            };
            responses.push(Response { center, by_unknown: rates.iter().map(displacement).collect() });
        }
        responses
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
    fn positions(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Vec<[f32; 3]>> {
        let [changed, reshaped] = self.changed(change);
        let points = self.base.placed(&alone.dynamic_gaussians.means, &changed.start).q;
        let times: Vec<f64> = times.iter().map(|&t| f64::from(t)).collect();
        let states = reshaped.states(lgs_dynamics::Edit::default(), &times);
        states.iter().map(|state| reshaped.placed(&points, state).q).collect()
    }

    /// Derivatives of the particles' positions: by time, unknown and particle. Those by start and parameters
    /// are exact, those by the geometry central differences.
    fn rates(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Vec<Vec<[f32; 3]>>> {
        let [changed, reshaped] = self.changed(change);
        let points = self.base.placed(&alone.dynamic_gaussians.means, &changed.start).q;
        let embedding = Embedding::new(&reshaped.law.coordinates, &reshaped.start.x);
        let exact = |at: &Sensitivity| -> Vec<Vec<[f32; 3]>> {
            let of_unknown = |unknown: usize| {
                let column = at.position.column(unknown) * self.units[unknown];
                let rate = embedding.rates(&at.state.x, column.as_slice())[0];
                let of_point = |&p: &[f32; 3]| rate.apply(Vec3::from(p).as_dvec3()).as_vec3().to_array();
                points.iter().map(of_point).collect()
            };
            (0..at.position.ncols()).map(of_unknown).collect()
        };
        let mut rates: Vec<Vec<Vec<[f32; 3]>>> = sensitivities(&reshaped, times).iter().map(exact).collect();
        for unknown in self.unknowns() - geometry::unknowns(&self.base)..self.unknowns() {
            let [ahead, behind] = [PROBE, -PROBE].map(|probe| {
                let mut by = change.to_vec();
                by[unknown] += probe;
                self.positions(alone, &by, times)
            });
            let rate = |(&a, &b): (&[f32; 3], &[f32; 3])| scale(sub(a, b), (0.5 / PROBE) as f32);
            for ((of_time, ahead), behind) in rates.iter_mut().zip(&ahead).zip(&behind) {
                of_time.push(ahead.iter().zip(behind).map(rate).collect());
            }
        }
        rates
    }
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
        let rate = embedding.rates(&start.x, &unit)[0];
        if rate.linear.to_cols_array().iter().all(|x| *x == 0.0) { rate.to.length() } else { radius }
    };
    let of_start: Vec<f64> =
        (0..n).map(|freedom| radius / length_of(freedom).max(f64::MIN_POSITIVE)).collect();
    let mut units = of_start.clone();
    units.extend(of_start.iter().map(|unit| unit / f64::from(time_window)));
    let table = law.table();
    let unit = |(i, value): (usize, &f64)| match law.deviations.get(i) {
        _ if table[i].0.entry == Entry::Constant => 0.0,
        Some(&deviation) if deviation > 0.0 => (UNIT_IN_DEVIATIONS * deviation).max(LEAST_UNIT),
        _ => (UNIT_IN_VALUES * value.abs()).max(LEAST_UNIT),
    };
    units.extend(law.parameters.iter().enumerate().map(unit));
    units.extend(geometry::units(dynamics, radius));
    units
}
