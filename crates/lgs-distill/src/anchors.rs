//! Particles that hold a rigid object together: a few, far apart, none of them a floater.
//!
//! With these as the support of every particle, Eq. 6 keeps the whole object rigid at the cost of a local support. Nearest neighbours
//! do not: each small neighbourhood stays rigid, and the object still stretches.

use crate::chebyshev::Order;
use crate::dense::{V3, add, dot, mat_t_vec, norm2, scale, solve_positive, sub, symmetric_eigen};
use crate::pose::{SmoothPose, angular_velocity};
use crate::shared_motion::SharedMotion;

/// Particles lighter than this part of the mean weight (outliers, faint ones) are no anchors, unless too few are left.
const LIGHTEST: f64 = 0.3;

/// Most rounds of exchanges.
const EXCHANGES: usize = 60;
/// Moments are balanced if they are below this part of the anchors' mean square distance from the centre.
const BALANCED: f64 = 1e-3;
/// About as many particles are thought of in exchanges.
const CONSIDERED: usize = 1000;
/// Exchanges that pairs are made of.
const PAIRED: usize = 1000;

/// Angle per window below which a turn says nothing about its centre, rad.
const LEAST_TURN: f64 = 0.3;

/// The shape point whose acceleration changes least over the window: the centre of a thrown, spinning body, which need not be the mean of
/// its Gaussians. The origin where the object hardly turns.
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

/// The axis that the motion turns about for the most part, shape axes; none where it hardly turns.
fn turning_axis(motion: &SharedMotion, smooth: &SmoothPose) -> Option<V3> {
    let per = 1.0 / motion.times.len() as f64;
    let mut sum = [[0.0; 3]; 3];
    for &t in &motion.times {
        let linear = smooth.at(t, Order::Value).linear;
        let spin = mat_t_vec(&linear, angular_velocity(&linear, &smooth.at(t, Order::First).linear));
        for (row, x) in sum.iter_mut().zip(spin) {
            row.iter_mut().zip(spin).for_each(|(entry, y)| *entry += per * x * y);
        }
    }
    let (squares, axes) = symmetric_eigen(sum);
    let duration = motion.times[motion.times.len() - 1] - motion.times[0];
    let (square, axis) = squares.into_iter().zip(axes).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (square.sqrt() * duration >= LEAST_TURN).then_some(axis)
}

/// Exchanges anchors for other eligible particles until their centroid is at the centre and the axis is a principal one of theirs: a body
/// that turns freely about it goes on doing so, whatever the shape of its Gaussians.
///
/// One exchange at a time ends where every other one is too coarse, so pairs of the finest ones are tried as well.
fn balance(motion: &SharedMotion, center: V3, axis: V3, eligible: &[usize], anchors: &mut [usize]) {
    let square = anchors.iter().map(|&i| norm2(sub(motion.shape[i], center))).sum::<f64>() / anchors.len().max(1) as f64;
    let moments = |i: usize| {
        let r = sub(motion.shape[i], center);
        let along = dot(r, axis);
        Moments { first: scale(r, square.sqrt()), products: scale(sub(r, scale(axis, along)), along) }
    };
    let considered: Vec<usize> = eligible.iter().copied().step_by(eligible.len().div_ceil(CONSIDERED).max(1)).collect();
    for _ in 0..EXCHANGES {
        let total = anchors.iter().fold(Moments::default(), |sum, &i| sum.plus(moments(i), 1.0));
        if total.size().sqrt() <= BALANCED * square * anchors.len() as f64 {
            return;
        }
        let mut moves: Vec<Exchange> = Vec::new();
        for (slot, &anchor) in anchors.iter().enumerate() {
            for &particle in considered.iter().filter(|i| !anchors.contains(i)) {
                moves.push(Exchange { slot, particle, change: moments(particle).plus(moments(anchor), -1.0) });
            }
        }
        let Some(chosen) = best_exchanges(moves, total) else { return };
        chosen.into_iter().for_each(|exchange| anchors[exchange.slot] = exchange.particle);
    }
}

