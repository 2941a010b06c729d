//! Poses of bodies at the times of the frames, as the images show them: each is the scene's motion of
//! the body with a displacement that the views of its time ask for.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};
use lgs_core::GaussianCloud;
use lgs_core::geometry::{components, fit_rotation, narrow, nearest_rotation, outer, quaternion, wide};
use lgs_core::linear::{norm, quat_mul, sub};
use lgs_data::dataset::Frame;
use lgs_distill::BodyPoses;
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion, SceneState, mapped_shape};

use super::displacement::Pose;
use super::image_displacement::{Found, deviations};
use super::initial_pose::mean;

/// The motion of a scene at some times, and its bodies as images show them there.
pub(super) struct ImagePoses<'a> {
    scene: &'a LagrangianScene,
    times: &'a [f32],
    states: Vec<SceneState>,
}

/// A body of a scene.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Its rows among the dynamic Gaussians.
    pub(super) rows: Range<usize>,
    /// Whether its shape changes.
    pub(super) deforms: bool,
}

impl<'a> ImagePoses<'a> {
    /// The motion of a scene at ascending times, the first of which is its start.
    pub(super) fn new(scene: &'a LagrangianScene, times: &'a [f32]) -> Self {
        let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
        Self { scene, times, states: times.iter().map(|&time| motion.state_at(time)).collect() }
    }

    /// The Gaussians by the scene's motion, by time.
    pub(super) fn clouds(&self) -> Vec<GaussianCloud> {
        let at = |(state, &time)| self.scene.cloud_at(state, time);
        self.states.iter().zip(self.times).map(at).collect()
    }

    /// Index of a frame's time.
    pub(super) fn time_of(&self, frame: &Frame) -> usize {
        self.times.partition_point(|&time| time < frame.time.max(0.0))
    }

    /// Root mean square over times and Gaussians of what a body's poses leave of the scene's own motion of
    /// it, world units.
    pub(super) fn left_of_motion(&self, body: &Part) -> f64 {
        let left = |state: &SceneState| {
            let (linear, from, to) = self.fit(&body.rows, state, body.deforms);
            let pairs = self.at_rest(&body.rows).iter().zip(&state.q[body.rows.clone()]);
            pairs.map(|(&a, &b)| (linear * (wide(a) - from)).distance_squared(wide(b) - to)).sum::<f64>()
        };
        let squared: f64 = self.states.iter().map(left).sum();
        (squared / (body.rows.len() * self.states.len()).max(1) as f64).sqrt()
    }

    /// The points of a body about their centre, and its poses by the scene's own motion.
    pub(super) fn of_body_in_scene(&self, body: &Part) -> BodyPoses {
        self.of_body(body, &vec![Found::STILL; self.times.len()])
    }

    /// The same with its poses as the images show them. Views that disagree
    /// tell of errors of the Gaussians, which are much the same at neighbouring times.
    pub(super) fn of_body(&self, body: &Part, found: &[Found]) -> BodyPoses {
        let points = self.at_rest(&body.rows);
        let center = wide(mean(points));
        let pose = |(state, found): (&SceneState, &Found)| {
            let (linear, _, at) = self.fit(&body.rows, state, body.deforms);
            (found.linear * linear, at + found.shift)
        };
        let square_error = found.iter().map(|found| found.square_error).sum::<f64>();
        BodyPoses {
            times: self.times.iter().map(|&time| f64::from(time)).collect(),
            poses: self.states.iter().zip(found).map(pose).collect(),
            deviations: deviations(found),
            deforms: body.deforms,
            shape: points.iter().map(|&p| wide(p) - center).collect(),
            slow_error: (square_error / found.len().max(1) as f64).sqrt(),
            surroundings: self.scene.static_gaussians.means.iter().map(|p| p.map(f64::from)).collect(),
            hits: Vec::new(),
        }
    }

    /// The same of several bodies.
    pub(super) fn of_bodies(&self, bodies: &[Part], found: &[&Vec<Found>]) -> Vec<BodyPoses> {
        bodies.iter().zip(found).map(|(body, found)| self.of_body(body, found)).collect()
    }

    /// Positions of Gaussians at the start.
    fn at_rest(&self, rows: &Range<usize>) -> &[[f32; 3]] {
        &self.scene.dynamic_gaussians.means[rows.clone()]
    }

    /// The linear map of some Gaussians since the start, and their centres then and now. Where their places
    /// leave its rotation open, it is that of a Gaussian.
    fn fit(&self, rows: &Range<usize>, state: &SceneState, deforms: bool) -> (DMat3, DVec3, DVec3) {
        let (before, now) = (self.at_rest(rows), &state.q[rows.clone()]);
        let (from, to) = (wide(mean(before)), wide(mean(now)));
        if deforms {
            return (self.scene.linear_map(rows, state), from, to);
        }
        let pairs = before.iter().zip(now);
        let moment: DMat3 = pairs.map(|(&a, &b)| outer(wide(b) - to, wide(a) - from)).sum();
        let fit = fit_rotation(&moment);
        let own = || quaternion(&state.rotation[rows.start].map(f64::from)).normalize();
        (DMat3::from_quat(if fit.curvature.is_some() { fit.rotation } else { own() }), from, to)
    }

    /// The colour behind all Gaussians.
    pub(super) fn background(&self) -> [f32; 3] {
        self.scene.background
    }

    /// The bodies where they have been found at a time; `cloud` is that of the scene's motion.
    pub(super) fn poses(
        &self,
        bodies: &[Part],
        cloud: &GaussianCloud,
        (found, at): (&[Vec<Found>], usize),
    ) -> Vec<Pose> {
        let pose = |(body, found): (&Part, &Vec<Found>)| {
            let rows = self.rows_of_cloud(&body.rows);
            let own = &cloud.means[rows.clone()];
            let center = mean(own);
            let square: f32 = own.iter().map(|&p| norm(sub(p, center)).powi(2)).sum();
            let radius = (square / (3 * own.len().max(1)) as f32).sqrt().max(f32::MIN_POSITIVE);
            let center = narrow(wide(center) + found[at].shift);
            Pose { rows, center, radius, deforms: body.deforms }
        };
        bodies.iter().zip(found).map(pose).collect()
    }

    /// A cloud with all bodies where they have been found at a time.
    pub(super) fn moved(
        &self,
        cloud: &GaussianCloud,
        bodies: &[Part],
        (found, at): (&[Vec<Found>], usize),
    ) -> GaussianCloud {
        let mut cloud = cloud.clone();
        for (body, found) in bodies.iter().zip(found) {
            let Found { linear, shift, .. } = found[at];
            let rows = self.rows_of_cloud(&body.rows);
            let center = wide(mean(&cloud.means[rows.clone()]));
            let turn = components(DQuat::from_mat3(&nearest_rotation(&linear))).map(|c| c as f32);
            cloud.turn_harmonics(rows.clone(), turn);
            for row in rows {
                cloud.means[row] = narrow(linear * (wide(cloud.means[row]) - center) + center + shift);
                (cloud.rotations[row], cloud.log_scales[row]) = if body.deforms {
                    mapped_shape(&linear, cloud.rotations[row], cloud.log_scales[row])
                } else {
                    (quat_mul(turn, cloud.rotations[row]), cloud.log_scales[row])
                };
            }
        }
        cloud
    }

    /// Rows among the Gaussians of a cloud, the static ones of which come first.
    fn rows_of_cloud(&self, rows: &Range<usize>) -> Range<usize> {
        let first = self.scene.static_gaussians.len();
        first + rows.start..first + rows.end
    }
}
