//! Laws of bodies whose poses are seen one by one, as images show them: of one body, of a part of its window,
//! or of two that act on each other.

use crate::config::DistillConfig;
use crate::couple::gain;
use crate::distilled::DistilledLaw;
use crate::laws::generalised::{Errors, GeneralisedLaw, Surroundings, law_within};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::object::{laws, parts_of};
use crate::report::{DistillReport, PartLaws};
use glam::{DMat3, DVec3};

/// Poses of a body, each seen by itself.
#[derive(Clone, Debug)]
pub struct BodyPoses {
    /// Ascending times, normalised; the first is the start.
    pub times: Vec<f64>,
    /// Linear part and shift that take each point of the shape to where it is, one for each time.
    pub poses: Vec<(DMat3, DVec3)>,
    /// Standard deviation of each pose in units of the usual one; empty where all are alike.
    pub deviations: Vec<f64>,
    /// Whether linear parts deform the body, which is rigid otherwise.
    pub deforms: bool,
    /// Points of the body.
    pub shape: Vec<DVec3>,
    /// Size of errors that the poses have in common with their neighbours in time, world units, as far as it
    /// is known; 0 if there are none.
    pub slow_error: f64,
    /// Places of points at rest, on which the body may fall.
    pub surroundings: Vec<[f64; 3]>,
    /// Times at which other bodies are struck that this one touches then.
    pub hits: Vec<f64>,
}

/// Finds the law behind the poses of a body, or of two rigid ones that act on each other, at the same times.
/// `None` if there is no law that stays with them, or the configuration wants none.
#[must_use]
pub fn law_of_poses(observed: Vec<BodyPoses>, config: &DistillConfig, seed: u64) -> Option<DistilledLaw> {
    let observed: Vec<Observed> = observed.into_iter().map(Observed::from).collect();
    let bodies: Vec<&Observed> = observed.iter().collect();
    distilled(found(&bodies, config, seed)?, &bodies, config)
}

/// Finds the law of two rigid bodies that act on each other, if it is likelier than a law for each of them,
/// by their poses at the same times. `None` as for [`law_of_poses`], too.
#[must_use]
pub fn couple_of_poses(observed: [BodyPoses; 2], config: &DistillConfig, seed: u64) -> Option<DistilledLaw> {
    let [first, second] = observed.map(Observed::from);
    let both = found(&[&first, &second], config, seed).filter(|both| !both.is_refuted)?;
    let own = [found(&[&first], config, seed)?, found(&[&second], config, seed)?];
    gain(&both, own.each_ref())?;
    distilled(both, &[&first, &second], config)
}

/// The motion of a body, and what is around it.
struct Observed {
    motion: SharedMotion,
    slow_error: f64,
    surroundings: Vec<[f64; 3]>,
    hits: Vec<f64>,
}

impl From<BodyPoses> for Observed {
    fn from(body: BodyPoses) -> Self {
        let BodyPoses { slow_error, ref surroundings, ref hits, .. } = body;
        let (surroundings, hits) = (surroundings.clone(), hits.clone());
        Self { motion: body.into_motion(), slow_error, surroundings, hits }
    }
}

/// The likeliest law of bodies.
fn found(bodies: &[&Observed], config: &DistillConfig, seed: u64) -> Option<GeneralisedLaw> {
    let slow = bodies.iter().map(|body| body.slow_error).fold(0.0, f64::max);
    let Observed { surroundings: at_rest, hits, .. } = bodies.first()?;
    let surroundings = Surroundings { at_rest, hits };
    let motions: Vec<&SharedMotion> = bodies.iter().map(|body| &body.motion).collect();
    if !motions.iter().all(|motion| is_finite(motion)) {
        return None;
    }
    let found = law_within(&motions, (laws(config)?, surroundings), Errors::changing_slowly(slow), seed)?;
    tracing::debug!(law = ?found.law, known = ?found.known, found.is_refuted, "a law of poses");
    Some(found)
}

/// Whether all poses are numbers, as those of a body whose own law runs away are not.
fn is_finite(motion: &SharedMotion) -> bool {
    motion.poses.iter().all(|pose| pose.linear.is_finite() && pose.shift.is_finite())
}

