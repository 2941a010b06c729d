//! An object that follows a law in generalised coordinates: its start and the law's parameters are the
//! unknowns, and derivatives of its motion are exact.

use glam::Vec3;
use lgs_core::linear::{quat_mul, sub};
use lgs_mechanics::coordinates::Embedding;
use lgs_mechanics::{Edit, Sensitivity, System};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene};

use super::Response;
use crate::stages::initial_pose::{mean, spin};

/// Unit of a parameter in its standard deviations after stage 1, so that the weak prior of the fit (method
/// §6) leaves it ten times the freedom that the tracks do, whose noise is correlated and known roughly.
const UNIT_IN_DEVIATIONS: f64 = 30.0;
/// Unit of a parameter without a known deviation, as a part of its value.
const UNIT_IN_VALUES: f64 = 0.3;

/// One object and the units of its unknowns: changes of the configuration at t = 0, of its velocity, and of
/// the law's parameters.
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

    /// The dynamics after a change.
    fn changed(&self, by: &[f64]) -> GeneralisedDynamics {
        let change: Vec<f64> = by.iter().zip(&self.units).map(|(by, unit)| by * unit).collect();
        let mut changed = self.base.clone();
        let n = changed.start.v.len();
        changed.start.x = changed.law.coordinates.retract(&changed.start.x, &change[..n]);
        changed.start.v.iter_mut().zip(&change[n..]).for_each(|(v, change)| *v += change);
        let table = changed.law.table();
        let parameters = changed.law.parameters.iter_mut().zip(&change[2 * n..]);
        for ((parameter, change), (described, _)) in parameters.zip(&table) {
            // Bounds at zero hold in every unit: no damping becomes negative.
            let lower = if described.bounds[0] == 0.0 { 0.0 } else { f64::NEG_INFINITY };
            *parameter = (*parameter + change).max(lower);
        }
        changed
    }

    pub(super) fn change(&self, by: &[f64], scene: &mut LagrangianScene, object: usize) {
        let changed = self.changed(by);
        let members = scene.objects[object].members.clone();
        let moved = self.base.placed(&scene.dynamic_gaussians.means[members.clone()], &changed.start);
        scene.velocities[members.clone()].copy_from_slice(&moved.v);
        scene.dynamic_gaussians.means[members.clone()].copy_from_slice(&moved.q);
        for (rotation, &turn) in scene.dynamic_gaussians.rotations[members].iter_mut().zip(&moved.rotation) {
            *rotation = quat_mul(turn, *rotation);
        }
        scene.objects[object].dynamics = Dynamics::Generalised(changed);
    }

    pub(super) fn responses(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Response> {
        let (points, changed) = (&alone.dynamic_gaussians.means, self.changed(change));
        let response = |at: &Sensitivity| {
            let q = self.base.placed(points, &at.state).q;
            let center = mean(&q);
            let offsets: Vec<[f32; 3]> = q.iter().map(|&p| sub(p, center)).collect();
            let displacement = |rates: Vec<[f32; 3]>| {
                let ([tx, ty, tz], [rx, ry, rz]) = (mean(&rates), spin(&offsets, &rates));
                [tx, ty, tz, rx, ry, rz].map(f64::from)
            };
            Response { center, by_unknown: self.rates(points, at).map(displacement).collect() }
        };
        sensitivities(&changed, times).iter().map(response).collect()
    }

    pub(super) fn information_of_trajectories(&self, alone: &LagrangianScene, times: &[f32]) -> Vec<f64> {
        let points = &alone.dynamic_gaussians.means;
        let n = self.unknowns();
        let mut information = vec![0.0; n * n];
        for at in sensitivities(&self.base, times) {
            let rates: Vec<Vec<[f32; 3]>> = self.rates(points, &at).collect();
            let product = |a: &[[f32; 3]], b: &[[f32; 3]]| {
                let pairs = a.as_flattened().iter().zip(b.as_flattened());
                pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>() / points.len().max(1) as f64
            };
            let cells = information.iter_mut().enumerate();
            cells.for_each(|(cell, sum)| *sum += product(&rates[cell / n], &rates[cell % n]));
        }
        information
    }

    /// Changes of the positions of particles that are at `points` at t = 0, by unknown and per unit of it.
    fn rates(&self, points: &[[f32; 3]], at: &Sensitivity) -> impl Iterator<Item = Vec<[f32; 3]>> {
        let embedding = Embedding::new(&self.base.law.coordinates, &self.base.start.x);
        (0..self.unknowns()).map(move |unknown| {
            let column = at.position.column(unknown) * self.units[unknown];
            let rate = embedding.rates(&at.state.x, column.as_slice())[0];
            let of_point = |&p: &[f32; 3]| rate.apply(Vec3::from(p).as_dvec3()).as_vec3().to_array();
            points.iter().map(of_point).collect()
        })
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
/// captured window, of the parameters as far as stage 1 has left them open.
fn units(dynamics: &GeneralisedDynamics, radius: f64, time_window: f32) -> Vec<f64> {
    let GeneralisedDynamics { law, start } = dynamics;
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
    let parameters = law.parameters.iter().enumerate().map(|(i, value)| match law.deviations.get(i) {
        Some(&deviation) if deviation > 0.0 => UNIT_IN_DEVIATIONS * deviation,
        _ => UNIT_IN_VALUES * value.abs(),
    });
    units.extend(parameters.map(|unit| unit.max(f64::MIN_POSITIVE.sqrt())));
    units
}
