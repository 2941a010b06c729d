//! Poses of rigid bodies at the times of the frames, as the images show them: each is the scene's motion of
//! the body with a displacement that the views of its time ask for.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{exp, fit_rotation, outer, quaternion, solve_positive, wide};
use lgs_core::linear::{norm, sub};
use lgs_core::{GaussianCloud, psnr_of_mse};
use lgs_data::dataset::Frame;
use lgs_distill::BodyPoses;
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion, SceneState};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::initial_pose::mean;
use super::observation::{Displacement, Normal, Observation, Pose, displaced, observe};

/// Rounds of observation, at least: the second is about poses that the first has put right to a tenth of a
/// pixel, if they were off by no more than one.
const FEWEST_ROUNDS: usize = 2;
/// Rounds at most, for poses that are off by several pixels; each takes back a part of that.
const MOST_ROUNDS: usize = 8;
/// Rounds go on while each lowers the squared error of the images by this part.
const PROGRESS: f64 = 0.02;
/// Standard deviation of the weak prior on a displacement, in radii and radians: what no image shows, such as
/// the rotation of a plain ball, stays as the motion had it.
const PRIOR_DEVIATION: f64 = 0.05;
/// Errors of neighbouring pixels are correlated: so many count as one independent value.
const CORRELATED_VALUES: f64 = 100.0;

/// The motion of a scene at some times, and its bodies as images show them there.
pub(super) struct ImagePoses<'a> {
    scene: &'a LagrangianScene,
    times: &'a [f32],
    states: Vec<SceneState>,
}

/// The rigid displacement of a body at a time from where the scene's motion has it.
#[derive(Clone, Copy)]
pub(super) struct Found {
    turn: DQuat,
    shift: DVec3,
    /// Mean square error of the displacement by what each half of the views shows, world units; 0 where there
    /// are no halves.
    square_error: f64,
}

impl Found {
    const STILL: Self = Self { turn: DQuat::IDENTITY, shift: DVec3::ZERO, square_error: 0.0 };
}

impl<'a> ImagePoses<'a> {
    /// The motion of a scene at ascending times, the first of which is its start.
    pub(super) fn new(scene: &'a LagrangianScene, times: &'a [f32]) -> Self {
        let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
        Self { scene, times, states: times.iter().map(|&time| motion.state_at(time)).collect() }
    }

    /// Root mean square over times and Gaussians of what a rigid motion leaves of that of some Gaussians,
    /// given by their rows among the dynamic ones; world units.
    pub(super) fn deformation(&self, rows: &Range<usize>) -> f64 {
        let left = |state: &SceneState| {
            let (turn, from, to) = self.rigid_fit(rows, state);
            let pairs = self.at_rest(rows).iter().zip(&state.q[rows.clone()]);
            pairs.map(|(&a, &b)| (turn * (wide(a) - from)).distance_squared(wide(b) - to)).sum::<f64>()
        };
        let squared: f64 = self.states.iter().map(left).sum();
        (squared / (rows.len() * self.states.len()).max(1) as f64).sqrt()
    }

    /// Displacements of some bodies, given by their rows among the dynamic Gaussians, by body and time, and
    /// the squared error of the images without them.
    pub(super) fn displacements(&self, bodies: &[Range<usize>], frames: &[&Frame]) -> (Vec<Vec<Found>>, f64) {
        let clouds: Vec<GaussianCloud> = self.states.iter().map(|state| self.scene.cloud_at(state)).collect();
        let times = 0..self.times.len();
        let mut found = vec![vec![Found::STILL; times.len()]; bodies.len()];
        let (mut error, mut latest) = (0.0, f64::INFINITY);
        for round in 0..MOST_ROUNDS {
            let poses: Vec<Vec<Pose>> =
                times.clone().map(|at| self.poses(bodies, &clouds[at], (&found, at))).collect();
            let moved: Vec<GaussianCloud> =
                times.clone().map(|at| self.moved(&clouds[at], bodies, (&found, at))).collect();
            let at = |frame: &Frame| self.times.partition_point(|&time| time < frame.time.max(0.0));
            let observed: Vec<Observation> = frames
                .par_iter()
                .map(|frame| observe(frame, &moved[at(frame)], &poses[at(frame)], self.scene.background))
                .collect();
            let values: f64 = frames.iter().map(|frame| 3.0 * frame.pixels.counted() as f64).sum();
            let squared: f64 = observed.iter().map(|o| o.squared_error).sum();
            let mse = squared / values;
            if round == 0 {
                error = squared;
            }
            tracing::debug!(psnr = psnr_of_mse(mse), "poses from images");
            if round >= FEWEST_ROUNDS && squared > (1.0 - PROGRESS) * latest {
                break;
            }
            latest = squared;
            for (body, found) in found.iter_mut().enumerate() {
                for (time, found) in found.iter_mut().enumerate() {
                    let own = frames.iter().zip(&observed).filter(|(frame, _)| at(frame) == time);
                    let normals: Vec<&Normal> = own.map(|(_, o)| &o.normals[body]).collect();
                    found.refine(&normals, poses[time][body].radius, 1.0 / (CORRELATED_VALUES * mse));
                }
            }
        }
        (found, error)
    }