/// A law for its bodies, if it stays with them and describes them.
fn distilled(found: GeneralisedLaw, bodies: &[&Observed], config: &DistillConfig) -> Option<DistilledLaw> {
    if found.is_refuted {
        return None;
    }
    let order = found.order.clone();
    let motions: Vec<&SharedMotion> = order.iter().map(|&body| &bodies[body].motion).collect();
    let reports: Vec<DistillReport> = motions.iter().map(|motion| DistillReport::of_poses(motion)).collect();
    let law = found.distilled(&motions, &DistillReport::joined(&reports), config);
    law.report.describes_window(config).then(|| law.with_bodies_at(&order))
}

/// Laws that explain parts of the window, of the poses of a rigid body that no law of all of it explains.
/// No part holds one of the known impacts, given by their times.
#[must_use]
pub fn part_laws_of_poses(
    observed: BodyPoses,
    impacts: &[f64],
    config: &DistillConfig,
    seed: u64,
) -> PartLaws {
    if observed.deforms {
        return PartLaws::default();
    }
    let slow_error = observed.slow_error;
    let motion = observed.into_motion();
    if is_finite(&motion) {
        parts_of(&motion, impacts, [0.0, slow_error], config, seed)
    } else {
        PartLaws::default()
    }
}

impl BodyPoses {
    /// The same at some of its times, given by their indices in ascending order.
    #[must_use]
    pub fn at(self, kept: &[usize]) -> Self {
        let times = kept.iter().map(|&time| self.times[time]).collect();
        let poses = kept.iter().map(|&time| self.poses[time]).collect();
        let deviations = kept.iter().filter_map(|&time| self.deviations.get(time).copied()).collect();
        Self { times, poses, deviations, ..self }
    }

    /// The same at those of its times that another body has, too.
    #[must_use]
    pub fn at_times_of(self, other: &Self) -> Self {
        let has = |time: &f64| other.times.iter().any(|other| other == time);
        let kept: Vec<usize> = (0..self.times.len()).filter(|&time| has(&self.times[time])).collect();
        self.at(&kept)
    }

