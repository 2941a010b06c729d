//! Anchors balanced about the axis that an object turns about.
//!
//! A rigid rollout conserves the anchors' angular momentum. If the axis of a turn is no principal axis of
//! theirs, the object begins to tumble, whatever the true body does: the masses of a body are not those of
//! its Gaussians.

use crate::chebyshev::Order;
use crate::dense::{V3, add, dot, mat_t_vec, norm2, scale, sub, symmetric_eigen};
use crate::pose::{SmoothPose, angular_velocity};
use crate::shared_motion::SharedMotion;

/// Angle per window below which a turn says nothing about its centre, rad.
pub(crate) const LEAST_TURN: f64 = 0.3;

/// Most rounds of exchanges.
const EXCHANGES: usize = 60;
/// Moments are balanced if they are below this part of the anchors' mean square distance from the centre.
const BALANCED: f64 = 1e-3;
/// About as many particles are thought of in exchanges.
const CONSIDERED: usize = 1000;
/// Exchanges that pairs are made of.
const PAIRED: usize = 1000;

/// The axis that the motion turns about for the most part, shape axes; none where it hardly turns.
pub(crate) fn turning_axis(motion: &SharedMotion, smooth: &SmoothPose) -> Option<V3> {
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

/// Exchanges anchors for other eligible particles until their centroid is at the centre and the axis is a
/// principal one of theirs: a body that turns freely about it goes on doing so, whatever the shape of its
/// Gaussians.
///
/// One exchange at a time ends where every other one is too coarse, so pairs of the finest ones are tried as
/// well.
pub(crate) fn balance(
    motion: &SharedMotion,
    center: V3,
    axis: V3,
    eligible: &[usize],
    anchors: &mut [usize],
) {
    let square = anchors.iter().map(|&i| norm2(sub(motion.shape[i], center))).sum::<f64>()
        / anchors.len().max(1) as f64;
    let moments = |i: usize| {
        let r = sub(motion.shape[i], center);
        let along = dot(r, axis);
        Moments { first: scale(r, square.sqrt()), products: scale(sub(r, scale(axis, along)), along) }
    };
    let considered: Vec<usize> =
        eligible.iter().copied().step_by(eligible.len().div_ceil(CONSIDERED).max(1)).collect();
    for _ in 0..EXCHANGES {
        let total = anchors.iter().fold(Moments::default(), |sum, &i| sum.plus(moments(i), 1.0));
        if total.size().sqrt() <= BALANCED * square * anchors.len() as f64 {
            return;
        }
        let mut moves: Vec<Exchange> = Vec::new();
        for (slot, &anchor) in anchors.iter().enumerate() {
            for &particle in considered.iter().filter(|i| !anchors.contains(i)) {
                moves.push(Exchange {
                    slot,
                    particle,
                    change: moments(particle).plus(moments(anchor), -1.0),
                });
            }
        }
        let Some(chosen) = best_exchanges(moves, total) else { return };
        chosen.into_iter().for_each(|exchange| anchors[exchange.slot] = exchange.particle);
    }
}

/// The exchange, or the pair of those that change least, that leaves least; none if it is no less than what
/// there is.
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
        Self {
            first: add(self.first, scale(other.first, sign)),
            products: add(self.products, scale(other.products, sign)),
        }
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
