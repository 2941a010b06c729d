//! An object of particles as a body with a linear law: a few numbers change where it starts, how it starts
//! and what it follows.

use lgs_core::linear::{add, cross, mat_vec, matrix_from_quat, quat_mul, quat_normalize, scale, sub};
use lgs_distill::LinearPart;
use lgs_dynamics::{Edit, Reversal, System};
use lgs_model::{LagrangianScene, Motion};
use rayon::prelude::*;

use super::Response;
use crate::stages::initial_pose::{mean, spin};
use crate::stages::observation::displacement_of;
use crate::stages::thresholds::{LEAST_RADIUS, UNKNOWN_PROBE};

/// Unknowns before those of the law: translation and rotation at t = 0, linear and angular velocity.
const OF_START: usize = 12;

/// One object of particles and the units of its unknowns.
pub(in crate::stages) struct ParticleBody {
    center: [f32; 3],
    /// Root mean square distance from the centre, world units.
    radius: f32,
    /// Root mean square speed, at t = 0 or over the motion that its law was fitted to, world units per unit
    /// of time.
    speed: f32,
    spin: [f32; 3],
    law: LinearPart,
}

impl ParticleBody {
    pub(super) fn new(scene: &LagrangianScene, object: usize, system: &System) -> Self {
        let members = &scene.objects[object].members;
        let (points, velocities) =
            (&scene.dynamic_gaussians.means[members.clone()], &scene.velocities[members.clone()]);
        let center = mean(points);
        let offsets: Vec<[f32; 3]> = points.iter().map(|&p| sub(p, center)).collect();
        let rms = |list: &[[f32; 3]]| {
            (list.as_flattened().iter().map(|x| x * x).sum::<f32>() / list.len().max(1) as f32).sqrt()
        };
        let scales = system.config.normalisation;
        let (radius, speed) =
            (rms(&offsets).max(LEAST_RADIUS * scales.length), rms(velocities).max(scales.speed));
        Self { center, radius, speed, spin: spin(&offsets, velocities), law: LinearPart::of(system) }
    }

    /// Root mean square distance from the centre, world units.
    pub(super) fn radius(&self) -> f32 {
        self.radius
    }

    pub(super) fn unknowns(&self) -> usize {
        OF_START + self.law.len()
    }

    /// Changes an object of a scene, all of it or a part: displacement at t = 0, in radii and radians, along
    /// its own field of velocities; linear and angular velocity, in units of its speed and of its speed per
    /// radius; constants of its law, in units of the system's normalisation.
    pub(super) fn change(&self, by: &[f64], scene: &mut LagrangianScene, object: usize) {
        let vector = |at: usize, unit: f32| -> [f32; 3] { std::array::from_fn(|i| by[at + i] as f32 * unit) };
        let (translation, [x, y, z]) = (vector(0, self.radius), vector(3, 0.5));
        let (linear, angular) = (vector(6, self.speed), vector(9, self.speed / self.radius));
        let turn = quat_normalize([1.0, x, y, z]);
        let matrix = matrix_from_quat(turn);
        let members = scene.objects[object].members.clone();
        for i in members {
            let (point, velocity) = (scene.dynamic_gaussians.means[i], scene.velocities[i]);
            let offset = sub(point, self.center);
            let moved = add(add(self.center, translation), mat_vec(&matrix, offset));
            let carried = cross(add(self.spin, angular), sub(moved, point));
            scene.velocities[i] = add(add(velocity, carried), add(linear, cross(angular, offset)));
            scene.dynamic_gaussians.means[i] = moved;
            scene.dynamic_gaussians.rotations[i] = quat_mul(turn, scene.dynamic_gaussians.rotations[i]);
        }
        if let Some(particles) = scene.objects[object].dynamics.particles_mut() {
            self.law.write_changed(&by[OF_START..], &mut particles.system);
        }
    }

    /// The body at some times after a change, with its derivatives by each unknown: central differences of
    /// rollouts of the particles of `alone`.
    pub(super) fn responses(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Response> {
        let states = positions(&self.changed(alone, change), times);
        let centers: Vec<[f32; 3]> = states.iter().map(|q| mean(q)).collect();
        let mut responses: Vec<Response> =
            centers.iter().map(|&center| Response { center, by_unknown: Vec::new() }).collect();
        for of_unknown in self.rates(alone, change, times) {
            for (k, rates) in of_unknown.iter().enumerate() {
                let offsets: Vec<[f32; 3]> = states[k].iter().map(|&p| sub(p, centers[k])).collect();
                responses[k].by_unknown.push(displacement_of(&offsets, rates, false));
            }
        }
        responses
    }

    /// Information on the unknowns `[n, n]` in trajectories of particles without any rigid constraint: inner
    /// products of the positions' derivatives, means over the particles, summed over the times.
    pub(super) fn information_of_trajectories(&self, alone: &LagrangianScene, times: &[f32]) -> Vec<f64> {
        let mut unconstrained = alone.clone();
        let particles = unconstrained.objects.iter_mut().filter_map(|object| object.dynamics.particles_mut());
        particles.for_each(|particles| particles.supports = None);
        let n = self.unknowns();
        let derivatives: Vec<Vec<f32>> = self
            .rates(&unconstrained, &vec![0.0; n], times)
            .into_iter()
            .map(|of_unknown| of_unknown.concat().into_flattened())
            .collect();
        let particles = alone.dynamic_gaussians.len().max(1) as f64;
        let product = |a: &[f32], b: &[f32]| {
            a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>() / particles
        };
        (0..n * n).map(|at| product(&derivatives[at / n], &derivatives[at % n])).collect()
    }

    /// Derivatives of all positions: by unknown, time and particle.
    fn rates(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Vec<Vec<[f32; 3]>>> {
        let by_unknown = |unknown: usize| {
            let [ahead, behind] = [UNKNOWN_PROBE, -UNKNOWN_PROBE].map(|probe| {
                let mut by = change.to_vec();
                by[unknown] += probe;
                positions(&self.changed(alone, &by), times)
            });
            let rate = |(&a, &b): (&[f32; 3], &[f32; 3])| scale(sub(a, b), (0.5 / UNKNOWN_PROBE) as f32);
            ahead
                .iter()
                .zip(&behind)
                .map(|(ahead, behind)| ahead.iter().zip(behind).map(rate).collect())
                .collect()
        };
        (0..self.unknowns()).into_par_iter().map(by_unknown).collect()
    }

    /// The scene of its particles alone after a change.
    fn changed(&self, alone: &LagrangianScene, by: &[f64]) -> LagrangianScene {
        let mut changed = alone.clone();
        self.change(by, &mut changed, 0);
        changed
    }
}

/// Positions of a scene's particles at some times.
fn positions(scene: &LagrangianScene, times: &[f32]) -> Vec<Vec<[f32; 3]>> {
    let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
    times.iter().map(|&t| motion.state_at(t).q).collect()
}
