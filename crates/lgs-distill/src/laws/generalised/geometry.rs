//! Points of a moving body by linear least squares: pivots, centres of mass, radii of rolling.

use crate::motion::pose::Pose;
use crate::thresholds::UNDETERMINED_DIRECTION;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// The point of the body that moves along a smooth path while the body turns about it: `c_k + R_k r` is a
/// polynomial in time with so many coefficients. Particles lie where a body is seen, and their centre is not
/// that of its mass.
pub(super) fn center_of_mass(poses: &[Pose], times: &[f64], coefficients: usize) -> Option<DVec3> {
    let duration = times[times.len() - 1];
    let powers = |k: usize| {
        let time = 2.0 * times[k] / duration - 1.0;
        (0..coefficients).map(|power| time.powi(power as i32)).collect()
    };
    let [r] = body_points(poses, powers)?.1[..] else { return None };
    Some(-r)
}

/// Least squares of `c_k = Σ_i a_i f_i(k) + R_k r`: the vectors `a_i`, and `r`. What the poses do not
/// determine is zero.
pub(super) fn body_points(poses: &[Pose], f: impl Fn(usize) -> Vec<f64>) -> Option<(Vec<DVec3>, Vec<DVec3>)> {
    let columns = 3 * f(0).len();
    let mut rows = DMatrix::zeros(3 * poses.len(), columns + 3);
    let mut right = DVector::zeros(3 * poses.len());
    for (k, pose) in poses.iter().enumerate() {
        for i in 0..3 {
            f(k).iter().enumerate().for_each(|(at, value)| rows[(3 * k + i, 3 * at + i)] = *value);
            (0..3).for_each(|j| rows[(3 * k + i, columns + j)] = pose.linear.col(j)[i]);
            right[3 * k + i] = pose.shift[i];
        }
    }
    let svd = rows.svd(true, true);
    let found = svd.solve(&right, UNDETERMINED_DIRECTION * svd.singular_values.max()).ok()?;
    let vectors: Vec<DVec3> = found.as_slice().chunks_exact(3).map(DVec3::from_slice).collect();
    let (a, r) = vectors.split_at(columns / 3);
    vectors.iter().all(|v| v.is_finite()).then(|| (a.to_vec(), r.to_vec()))
}

/// A fixed point and where it is in the body: `c_k = p + R_k r`. What the rotations do not determine stays at
/// the mean centre.
pub(super) fn pivot(poses: &[Pose]) -> Option<(DVec3, DVec3)> {
    let mean = poses.iter().map(|pose| pose.shift).sum::<DVec3>() / poses.len() as f64;
    let about_mean: Vec<Pose> = poses.iter().map(|pose| Pose { shift: pose.shift - mean, ..*pose }).collect();
    let (points, arms) = body_points(&about_mean, |_| vec![1.0])?;
    Some((mean + points[0], arms[0]))
}

/// The point that two bodies have in common, in the shape axes of each: `c_k + R_k a = d_k + S_k b`. What
/// their rotations do not determine is as small as it can be.
pub(super) fn joint(first: &[Pose], second: &[Pose]) -> Option<(DVec3, DVec3)> {
    let mut rows = DMatrix::zeros(3 * first.len(), 6);
    let mut right = DVector::zeros(3 * first.len());
    for (k, (a, b)) in first.iter().zip(second).enumerate() {
        let apart = b.shift - a.shift;
        for i in 0..3 {
            (0..3).for_each(|j| rows[(3 * k + i, j)] = a.linear.col(j)[i]);
            (0..3).for_each(|j| rows[(3 * k + i, 3 + j)] = -b.linear.col(j)[i]);
            right[3 * k + i] = apart[i];
        }
    }
    let svd = rows.svd(true, true);
    let found = svd.solve(&right, UNDETERMINED_DIRECTION * svd.singular_values.max()).ok()?;
    let [a, b] = [0, 3].map(|at| DVec3::from_slice(&found.as_slice()[at..]));
    (a.is_finite() && b.is_finite()).then_some((a, b))
}