    fn into_motion(self) -> SharedMotion {
        let Self { times, poses, deviations, deforms, shape, .. } = self;
        let weights = vec![(shape.len() as f64).recip(); shape.len()];
        let poses = poses.into_iter().map(|(linear, shift)| Pose { linear, shift }).collect();
        let kind = if deforms { PoseKind::Affine } else { PoseKind::Rigid };
        SharedMotion { kind, times, poses, deviations, shape, weights, residual: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::geometry::wide;
    use lgs_mechanics::coordinates::{Coordinates, Embedding, Port, State, Tree};
    use lgs_mechanics::terms::Term;
    use lgs_mechanics::{Edit, Law, System};

    /// A body that does not turn, on a path with a little noise.
    fn on(path: impl Fn(f64) -> DVec3) -> BodyPoses {
        let times: Vec<f64> = (0..40).map(|k| f64::from(k) / 52.0).collect();
        let noise = |t: f64| 2e-4 * DVec3::new((4001.0 * t).sin(), (5003.0 * t).sin(), (6007.0 * t).sin());
        let poses = times.iter().map(|&t| (DMat3::IDENTITY, path(t) + noise(t + path(t).x))).collect();
        let corner = |i: i32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5;
        let shape = (0..8).map(|i| 0.4 * corner(i)).collect();
        BodyPoses {
            times,
            poses,
            deviations: Vec::new(),
            deforms: false,
            shape,
            slow_error: 0.0,
            surroundings: Vec::new(),
            hits: Vec::new(),
        }
    }

    #[test]
    fn bodies_whose_distance_swings_are_a_couple_and_those_that_fly_past_each_other_are_none() {
        let drift = |t: f64| DVec3::new(0.2, 0.3, 0.1) * t;
        let apart = |t: f64| 0.9 * (4.0 * t).cos() * DVec3::X + 0.6 * (4.0 * t).sin() * DVec3::Y;
        let bound = [on(|t| drift(t) - 0.4 * apart(t)), on(|t| drift(t) + 0.6 * apart(t))];
        let config = DistillConfig::default();
        let law = couple_of_poses(bound, &config, 1).expect("a couple").law;
        assert!(law.coordinates == Coordinates::Pair && law.terms.len() == 1, "{law:?}");
        let free = [on(|t| drift(t) - 0.5 * DVec3::X), on(|t| 0.5 * DVec3::X - drift(t))];
        assert!(couple_of_poses(free, &config, 1).is_none());
    }

    #[test]
    fn a_pendulum_that_hangs_on_the_second_body_keeps_its_particles_first() {
        let [axis, pivot, link, arm] = [[0.0, 1.0, 0.0], [0.1, 0.0, 0.5], [0.0, 0.1, -0.6], [0.0, 0.0, -0.5]];
        let fourier = |port| Term::named("fourier", port).expect("a term");
        let terms = vec![fourier(Port::First), fourier(Port::Second)];
        let tree = Coordinates::Tree(Tree { axis, pivot, link, arm });
        let truth = Law::new(tree, terms, vec![0.4, 0.6, 0.0, 12.0, 0.0, 5.0, 0.0], 0.005).expect("a law");
        let start = State { x: vec![0.8, -0.5], v: vec![0.5, -1.0] };
        let embedding = Embedding::new(&truth.coordinates, &start.x);
        let centers = [DVec3::new(0.1, 0.0, 0.2), DVec3::new(0.2, 0.1, -0.3)];
        let placed = |body: usize, t: f64| {
            let state = System::new(&truth, Edit::NONE).states(&start, &[t]).expect("followed").remove(0);
            let placed = embedding.placements(&state.x)[body];
            (placed.linear, placed.apply(centers[body]))
        };
        let seen = |body: usize| {
            let still = on(|_| DVec3::ZERO);
            let poses = still.times.iter().zip(&still.poses);
            let poses = poses.map(|(&t, (_, noise))| {
                let (linear, center) = placed(body, t);
                (linear, center + *noise)
            });
            BodyPoses { poses: poses.collect(), ..still }
        };
        let law = couple_of_poses([seen(1), seen(0)], &DistillConfig::default(), 1).expect("a couple");
        assert!(matches!(law.law.coordinates, Coordinates::Tree(_)), "{:?}", law.law);
        assert_eq!(law.bodies.ranges(law.q0.len()), [8..16, 0..8]);
        let later = law.edited(Edit::NONE, &[1.0]).remove(0);
        for (body, own) in [(1, &later[..8]), (0, &later[8..])] {
            let center = own.iter().map(|&p| wide(p)).sum::<DVec3>() / 8.0;
            assert!(center.distance(placed(body, 1.0).1) < 0.02, "{body}: {center}");
        }
    }

    #[test]
    fn poses_that_are_no_numbers_have_no_law() {
        let mut body = on(|t| DVec3::new(0.6, 0.9, 0.3) * t);
        body.poses[20].1.y = f64::NAN;
        let config = DistillConfig::default();
        assert!(part_laws_of_poses(body.clone(), &[], &config, 1).is_empty());
        assert!(law_of_poses(vec![body], &config, 1).is_none());
    }

    #[test]
    fn poses_that_are_badly_known_hardly_bear_on_a_law() {
        let drift = |t: f64| DVec3::new(0.6, 0.9, 0.3) * t;
        let mut body = on(drift);
        let off = 30..40;
        body.poses[off.clone()].iter_mut().for_each(|(_, place)| *place += 0.02 * DVec3::Z);
        body.deviations = (0..40).map(|k| if off.contains(&k) { 100.0 } else { 1.0 }).collect();
        let error = |body: BodyPoses| {
            let found = law_of_poses(vec![body], &DistillConfig::default(), 1).expect("a law");
            let states = System::new(&found.law, Edit::NONE).states(&found.start, &[1.5]).expect("followed");
            DVec3::from_slice(&states[0].x).distance(drift(1.5))
        };
        let (weighed, alike) = (error(body.clone()), error(BodyPoses { deviations: Vec::new(), ..body }));
        assert!(weighed < 2e-3 && weighed < 0.1 * alike, "{weighed} {alike}");
    }
}
