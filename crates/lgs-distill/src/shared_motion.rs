//! The motion that all particles of an object share: one pose per sample and one averaged shape.
//!
//! Generalised Procrustes analysis: poses from the shape (Kabsch for a rigid motion, least squares for an
//! affine one), the shape as the mean of the samples seen from the poses, and particle weights from how far
//! each strays (so that floaters do not pull), in turns. Averaging hundreds of particles takes independent
//! noise away before anything is differentiated; the pose of a sample is fitted to that sample alone, so
//! nothing is smoothed over time. An affine motion is what a law linear in position and velocity does to a
//! body.

use crate::Trajectories;
use crate::chebyshev::Curve;
use crate::dense::{
    M3, V3, add, mat_t_vec, mat_vec, median, nearest_rotation, norm2, scale, solve_positive, sub,
    symmetric_eigen,
};
use crate::pose::{Pose, PoseKind, SmoothPose};

/// Turns of poses, shape and weights; the shape settles in two or three.
const TURNS: usize = 6;
/// Weight of a particle whose residual is this many medians is a quarter; beyond, it falls with the fourth
/// power.
const OUTLIER_MEDIANS: f64 = 3.0;
/// Residual of a particle at one sample, in medians over the particles, at which its weight there is a
/// quarter.
const STRAY_MEDIANS: f64 = 1.0;
/// Ridge of an affine pose towards the rigid one, as a part of the shape's largest variance: thin directions
/// say nothing.
const AFFINE_RIDGE: f64 = 1e-6;

/// An object's shared motion.
#[derive(Clone, Debug)]
pub(crate) struct SharedMotion {
    /// Which poses.
    pub(crate) kind: PoseKind,
    /// Sample times.
    pub(crate) times: Vec<f64>,
    /// One pose per sample.
    pub(crate) poses: Vec<Pose>,
    /// `[n]` particles in shape axes; the weighted centroid is the origin.
    pub(crate) shape: Vec<V3>,
    /// `[n]` final weights, sum 1.
    pub(crate) weights: Vec<f64>,
    /// Weighted root mean square residual per coordinate.
    pub(crate) residual: f64,
}

impl SharedMotion {
    /// Fits poses and shape; `weights` are the particles' own (opacity, size), all 1 if absent.
    pub(crate) fn fit(trajectories: &Trajectories, weights: Option<&[f32]>, kind: PoseKind) -> Self {
        let n = trajectories.len();
        let own = own_weights(weights, n);
        let middle = trajectories.times.len() / 2;
        let mut motion = Self {
            kind,
            times: trajectories.grid(),
            poses: Vec::new(),
            shape: (0..n).map(|j| trajectories.at(middle, j)).collect(),
            weights: normalised(&own),
            residual: 0.0,
        };
        for turn in 0..TURNS {
            // The first turns are rigid in any case: an affine fit needs a shape that is about right.
            let affine = kind == PoseKind::Affine && turn >= 2;
            motion.turn(trajectories, &own, |motion, sample| {
                motion.pose_of(trajectories, sample, &motion.weights, affine)
            });
        }
        motion
    }

    /// Further turns in which a particle counts less at the samples where it strays. A source model lets
    /// parts of an object slip for a while, in hidden places and at the ends of the window above all; whole
    /// paths tell less of this than moments do.
    pub(crate) fn refined(mut self, trajectories: &Trajectories, weights: Option<&[f32]>) -> Self {
        let own = own_weights(weights, trajectories.len());
        let affine = self.kind == PoseKind::Affine;
        for _ in 0..TURNS {
            self.turn(trajectories, &own, |motion, sample| {
                motion.pose_of(trajectories, sample, &motion.weights_at(trajectories, sample), affine)
            });
        }
        self
    }

    /// One turn of poses, shape and weights.
    fn turn(&mut self, trajectories: &Trajectories, own: &[f64], pose: impl Fn(&Self, usize) -> Pose) {
        self.center_shape();
        self.poses = (0..self.times.len()).map(|sample| pose(self, sample)).collect();
        self.update_shape(trajectories);
        self.update_weights(trajectories, own);
    }

    /// Moves the weighted centroid of the shape to the origin.
    fn center_shape(&mut self) {
        let centroid =
            self.shape.iter().zip(&self.weights).fold([0.0; 3], |sum, (b, &w)| add(sum, scale(*b, w)));
        self.shape.iter_mut().for_each(|b| *b = sub(*b, centroid));
    }

    /// The pose that carries the shape onto a sample.
    fn pose_of(&self, trajectories: &Trajectories, sample: usize, weights: &[f64], affine: bool) -> Pose {
        let mean = |row: &dyn Fn(usize) -> V3| {
            weights.iter().enumerate().fold([0.0; 3], |sum, (j, &w)| add(sum, scale(row(j), w)))
        };
        let (seen, shape) = (mean(&|j| trajectories.at(sample, j)), mean(&|j| self.shape[j]));
        let mut moment = [[0.0; 3]; 3];
        let mut covariance = [[0.0; 3]; 3];
        for (j, (b, &w)) in self.shape.iter().zip(weights).enumerate() {
            let (x, b) = (sub(trajectories.at(sample, j), seen), sub(*b, shape));
            for i in 0..3 {
                for k in 0..3 {
                    moment[i][k] += w * x[i] * b[k];
                    covariance[i][k] += w * b[i] * b[k];
                }
            }
        }
        let rotation = nearest_rotation(&moment);
        let linear = if affine { affine_from(&moment, covariance, &rotation) } else { rotation };
        Pose { linear, shift: sub(seen, mat_vec(&linear, shape)) }
    }

