//! Generalised Procrustes analysis with outliers: the shared motion of noisy particles.
//!
//! Poses from the shape (the nearest rotation for a rigid motion, least squares for an affine one), the shape
//! as the mean of the samples seen from the poses, and particle weights from their residuals (so that
//! floaters do not pull), in turns. Averaging hundreds of particles takes independent noise away before
//! anything is differentiated; the pose of a sample is fitted to that sample alone, so nothing is smoothed
//! over time. An affine motion is what a law linear in position and velocity does to a body.

use super::pose::{Pose, PoseKind};
use super::shared_motion::SharedMotion;
use crate::thresholds::{MOMENTARY_OUTLIER_MEDIANS, OUTLIER_MEDIANS, TURNS};
use crate::trajectories::Trajectories;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{fit_affine, inverse, nearest_rotation, outer};
use lgs_core::median;

/// Fits poses, shape and weights to trajectories.
pub(crate) fn fit_shared_motion(trajectories: &Trajectories, kind: PoseKind) -> SharedMotion {
    let own_weights = trajectories.particle_weights();
    let middle = trajectories.times.len() / 2;
    let mut motion = SharedMotion {
        kind,
        times: trajectories.grid(),
        poses: Vec::new(),
        deviations: Vec::new(),
        shape: (0..trajectories.len()).map(|j| trajectories.at(middle, j)).collect(),
        weights: normalised(own_weights.clone()),
        residual: 0.0,
    };
    for turn in 0..TURNS {
        // The first turns are rigid in any case: an affine fit needs a shape that is about right.
        let kind = if turn < 2 { PoseKind::Rigid } else { kind };
        turn_with(&mut motion, trajectories, &own_weights, |motion, sample| {
            pose_of(motion, trajectories, sample, &motion.weights, kind)
        });
    }
    motion
}

/// Further turns in which a particle counts less at the samples where it is an outlier. A source model lets
/// parts of an object slip for a while, in hidden places and at the ends of the window above all; whole paths
/// tell less of this than moments do.
pub(crate) fn refine_shared_motion(mut motion: SharedMotion, trajectories: &Trajectories) -> SharedMotion {
    let own_weights = trajectories.particle_weights();
    for _ in 0..TURNS {
        turn_with(&mut motion, trajectories, &own_weights, |motion, sample| {
            let weights = weights_at(motion, trajectories, sample);
            pose_of(motion, trajectories, sample, &weights, motion.kind)
        });
    }
    motion
}

/// One turn of poses, shape and weights.
fn turn_with(
    motion: &mut SharedMotion,
    trajectories: &Trajectories,
    own_weights: &[f64],
    pose: impl Fn(&SharedMotion, usize) -> Pose,
) {
    let centroid: DVec3 = motion.shape.iter().zip(&motion.weights).map(|(&b, &w)| w * b).sum();
    motion.shape.iter_mut().for_each(|b| *b -= centroid);
    motion.poses = (0..motion.times.len()).map(|sample| pose(motion, sample)).collect();
    update_shape(motion, trajectories);
    update_weights(motion, trajectories, own_weights);
}

/// The pose that carries the shape onto a sample.
fn pose_of(
    motion: &SharedMotion,
    trajectories: &Trajectories,
    sample: usize,
    weights: &[f64],
    kind: PoseKind,
) -> Pose {
    let seen: DVec3 = weights.iter().enumerate().map(|(j, &w)| w * trajectories.at(sample, j)).sum();
    let shape: DVec3 = weights.iter().zip(&motion.shape).map(|(&w, &b)| w * b).sum();
    let (mut moment, mut covariance) = (DMat3::ZERO, DMat3::ZERO);
    for (j, (&b, &w)) in motion.shape.iter().zip(weights).enumerate() {
        let (x, b) = (trajectories.at(sample, j) - seen, b - shape);
        moment += outer(w * x, b);
        covariance += outer(w * b, b);
    }
    let rotation = nearest_rotation(&moment);
    let linear = match kind {
        PoseKind::Rigid => rotation,
        PoseKind::Affine => fit_affine(&moment, &covariance, &rotation),
    };
    Pose { linear, shift: seen - linear * shape }
}

/// Weights of the particles at one sample: the less, the farther one is from where the sample's pose has it.
fn weights_at(motion: &SharedMotion, trajectories: &Trajectories, sample: usize) -> Vec<f64> {
    let pose = &motion.poses[sample];
    let residual = |(j, &b): (usize, &DVec3)| trajectories.at(sample, j).distance_squared(pose.apply(b));
    let squared: Vec<f64> = motion.shape.iter().enumerate().map(residual).collect();
    robust_weights(&motion.weights, &squared, MOMENTARY_OUTLIER_MEDIANS)
}