/// The exchange, or the pair of those that change least, that leaves least; none if it is no less than what there is.
fn best_exchanges(mut moves: Vec<Exchange>, total: Moments) -> Option<Vec<Exchange>> {
    let mut best = (total.size(), Vec::new());
    for &exchange in &moves {
        let after = total.plus(exchange.change, 1.0).size();
        if after < best.0 {
            best = (after, vec![exchange]);
        }
    }
    moves.sort_by(|a, b| a.change.size().total_cmp(&b.change.size()));
    moves.truncate(PAIRED);
    for (i, first) in moves.iter().enumerate() {
        let after_one = total.plus(first.change, 1.0);
        for second in &moves[i + 1..] {
            let after = after_one.plus(second.change, 1.0).size();
            if after < best.0 && first.slot != second.slot && first.particle != second.particle {
                best = (after, vec![*first, *second]);
            }
        }
    }
    (!best.1.is_empty()).then_some(best.1)
}

/// Sums over anchors that a balanced body has none of.
#[derive(Clone, Copy, Default)]
struct Moments {
    /// Of the offsets from the centre, times the anchors' extent.
    first: V3,
    /// Of the products of the offsets along the axis and across it.
    products: V3,
}

impl Moments {
    fn plus(self, other: Self, sign: f64) -> Self {
        Self { first: add(self.first, scale(other.first, sign)), products: add(self.products, scale(other.products, sign)) }
    }

    fn size(&self) -> f64 {
        norm2(self.first) + norm2(self.products)
    }
}

/// A particle that takes the place of an anchor.
#[derive(Clone, Copy)]
struct Exchange {
    slot: usize,
    particle: usize,
    change: Moments,
}

/// Up to `count` particles: farthest-point sampling of the shape, each with the particle nearest to its mirror image through `center`
/// (shape axes), balanced afterwards about the axis that the object turns about.
pub(crate) fn choose_anchors(motion: &SharedMotion, smooth: &SmoothPose, count: usize) -> Vec<usize> {
    let center = steadiest_point(motion, smooth);
    let mean = 1.0 / motion.weights.len().max(1) as f64;
    let mut eligible: Vec<usize> = (0..motion.shape.len()).filter(|&i| motion.weights[i] >= LIGHTEST * mean).collect();
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
        let Some(far) = (0..eligible.len()).max_by(|&i, &j| apart[i].total_cmp(&apart[j]).then(j.cmp(&i))) else { break };
        take(far, &mut apart);
        left -= 1;
        sum = add(sum, sub(motion.shape[eligible[far]], center));
        // The mirror image also makes up for what earlier pairs have left.
        let mirrored = sub(center, sum);
        let to_mirror = |i: usize| if apart[i] < 0.0 { f64::INFINITY } else { norm2(sub(motion.shape[eligible[i]], mirrored)) };
        let Some(near) = (0..eligible.len()).min_by(|&i, &j| to_mirror(i).total_cmp(&to_mirror(j)).then(i.cmp(&j))) else { break };
        if left > 0 && apart[near] >= 0.0 {
            take(near, &mut apart);
            sum = add(sum, sub(motion.shape[eligible[near]], center));
            left -= 1;
        }
    }
    if let Some(axis) = turning_axis(motion, smooth).filter(|_| chosen.len() == count) {
        balance(motion, center, axis, &eligible, &mut chosen);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Trajectories;
    use crate::dense::{narrow, rotation_of_vector};
    use crate::pose::{Pose, PoseKind};
    use crate::testing::block;

    /// A slanted block turns about the vertical through its middle.
    #[test]
    fn anchors_are_balanced_about_the_axis_of_the_turn() {
        let slanted = Pose { linear: rotation_of_vector([0.4, 0.6, 0.0]), shift: [0.0; 3] };
        let body: Vec<V3> = block([0.3, 0.2, 0.05], 500, 5).into_iter().map(|b| slanted.apply(b)).collect();
        let times: Vec<f32> = (0..40).map(|i| 0.02 * i as f32).collect();
        let at = |t: f32| Pose { linear: rotation_of_vector([0.0, 0.0, 2.0 * f64::from(t)]), shift: [0.0; 3] };
        let positions = times.iter().map(|&t| body.iter().map(|&b| narrow(at(t).apply(b))).collect()).collect();
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
