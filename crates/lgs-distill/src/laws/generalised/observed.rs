//! The poses of a rigid body over time, with their noise.

use crate::math::{principal_axes, trace};
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use glam::{DMat3, DQuat, DVec3};
use lgs_mechanics::coordinates::{Coordinates, Inertia, InertiaForm};
use lgs_mechanics::fit::Track;
use lgs_mechanics::noise::Noise;

/// Poses of a body, times counted from the first sample.
pub(super) struct ObservedPoses {
    pub(super) times: Vec<f64>,
    pub(super) poses: Vec<Pose>,
    /// Principal axes and moments of the particles' second moments.
    pub(super) inertia: Inertia,
    /// The same poses in rigid coordinates.
    pub(super) track: Track,
    rigid: Coordinates,
    /// Root mean square distance of the particles from the centre.
    radius: f64,
    resolution: f64,
}

impl ObservedPoses {
    /// The poses of a shared motion. `resolution` is a length that the source of the tracks does not resolve:
    /// no pose is known better.
    pub(super) fn new(motion: &SharedMotion, resolution: f64) -> Self {
        let inertia = inertia(&motion.covariance());
        let rigid = Coordinates::Rigid(inertia);
        let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
        let x = configurations(&motion.poses, &inertia);
        let mut track = Track::new(&rigid, &times, &x);
        let radius = trace(&motion.covariance()).sqrt();
        coarsen(&mut track.noise[..3], resolution / radius.max(f64::MIN_POSITIVE));
        coarsen(&mut track.noise[3..], resolution);
        Self { times, poses: motion.poses.clone(), inertia, track, rigid, radius, resolution }
    }

    /// χ² of other poses at the same times, whitened.
    pub(super) fn chi_square(&self, poses: &[Pose]) -> f64 {
        let predicted = configurations(poses, &self.inertia);
        let pairs = self.track.x.iter().zip(&predicted);
        let of_sample = |(observed, predicted): (&Vec<f64>, &Vec<f64>)| {
            let difference = self.rigid.difference(observed, predicted);
            let whitened = difference.iter().zip(&self.track.noise).map(|(d, n)| (d * n.weight()).powi(2));
            whitened.sum::<f64>()
        };
        pairs.map(of_sample).sum()
    }

    /// The track of a joint, no better known than the poses are.
    pub(super) fn along(&self, joint: &Coordinates, mut track: Track) -> Track {
        let radius = if matches!(joint, Coordinates::Hinge(_)) { self.radius } else { 1.0 };
        coarsen(&mut track.noise, self.resolution / radius.max(f64::MIN_POSITIVE));
        track
    }
}

/// Adds a standard deviation to a noise.
fn coarsen(noise: &mut [Noise], resolution: f64) {
    noise.iter_mut().for_each(|noise| noise.deviation = noise.deviation.hypot(resolution));
}

/// Quaternions of the principal axes, and centres.
fn configurations(poses: &[Pose], inertia: &Inertia) -> Vec<Vec<f64>> {
    let [w, x, y, z] = inertia.frame;
    let frame = DQuat::from_xyzw(x, y, z, w);
    let mut last = DQuat::IDENTITY;
    let one = |pose: &Pose| {
        let turn = DQuat::from_mat3(&pose.linear) * frame;
        // A quaternion and its negative are the same rotation; paths of them must not jump.
        last = if turn.dot(last) < 0.0 { -turn } else { turn };
        [vec![last.w, last.x, last.y, last.z], pose.shift.to_array().to_vec()].concat()
    };
    poses.iter().map(one).collect()
}

/// Inertia of particles with these second moments about their centre.
pub(super) fn inertia(covariance: &DMat3) -> Inertia {
    let [(first, x), (second, y), (third, _)] = principal_axes(covariance);
    let frame = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize();
    let sum = first + second + third;
    // A line has no moment about itself, and a plane none that the others do not give.
    let least = LEAST_MOMENT * sum;
    Inertia {
        form: InertiaForm::Prior,
        frame: [frame.w, frame.x, frame.y, frame.z],
        moments: [first, second, third].map(|variance| (sum - variance.max(0.0)).max(least)),
    }
}

/// The smallest moment of inertia, as a fraction of the trace of the second moments: that of a needle thirty
/// times as long as it is thick.
const LEAST_MOMENT: f64 = 1e-3;

/// The mean of poses: the rotation nearest to the mean of their matrices, and the mean of their shifts.
pub(super) fn mean_pose(poses: &[Pose]) -> Pose {
    let n = poses.len().max(1) as f64;
    let linear = poses.iter().map(|pose| pose.linear).sum::<DMat3>() * n.recip();
    let shift = poses.iter().map(|pose| pose.shift).sum::<DVec3>() / n;
    Pose { linear: crate::math::nearest_rotation(&linear), shift }
}
