//! Shared supports balanced about the axis that an object turns about.
//!
//! A rigid rollout conserves the angular momentum of the shared support's members. If the axis of a turn is
//! no principal axis of theirs, the object begins to tumble, whatever the true body does: the masses of a
//! body are not those of its Gaussians.

use crate::motion::curve::Order;
use crate::motion::pose::angular_velocity;
use crate::motion::shared_motion::SharedMotion;
use crate::motion::smooth_motion::SmoothMotion;
use crate::thresholds::{BALANCED, CONSIDERED, LEAST_TURN};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, principal_axes};

/// The axis that the motion turns about for the most part, shape axes; none where it hardly turns.
pub(crate) fn turning_axis(motion: &SmoothMotion) -> Option<DVec3> {
    let times = &motion.shared.times;
    let spin = |&t: &f64| {
        let linear = motion.at(t, Order::Value).linear;
        linear.transpose() * angular_velocity(&linear, &motion.at(t, Order::First).linear)
    };
    let mean: DMat3 = times.iter().map(spin).map(|spin| outer(spin, spin) / times.len() as f64).sum();
    let (square, axis) = principal_axes(&mean)[0];
    (square.sqrt() * motion.shared.duration() >= LEAST_TURN).then_some(axis)
}

/// Exchanges members for other eligible particles until their centroid is at the centre and the axis is a
/// principal one of theirs: a body that turns freely about it goes on doing so, whatever the shape of its
/// Gaussians.
///
/// One exchange at a time ends where every other one is too coarse, so pairs of the finest ones are tried as
/// well.
pub(crate) fn balance(
    motion: &SharedMotion,
    center: DVec3,
    axis: DVec3,
    eligible: &[usize],
    members: &mut [usize],
) {
    let offset = |i: usize| motion.shape[i] - center;
    let square =
        members.iter().map(|&i| offset(i).length_squared()).sum::<f64>() / members.len().max(1) as f64;
    let imbalance = |i: usize| Imbalance::of(offset(i), axis, square.sqrt());
    let considered: Vec<usize> =
        eligible.iter().copied().step_by(eligible.len().div_ceil(CONSIDERED).max(1)).collect();
    let mut size = f64::INFINITY;
    loop {
        let total = members.iter().fold(Imbalance::default(), |sum, &i| sum.plus(imbalance(i)));
        let is_balanced = total.size().sqrt() <= BALANCED * square * members.len() as f64;
        if is_balanced || total.size() >= size {
            return;
        }
        size = total.size();
        let mut exchanges: Vec<Exchange> = Vec::new();
        for (slot, &member) in members.iter().enumerate() {
            exchanges.extend(considered.iter().filter(|i| !members.contains(i)).map(|&particle| {
                let change = imbalance(particle).plus(imbalance(member).negated());
                Exchange { slot, particle, change }
            }));
        }
        let Some(chosen) = best_exchanges(exchanges, total) else { return };
        chosen.into_iter().for_each(|exchange| members[exchange.slot] = exchange.particle);
    }
}

/// The exchange, or the pair of those that change least, that leaves the smallest imbalance; none if that is
/// no smaller than it was.
fn best_exchanges(mut exchanges: Vec<Exchange>, total: Imbalance) -> Option<Vec<Exchange>> {
    let mut best = (total.size(), Vec::new());
    for &exchange in &exchanges {
        let after = total.plus(exchange.change).size();
        if after < best.0 {
            best = (after, vec![exchange]);
        }
    }
    exchanges.sort_by(|a, b| a.change.size().total_cmp(&b.change.size()));
    exchanges.truncate(CONSIDERED);
    for (i, first) in exchanges.iter().enumerate() {
        let after_one = total.plus(first.change);
        for second in &exchanges[i + 1..] {
            let after = after_one.plus(second.change).size();
            if after < best.0 && first.slot != second.slot && first.particle != second.particle {
                best = (after, vec![*first, *second]);
            }
        }
    }
    (!best.1.is_empty()).then_some(best.1)
}

/// Moments of the members that are zero for a balanced support.
#[derive(Clone, Copy, Default)]
struct Imbalance {
    /// Sum of the offsets from the centre, times the members' extent.
    first: DVec3,
    /// Sum of the products of the offsets along the axis and across it.
    products: DVec3,
}

impl Imbalance {
    /// One member's part.
    fn of(offset: DVec3, axis: DVec3, extent: f64) -> Self {
        let along = offset.dot(axis);
        Self { first: extent * offset, products: along * (offset - along * axis) }
    }

    fn plus(self, other: Self) -> Self {
        Self { first: self.first + other.first, products: self.products + other.products }
    }

    fn negated(self) -> Self {
        Self { first: -self.first, products: -self.products }
    }

    fn size(&self) -> f64 {
        self.first.length_squared() + self.products.length_squared()
    }
}

/// A particle that takes the place of a member.
#[derive(Clone, Copy)]
struct Exchange {
    slot: usize,
    particle: usize,
    change: Imbalance,
}