    /// The points of a rigid body about their centre, and its poses as the images show them. Views that
    /// disagree tell of errors of the Gaussians, which are much the same at neighbouring times.
    pub(super) fn of_body(&self, rows: &Range<usize>, found: &[Found]) -> BodyPoses {
        let points = self.at_rest(rows);
        let center = wide(mean(points));
        let pose = |(state, found): (&SceneState, &Found)| {
            let (turn, _, at) = self.rigid_fit(rows, state);
            (DMat3::from_quat(found.turn * turn), at + found.shift)
        };
        let square_error = found.iter().map(|found| found.square_error).sum::<f64>();
        BodyPoses {
            times: self.times.iter().map(|&time| f64::from(time)).collect(),
            poses: self.states.iter().zip(found).map(pose).collect(),
            shape: points.iter().map(|&p| wide(p) - center).collect(),
            slow_error: (square_error / found.len().max(1) as f64).sqrt(),
            surroundings: self.scene.static_gaussians.means.iter().map(|p| p.map(f64::from)).collect(),
        }
    }

    /// Positions of Gaussians at the start.
    fn at_rest(&self, rows: &Range<usize>) -> &[[f32; 3]] {
        &self.scene.dynamic_gaussians.means[rows.clone()]
    }

    /// The rotation of some Gaussians since the start, and their centres then and now. Where their places
    /// leave it open, it is that of a Gaussian.
    fn rigid_fit(&self, rows: &Range<usize>, state: &SceneState) -> (DQuat, DVec3, DVec3) {
        let (before, now) = (self.at_rest(rows), &state.q[rows.clone()]);
        let (from, to) = (wide(mean(before)), wide(mean(now)));
        let covariance: DMat3 =
            before.iter().zip(now).map(|(&a, &b)| outer(wide(b) - to, wide(a) - from)).sum();
        let fit = fit_rotation(&covariance);
        let own = || quaternion(&state.rotation[rows.start].map(f64::from)).normalize();
        (if fit.curvature.is_some() { fit.rotation } else { own() }, from, to)
    }

    /// The bodies where they have been found at a time; `cloud` is that of the scene's motion.
    fn poses(
        &self,
        bodies: &[Range<usize>],
        cloud: &GaussianCloud,
        (found, at): (&[Vec<Found>], usize),
    ) -> Vec<Pose> {
        let pose = |(rows, found): (&Range<usize>, &Vec<Found>)| {
            let rows = self.rows_of_cloud(rows);
            let own = &cloud.means[rows.clone()];
            let center = mean(own);
            let square: f32 = own.iter().map(|&p| norm(sub(p, center)).powi(2)).sum();
            let radius = (square / (3 * own.len().max(1)) as f32).sqrt().max(f32::MIN_POSITIVE);
            let center = (wide(center) + found[at].shift).as_vec3().to_array();
            Pose { rows, center, radius }
        };
        bodies.iter().zip(found).map(pose).collect()
    }

    /// A cloud with all bodies where they have been found at a time.
    fn moved(
        &self,
        cloud: &GaussianCloud,
        bodies: &[Range<usize>],
        (found, at): (&[Vec<Found>], usize),
    ) -> GaussianCloud {
        let mut cloud = cloud.clone();
        for (rows, found) in bodies.iter().zip(found) {
            let rows = self.rows_of_cloud(rows);
            let center = mean(&cloud.means[rows.clone()]);
            let body = Pose { rows, center, radius: 1.0 };
            let axis = found[at].turn.to_scaled_axis();
            let [tx, ty, tz] = found[at].shift.to_array();
            (cloud.means, cloud.rotations) = displaced(&cloud, &body, &[tx, ty, tz, axis.x, axis.y, axis.z]);
        }
        cloud
    }

    /// Rows among the Gaussians of a cloud, the static ones of which come first.
    fn rows_of_cloud(&self, rows: &Range<usize>) -> Range<usize> {
        let first = self.scene.static_gaussians.len();
        first + rows.start..first + rows.end
    }
}

impl Found {
    /// Adds the displacement that the views of a time ask for; `weight` is that of a squared difference.
    fn refine(&mut self, normals: &[&Normal], radius: f32, weight: f64) {
        let [tx, ty, tz, rx, ry, rz] = solved(normals, radius, weight);
        self.turn = (exp(DVec3::new(rx, ry, rz)) * self.turn).normalize();
        self.shift += DVec3::new(tx, ty, tz);
        if normals.len() > 1 {
            let half =
                |first: usize| -> Vec<&Normal> { normals.iter().skip(first).step_by(2).copied().collect() };
            let [even, odd] = [0, 1].map(|first| solved(&half(first), radius, weight));
            let square = |i: usize| {
                let unit = if i < 3 { 1.0 } else { f64::from(radius) };
                (0.5 * unit * (even[i] - odd[i])).powi(2)
            };
            self.square_error = (0..6).map(square).sum::<f64>() / 6.0;
        }
    }
}

/// The least-squares displacement of the views of a time; none if it is not determined.
fn solved(normals: &[&Normal], radius: f32, weight: f64) -> Displacement {
    let (mut a, mut b) = (DMatrix::zeros(6, 6), DMatrix::zeros(6, 1));
    for normal in normals {
        for i in 0..6 {
            b[i] += weight * normal.b[i];
            (0..6).for_each(|j| a[(i, j)] += weight * normal.a[i][j]);
        }
    }
    for i in 0..6 {
        let unit = if i < 3 { f64::from(radius) } else { 1.0 };
        a[(i, i)] += (PRIOR_DEVIATION * unit).powi(-2);
    }
    let found = solve_positive(a, &b).filter(|found| found.iter().all(|x| x.is_finite()));
    found.map_or([0.0; 6], |found| std::array::from_fn(|i| found[i]))
}