    /// Weights of the particles at one sample: the less, the farther one is from where the sample's pose has
    /// it.
    fn weights_at(&self, trajectories: &Trajectories, sample: usize) -> Vec<f64> {
        let pose = &self.poses[sample];
        let squared: Vec<f64> = (self.shape.iter().enumerate())
            .map(|(j, &b)| norm2(sub(trajectories.at(sample, j), pose.apply(b))))
            .collect();
        let typical = median(squared.clone()).max(1e-24);
        let factor = |r: f64| (1.0 + r / (STRAY_MEDIANS * STRAY_MEDIANS * typical)).powi(-2);
        normalised(&self.weights.iter().zip(&squared).map(|(&w, &r)| w * factor(r)).collect::<Vec<_>>())
    }

    /// Weighted covariance of the shape.
    pub(crate) fn covariance(&self) -> M3 {
        let mut sum = [[0.0; 3]; 3];
        for (b, &w) in self.shape.iter().zip(&self.weights) {
            for (row, x) in sum.iter_mut().zip(b) {
                for (entry, y) in row.iter_mut().zip(b) {
                    *entry += w * x * y;
                }
            }
        }
        sum
    }

    /// The shape as the least squares answer to all samples, given the poses.
    fn update_shape(&mut self, trajectories: &Trajectories) {
        let mut gram = [[0.0; 3]; 3];
        for pose in &self.poses {
            for (i, row) in gram.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += (0..3).map(|k| pose.linear[k][i] * pose.linear[k][j]).sum::<f64>();
                }
            }
        }
        let Some(inverse) = crate::dense::inverse3(&gram) else { return };
        for j in 0..self.shape.len() {
            let mut sum = [0.0; 3];
            for (s, pose) in self.poses.iter().enumerate() {
                sum = add(sum, mat_t_vec(&pose.linear, sub(trajectories.at(s, j), pose.shift)));
            }
            self.shape[j] = mat_vec(&inverse, sum);
        }
    }

    /// Particle weights: their own, times a bounded-influence factor of their residual.
    fn update_weights(&mut self, trajectories: &Trajectories, own: &[f64]) {
        let samples = self.poses.len() as f64;
        let squared: Vec<f64> = (0..self.shape.len())
            .map(|j| {
                let sum: f64 = self
                    .poses
                    .iter()
                    .enumerate()
                    .map(|(s, p)| norm2(sub(trajectories.at(s, j), p.apply(self.shape[j]))))
                    .sum();
                sum / (3.0 * samples)
            })
            .collect();
        let typical = median(squared.clone()).max(1e-24);
        let factor = |r: f64| (1.0 + r / (OUTLIER_MEDIANS * OUTLIER_MEDIANS * typical)).powi(-2);
        self.weights =
            normalised(&own.iter().zip(&squared).map(|(&w, &r)| w * factor(r)).collect::<Vec<_>>());
        self.residual = self.weights.iter().zip(&squared).map(|(w, r)| w * r).sum::<f64>().sqrt();
    }

    /// Points (and their equal weights are 1/6) whose mean square under any affine error equals that of all
    /// particles: `±√3·σ_i` along the principal axes of the shape.
    pub(crate) fn sigma_points(&self) -> Vec<V3> {
        let (variances, axes) = symmetric_eigen(self.covariance());
        let mut points = Vec::with_capacity(6);
        for (variance, axis) in variances.iter().zip(axes) {
            let reach = (3.0 * variance.max(0.0)).sqrt();
            points.push(scale(axis, reach));
            points.push(scale(axis, -reach));
        }
        points
    }

    /// The poses as smooth functions of time, and the degree.
    pub(crate) fn smooth(&self, degrees: std::ops::RangeInclusive<usize>) -> (SmoothPose, usize) {
        let covariance = self.covariance();
        let spread: [f64; 3] = std::array::from_fn(|i| covariance[i][i].sqrt().max(1e-12));
        let emphasis: Vec<f64> = (0..12).map(|i| if i < 9 { spread[i % 3] } else { 1.0 }).collect();
        let values: Vec<f64> = self.poses.iter().flat_map(Pose::entries).collect();
        let (curve, degree) = Curve::fit_by_cross_validation(&self.times, &values, &emphasis, degrees);
        (SmoothPose { curve }, degree)
    }

    /// The same motion seen in a part of the window.
    pub(crate) fn window(&self, range: std::ops::Range<usize>) -> Self {
        Self { times: self.times[range.clone()].to_vec(), poses: self.poses[range].to_vec(), ..self.clone() }
    }

    /// Root mean square over samples and shape of the displacement from the first sample.
    pub(crate) fn rms_displacement(&self) -> f64 {
        let points = self.sigma_points();
        let mut sum = 0.0;
        for pose in &self.poses {
            sum += points.iter().map(|&b| norm2(sub(pose.apply(b), self.poses[0].apply(b)))).sum::<f64>();
        }
        (sum / (points.len() * self.poses.len()) as f64).sqrt()
    }
}

