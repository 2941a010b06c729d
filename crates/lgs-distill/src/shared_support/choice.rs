//! Particles that keep a rigid object in shape: a few, far apart, none of them a floater.
//!
//! With these as the support of every particle, Eq. 6 keeps the whole object rigid at the cost of a local
//! support. Nearest neighbours do not: each small neighbourhood stays rigid, and the object still stretches.

use super::balance::{balance, turning_axis};
use crate::motion::curve::Order;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::motion::smooth_motion::SmoothMotion;
use crate::thresholds::{LEAST_TURN, LIGHTEST};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{inverse, scalar};

/// Up to `count` particles: farthest-point sampling of the shape, each with the particle nearest to its
/// mirror image through the steadiest point, balanced afterwards about the axis that the object turns about.
pub(crate) fn choose_members(motion: &SmoothMotion, count: usize) -> Vec<usize> {
    let center = steadiest_point(motion);
    let eligible = eligible(&motion.shared, count);
    let mut sampling = FarthestPoints::new(&motion.shared, &eligible, center);
    while sampling.chosen.len() < count.min(eligible.len()) {
        let Some(far) = sampling.farthest() else { break };
        sampling.take(far);
        if sampling.chosen.len() < count
            && let Some(near) = sampling.nearest_to_mirror()
        {
            sampling.take(near);
        }
    }
    let mut chosen = sampling.chosen;
    if let Some(axis) = turning_axis(motion) {
        balance(&motion.shared, center, axis, &eligible, &mut chosen);
    }
    chosen
}

/// Particles that weigh enough; all where these are fewer than `count`.
fn eligible(motion: &SharedMotion, count: usize) -> Vec<usize> {
    let mean = 1.0 / motion.weights.len().max(1) as f64;
    let heavy: Vec<usize> =
        (0..motion.shape.len()).filter(|&i| motion.weights[i] >= LIGHTEST * mean).collect();
    if heavy.len() < count { (0..motion.shape.len()).collect() } else { heavy }
}

/// The shape point whose acceleration changes least over the window: the centre of a thrown, spinning body,
/// which need not be the mean of its Gaussians. The origin where the object hardly turns.
fn steadiest_point(motion: &SmoothMotion) -> DVec3 {
    let shared = &motion.shared;
    let seconds: Vec<Pose> = shared.times.iter().map(|&t| motion.at(t, Order::Second)).collect();
    let per = 1.0 / seconds.len() as f64;
    let mean_linear: DMat3 = seconds.iter().map(|pose| per * pose.linear).sum();
    let mean_shift: DVec3 = seconds.iter().map(|pose| per * pose.shift).sum();
    let ridge = seconds.len() as f64 * (LEAST_TURN / shared.duration().powi(2)).powi(2);
    let (mut gram, mut rhs) = (scalar(ridge), DVec3::ZERO);
    for pose in &seconds {
        let changed = (pose.linear - mean_linear).transpose();
        rhs -= changed * (pose.shift - mean_shift);
        gram += changed * changed.transpose();
    }
    let reach = shared.shape.iter().map(|b| b.length_squared()).fold(0.0, f64::max);
    let point = inverse(&gram).map_or(DVec3::ZERO, |inverse| inverse * rhs);
    if point.length_squared() <= reach { point } else { DVec3::ZERO }
}

/// Farthest-point sampling of a shape with mirror images.
struct FarthestPoints<'a> {
    shape: &'a [DVec3],
    eligible: &'a [usize],
    center: DVec3,
    /// Squared distance of each eligible particle to the nearest chosen one; −1 for those that are chosen.
    apart: Vec<f64>,
    chosen: Vec<usize>,
    /// Sum of the chosen particles' offsets from the centre.
    offset: DVec3,
}

impl<'a> FarthestPoints<'a> {
    fn new(motion: &'a SharedMotion, eligible: &'a [usize], center: DVec3) -> Self {
        let apart = eligible.iter().map(|&i| motion.shape[i].distance_squared(center)).collect();
        Self { shape: &motion.shape, eligible, center, apart, chosen: Vec::new(), offset: DVec3::ZERO }
    }

    fn point(&self, at: usize) -> DVec3 {
        self.shape[self.eligible[at]]
    }

    fn take(&mut self, at: usize) {
        let taken = self.point(at);
        for (distance, &i) in self.apart.iter_mut().zip(self.eligible) {
            *distance = distance.min(self.shape[i].distance_squared(taken));
        }
        self.apart[at] = -1.0;
        self.chosen.push(self.eligible[at]);
        self.offset += taken - self.center;
    }

    /// The eligible particle farthest from all chosen ones.
    fn farthest(&self) -> Option<usize> {
        (0..self.eligible.len()).max_by(|&i, &j| self.apart[i].total_cmp(&self.apart[j]).then(j.cmp(&i)))
    }

    /// The particle that brings the mean of the chosen ones closest to the centre: the mirror image also
    /// makes up for what earlier pairs have left.
    fn nearest_to_mirror(&self) -> Option<usize> {
        let mirrored = self.center - self.offset;
        let distance = |i: usize| self.point(i).distance_squared(mirrored);
        let free = (0..self.eligible.len()).filter(|&i| self.apart[i] >= 0.0);
        free.min_by(|&i, &j| distance(i).total_cmp(&distance(j)).then(i.cmp(&j)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::pose::PoseKind;
    use crate::motion::procrustes::fit_shared_motion;
    use crate::testing::{block, moved};
    use lgs_core::geometry::rotation_by;

    /// A slanted block turns about the vertical through its middle.
    #[test]
    fn members_are_balanced_about_the_axis_of_the_turn() {
        let slanted = rotation_by(DVec3::new(0.4, 0.6, 0.0));
        let body: Vec<DVec3> = block([0.3, 0.2, 0.05], 500, 5).into_iter().map(|b| slanted * b).collect();
        let times = (0..40).map(|i| 0.02 * i as f32).collect();
        let at = |t: f64| Pose { linear: rotation_by(2.0 * t * DVec3::Z), shift: DVec3::ZERO };
        let motion = SmoothMotion::new(fit_shared_motion(&moved(&body, times, at), PoseKind::Rigid), 2..=8);
        let axis = turning_axis(&motion).expect("it turns");
        let members = choose_members(&motion, 20);
        let part = 1.0 / members.len() as f64;
        let shape = |i: usize| motion.shared.shape[i];
        let centroid: DVec3 = members.iter().map(|&i| part * shape(i)).sum();
        let offsets = || members.iter().map(|&i| shape(i) - centroid);
        let products: DVec3 = offsets().map(|r| part * r.dot(axis) * (r - r.dot(axis) * axis)).sum();
        let square: f64 = offsets().map(|r| part * r.length_squared()).sum();
        assert!(products.length() < 0.005 * square, "{products:?} of {square}");
        assert!(centroid.distance_squared(steadiest_point(&motion)) < 1e-4 * square, "{centroid:?}");
    }
}