/// The shape as the least squares answer to all samples, given the poses.
fn update_shape(motion: &mut SharedMotion, trajectories: &Trajectories) {
    let gram: DMat3 = motion.poses.iter().map(|pose| pose.linear.transpose() * pose.linear).sum();
    let Some(inverse) = inverse(&gram) else { return };
    for (j, b) in motion.shape.iter_mut().enumerate() {
        let seen = motion.poses.iter().enumerate();
        let sum: DVec3 =
            seen.map(|(s, pose)| pose.linear.transpose() * (trajectories.at(s, j) - pose.shift)).sum();
        *b = inverse * sum;
    }
}

/// Particle weights: their own, times a bounded-influence factor of their residual.
fn update_weights(motion: &mut SharedMotion, trajectories: &Trajectories, own_weights: &[f64]) {
    let coordinates = 3.0 * motion.poses.len() as f64;
    let squared: Vec<f64> = (motion.shape.iter().enumerate())
        .map(|(j, &b)| {
            let poses = motion.poses.iter().enumerate();
            poses.map(|(s, p)| trajectories.at(s, j).distance_squared(p.apply(b))).sum::<f64>() / coordinates
        })
        .collect();
    motion.weights = robust_weights(own_weights, &squared, OUTLIER_MEDIANS);
    motion.residual = motion.weights.iter().zip(&squared).map(|(w, r)| w * r).sum::<f64>().sqrt();
}

/// Weights that fall with squared residuals; at `medians` times the median residual a weight is a quarter.
fn robust_weights(weights: &[f64], squared: &[f64], medians: f64) -> Vec<f64> {
    let typical = median(squared.iter().copied()).unwrap_or(0.0).max(1e-24);
    let factor = |r: f64| (1.0 + r / (medians * medians * typical)).powi(-2);
    normalised(weights.iter().zip(squared).map(|(&w, &r)| w * factor(r)).collect())
}

/// Weights with sum 1; equal ones if they have none.
fn normalised(mut weights: Vec<f64>) -> Vec<f64> {
    let (sum, count) = (weights.iter().sum::<f64>(), weights.len() as f64);
    let has_sum = sum > 0.0 && sum.is_finite();
    weights.iter_mut().for_each(|w| *w = if has_sum { *w / sum } else { 1.0 / count });
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::curve::Order;
    use crate::motion::pose::angular_velocity;
    use crate::motion::smooth_motion::SmoothMotion;
    use crate::testing::tumbling;

    #[test]
    fn a_rigid_motion_is_found_in_noise_and_floaters_do_not_pull() {
        let mut trajectories = tumbling(0.004);
        for (s, row) in trajectories.positions.iter_mut().enumerate() {
            for particle in row.iter_mut().take(20) {
                particle[1] += 0.05 * s as f32;
            }
        }
        let motion = fit_shared_motion(&trajectories, PoseKind::Rigid);
        assert!((motion.residual - 0.004).abs() < 4e-4, "{}", motion.residual);
        let smooth = SmoothMotion::new(motion, 2..=10);
        let velocity = smooth.at(0.7, Order::First).shift;
        assert!((velocity.z + 1.4).abs() < 0.02 && velocity.y.abs() < 0.02, "{velocity:?}");
        let pose = smooth.at(0.3, Order::Value);
        let spin = angular_velocity(&pose.linear, &smooth.at(0.3, Order::First).linear);
        assert!((spin.x - 2.0).abs() < 0.05 && (spin.z + 1.0).abs() < 0.05, "{spin:?}");
    }

    #[test]
    fn a_part_that_slips_for_a_while_does_not_pull_then() {
        let truth = tumbling(0.0);
        let mut slipping = truth.clone();
        for (s, row) in slipping.positions.iter_mut().enumerate().skip(60) {
            for (particle, now) in row.iter_mut().take(120).zip(&truth.positions[s - 6]) {
                *particle = *now;
            }
        }
        let error = |motion: &SharedMotion| {
            let ends = (60..76).flat_map(|s| (150..300).map(move |j| (s, j)));
            let squared = |(s, j)| truth.at(s, j).distance_squared(motion.poses[s].apply(motion.shape[j]));
            (ends.map(squared).sum::<f64>() / (16.0 * 150.0)).sqrt()
        };
        let plain = fit_shared_motion(&slipping, PoseKind::Rigid);
        let refined = refine_shared_motion(plain.clone(), &slipping);
        assert!(error(&refined) < 0.2 * error(&plain), "{} {}", error(&refined), error(&plain));
    }
}
