//! Rotations about one fixed axis.

use crate::motion::pose::Pose;
use crate::thresholds::AXIS_ROUNDS;
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{
    cross_matrix, nearest_rotation, rotation_by, rotation_vector, scalar, solve_positive,
};
use nalgebra::{DMatrix, Matrix3};
use std::f64::consts::TAU;

/// An axis in world axes, and the angle about it at each sample: `R_k = exp(θ_k a) B`.
pub(super) struct Turning {
    pub(super) axis: DVec3,
    /// Radians, without jumps at full turns.
    pub(super) angles: Vec<f64>,
}

impl Turning {
    /// The axis that fits rotations best, by least squares of their rotation vectors.
    pub(super) fn about_one_axis(poses: &[Pose]) -> Option<Self> {
        let mut axis = first_axis(poses)?;
        let mut base = poses[0].linear;
        let mut angles = angles(poses, axis, &base);
        for _ in 0..AXIS_ROUNDS {
            (axis, base) = refined(poses, axis, &base, &angles)?;
            angles = self::angles(poses, axis, &base);
        }
        Some(Self { axis, angles })
    }

    /// The angles about a known axis, from the first pose on.
    pub(super) fn about(axis: DVec3, poses: &[Pose]) -> Self {
        Self { axis, angles: angles(poses, axis, &poses[0].linear) }
    }

    /// Mean square of the angles about their mean.
    pub(super) fn mean_square(&self) -> f64 {
        let n = self.angles.len().max(1) as f64;
        let mean = self.angles.iter().sum::<f64>() / n;
        self.angles.iter().map(|angle| (angle - mean).powi(2)).sum::<f64>() / n
    }
}

/// The direction of the body whose images differ least.
fn first_axis(poses: &[Pose]) -> Option<DVec3> {
    let mean = poses.iter().map(|pose| pose.linear).sum::<DMat3>() * (poses.len() as f64).recip();
    let svd = Matrix3::from_column_slice(&mean.to_cols_array()).svd(true, false);
    let axis = DVec3::from_slice(svd.u?.column(svd.singular_values.imax()).as_slice());
    (axis.is_finite() && axis.length() > 0.5).then(|| axis.normalize())
}

/// Angles about an axis from a base: that of each pose, in the turn to which the steps from pose to pose add
/// up.
fn angles(poses: &[Pose], axis: DVec3, base: &DMat3) -> Vec<f64> {
    let twist = |rotation: DMat3| {
        let q = DQuat::from_mat3(&rotation);
        2.0 * DVec3::new(q.x, q.y, q.z).dot(axis).atan2(q.w)
    };
    let mut near = 0.0;
    let mut last = *base;
    let mut angles = Vec::with_capacity(poses.len());
    for pose in poses {
        let step = rotation_vector(DQuat::from_mat3(&(pose.linear * last.transpose()))).dot(axis);
        let angle = twist(pose.linear * base.transpose());
        near = angle + TAU * ((near + step - angle) / TAU).round();
        last = pose.linear;
        angles.push(near);
    }
    angles
}

/// One step of Gauss–Newton for axis and base: a change δ of the axis turns the pose by
/// `sin θ δ + (1 − cos θ) a × δ`, one ε of the base by `exp(θ a) ε`; angles are free.
fn refined(poses: &[Pose], axis: DVec3, base: &DMat3, angles: &[f64]) -> Option<(DVec3, DMat3)> {
    let (first, second) = axis.any_orthonormal_pair();
    let mut gram = DMatrix::<f64>::zeros(5, 5);
    let mut right = DMatrix::<f64>::zeros(5, 1);
    for (pose, &angle) in poses.iter().zip(angles) {
        let turn = rotation_by(axis * angle);
        let left = rotation_vector(DQuat::from_mat3(&(pose.linear * (turn * *base).transpose())));
        let (sine, cosine) = angle.sin_cos();
        let by_axis = scalar(sine) + cross_matrix(axis) * (1.0 - cosine);
        let columns = [by_axis * first, by_axis * second, turn.x_axis, turn.y_axis, turn.z_axis];
        for direction in [first, second] {
            let row = DMatrix::from_fn(1, 5, |_, column| columns[column].dot(direction));
            gram += row.transpose() * &row;
            right += row.transpose() * left.dot(direction);
        }
    }
    // A turn of the base about the axis is an angle, and none of them.
    let ridge = f64::EPSILON.sqrt() * gram.trace();
    (0..5).for_each(|i| gram[(i, i)] += ridge);
    let found = solve_positive(gram, &right)?;
    let axis = (axis + first * found[0] + second * found[1]).try_normalize()?;
    let change = rotation_by(DVec3::new(found[2], found[3], found[4]));
    Some((axis, nearest_rotation(&(change * *base))))
}
