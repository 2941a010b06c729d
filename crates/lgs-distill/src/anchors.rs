//! Particles that hold a rigid object together: a few, far apart, none of them a floater.
//!
//! With these as the support of every particle, Eq. 6 keeps the whole object rigid at the cost of a local
//! support. Nearest neighbours do not: each small neighbourhood stays rigid, and the object still stretches.

use crate::balance::{LEAST_TURN, balance, turning_axis};
use crate::chebyshev::Order;
use crate::dense::{V3, add, mat_t_vec, norm2, solve_positive, sub};
use crate::pose::SmoothPose;
use crate::shared_motion::SharedMotion;

/// Particles lighter than this part of the mean weight (outliers, faint ones) are no anchors, unless too few
/// are left.
const LIGHTEST: f64 = 0.3;

/// The shape point whose acceleration changes least over the window: the centre of a thrown, spinning body,
/// which need not be the mean of its Gaussians. The origin where the object hardly turns.
fn steadiest_point(motion: &SharedMotion, smooth: &SmoothPose) -> V3 {
    let seconds: Vec<_> = motion.times.iter().map(|&t| smooth.at(t, Order::Second)).collect();
    let per = 1.0 / seconds.len() as f64;
    let mean = seconds.iter().fold([0.0; 12], |sum, pose| {
        let entries = pose.entries();
        std::array::from_fn(|i| sum[i] + per * entries[i])
    });
    let mean = crate::pose::Pose::from_entries(&mean);
    let duration = motion.times[motion.times.len() - 1] - motion.times[0];
    let ridge = seconds.len() as f64 * (LEAST_TURN / (duration * duration)).powi(2);
    let (mut gram, mut rhs) = (vec![0.0; 9], [0.0; 3]);
    for pose in &seconds {
        let linear: [V3; 3] = std::array::from_fn(|i| sub(pose.linear[i], mean.linear[i]));
        rhs = sub(rhs, mat_t_vec(&linear, sub(pose.shift, mean.shift)));
        for i in 0..3 {
            for j in 0..3 {
                gram[3 * i + j] += (0..3).map(|k| linear[k][i] * linear[k][j]).sum::<f64>();
            }
        }
    }
    (0..3).for_each(|i| gram[4 * i] += ridge);
    let reach = motion.shape.iter().map(|&b| norm2(b)).fold(0.0, f64::max);
    if solve_positive(&mut gram, &mut rhs, 3, 1) && norm2(rhs) <= reach { rhs } else { [0.0; 3] }
}

/// Up to `count` particles: farthest-point sampling of the shape, each with the particle nearest to its
/// mirror image through `center` (shape axes), balanced afterwards about the axis that the object turns
/// about.
pub(crate) fn choose_anchors(motion: &SharedMotion, smooth: &SmoothPose, count: usize) -> Vec<usize> {
    let center = steadiest_point(motion, smooth);
    let mean = 1.0 / motion.weights.len().max(1) as f64;
    let mut eligible: Vec<usize> =
        (0..motion.shape.len()).filter(|&i| motion.weights[i] >= LIGHTEST * mean).collect();
    if eligible.len() < count {
        eligible = (0..motion.shape.len()).collect();
    }
    // Squared distance to the nearest anchor so far; a chosen particle is never chosen again.
    let mut apart: Vec<f64> = eligible.iter().map(|&i| norm2(sub(motion.shape[i], center))).collect();
    let mut chosen = Vec::new();
    let mut take = |at: usize, apart: &mut Vec<f64>| {
        chosen.push(eligible[at]);
        for (distance, &i) in apart.iter_mut().zip(&eligible) {
            *distance = distance.min(norm2(sub(motion.shape[i], motion.shape[eligible[at]])));
        }
        apart[at] = -1.0;
    };
    let mut left = count.min(eligible.len());
    // Of the anchors so far, about the centre.
    let mut sum = [0.0; 3];
    while left > 0 {
        let Some(far) = (0..eligible.len()).max_by(|&i, &j| apart[i].total_cmp(&apart[j]).then(j.cmp(&i)))
        else {
            break;
        };
        take(far, &mut apart);
        left -= 1;
        sum = add(sum, sub(motion.shape[eligible[far]], center));
        // The mirror image also makes up for what earlier pairs have left.
        let mirrored = sub(center, sum);
        let to_mirror = |i: usize| {
            if apart[i] < 0.0 { f64::INFINITY } else { norm2(sub(motion.shape[eligible[i]], mirrored)) }
        };
        let Some(near) =
            (0..eligible.len()).min_by(|&i, &j| to_mirror(i).total_cmp(&to_mirror(j)).then(i.cmp(&j)))
        else {
            break;
        };
        if left > 0 && apart[near] >= 0.0 {
            take(near, &mut apart);
            sum = add(sum, sub(motion.shape[eligible[near]], center));
            left -= 1;
        }
    }
    if let Some(axis) = turning_axis(motion, smooth) {
        balance(motion, center, axis, &eligible, &mut chosen);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Trajectories;
    use crate::dense::{dot, narrow, rotation_of_vector, scale};
    use crate::pose::{Pose, PoseKind};
    use crate::testing::block;

    /// A slanted block turns about the vertical through its middle.
    #[test]
    fn anchors_are_balanced_about_the_axis_of_the_turn() {
        let slanted = Pose { linear: rotation_of_vector([0.4, 0.6, 0.0]), shift: [0.0; 3] };
        let body: Vec<V3> = block([0.3, 0.2, 0.05], 500, 5).into_iter().map(|b| slanted.apply(b)).collect();
        let times: Vec<f32> = (0..40).map(|i| 0.02 * i as f32).collect();
        let at =
            |t: f32| Pose { linear: rotation_of_vector([0.0, 0.0, 2.0 * f64::from(t)]), shift: [0.0; 3] };
        let positions =
            times.iter().map(|&t| body.iter().map(|&b| narrow(at(t).apply(b))).collect()).collect();
        let motion = SharedMotion::fit(&Trajectories { times, positions }, None, PoseKind::Rigid);
        let smooth = motion.smooth(2..=8).0;
        let axis = turning_axis(&motion, &smooth).expect("it turns");
        let anchors = choose_anchors(&motion, &smooth, 20);
        let part = 1.0 / anchors.len() as f64;
        let centroid = anchors.iter().fold([0.0; 3], |sum, &i| add(sum, scale(motion.shape[i], part)));
        let (mut products, mut square) = ([0.0; 3], 0.0);
        for &i in &anchors {
            let r = sub(motion.shape[i], centroid);
            products = add(products, scale(sub(r, scale(axis, dot(r, axis))), part * dot(r, axis)));
            square += part * norm2(r);
        }
        assert!(norm2(products).sqrt() < 0.005 * square, "{products:?} of {square}");
        assert!(norm2(sub(centroid, steadiest_point(&motion, &smooth))) < 1e-4 * square, "{centroid:?}");
    }
}