/// Least squares `linear` of `moment = linear · covariance`, drawn to the rotation where the shape is thin.
fn affine_from(moment: &M3, mut covariance: M3, rotation: &M3) -> M3 {
    let ridge = AFFINE_RIDGE * (covariance[0][0] + covariance[1][1] + covariance[2][2]) + 1e-300;
    let mut rhs = [0.0; 9];
    for i in 0..3 {
        covariance[i][i] += ridge;
        for k in 0..3 {
            rhs[3 * k + i] = moment[i][k] + ridge * rotation[i][k];
        }
    }
    let mut gram: Vec<f64> = covariance.concat();
    if !solve_positive(&mut gram, &mut rhs, 3, 3) {
        return *rotation;
    }
    std::array::from_fn(|i| std::array::from_fn(|k| rhs[3 * k + i]))
}

/// The particles' own weights, all 1 if absent.
fn own_weights(weights: Option<&[f32]>, particles: usize) -> Vec<f64> {
    weights.map_or_else(
        || vec![1.0; particles],
        |weights| weights.iter().map(|&w| f64::from(w).max(0.0)).collect(),
    )
}

/// Weights with sum 1; equal ones if they have none.
fn normalised(weights: &[f64]) -> Vec<f64> {
    let sum: f64 = weights.iter().sum();
    if sum > 0.0 && sum.is_finite() {
        weights.iter().map(|w| w / sum).collect()
    } else {
        vec![1.0 / weights.len() as f64; weights.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chebyshev::Order;
    use crate::dense::{narrow, rotation_of_vector};
    use crate::pose::angular_velocity;
    use crate::testing::{block, noisy};

    fn tumbling(noise: f32) -> Trajectories {
        let body = block([0.3, 0.2, 0.1], 300, 5);
        let times: Vec<f32> = (0..76).map(|i| 0.01 * i as f32).collect();
        let positions = times
            .iter()
            .map(|&t| {
                let t = f64::from(t);
                let pose =
                    Pose { linear: rotation_of_vector([2.0 * t, 0.5 * t, -t]), shift: [t, 0.0, 1.0 - t * t] };
                body.iter().map(|&b| narrow(pose.apply(b))).collect()
            })
            .collect();
        noisy(&Trajectories { times, positions }, noise, 3)
    }

    #[test]
    fn a_rigid_motion_is_found_in_noise_and_floaters_do_not_pull() {
        let mut trajectories = tumbling(0.004);
        for (s, row) in trajectories.positions.iter_mut().enumerate() {
            for particle in row.iter_mut().take(20) {
                particle[1] += 0.05 * s as f32;
            }
        }
        let motion = SharedMotion::fit(&trajectories, None, PoseKind::Rigid);
        assert!((motion.residual - 0.004).abs() < 4e-4, "{}", motion.residual);
        let (smooth, _) = motion.smooth(2..=10);
        let velocity = sub(smooth.at(0.7, Order::First).apply([0.0; 3]), [0.0; 3]);
        assert!((velocity[2] + 1.4).abs() < 0.02 && velocity[1].abs() < 0.02, "{velocity:?}");
        let pose = smooth.at(0.3, Order::Value);
        let spin = angular_velocity(&pose.linear, &smooth.at(0.3, Order::First).linear);
        assert!((spin[0] - 2.0).abs() < 0.05 && (spin[2] + 1.0).abs() < 0.05, "{spin:?}");
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
            let sum: f64 =
                ends.map(|(s, j)| norm2(sub(motion.poses[s].apply(motion.shape[j]), truth.at(s, j)))).sum();
            (sum / (16.0 * 150.0)).sqrt()
        };
        let plain = SharedMotion::fit(&slipping, None, PoseKind::Rigid);
        let refined = plain.clone().refined(&slipping, None);
        assert!(error(&refined) < 0.2 * error(&plain), "{} {}", error(&refined), error(&plain));
    }

    #[test]
    fn sigma_points_carry_the_second_moments() {
        let motion = SharedMotion::fit(&tumbling(0.0), None, PoseKind::Rigid);
        let mut sum = [[0.0; 3]; 3];
        for p in motion.sigma_points() {
            for i in 0..3 {
                for j in 0..3 {
                    sum[i][j] += p[i] * p[j] / 6.0;
                }
            }
        }
        let covariance = motion.covariance();
        for i in 0..3 {
            for j in 0..3 {
                assert!((sum[i][j] - covariance[i][j]).abs() < 1e-12);
            }
        }
    }
}
