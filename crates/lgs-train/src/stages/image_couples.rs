//! Two objects that act on each other, as images show them (method §6): where the source's tracks of round
//! bodies slip, stage 1 sees them turn, and takes no law of two points for them.

use lgs_distill::{BodyPoses, DistilledLaw, couple_of_poses, may_be_a_pair};
use lgs_mechanics::Law;
use lgs_mechanics::bands::{Known, Verdict};
use lgs_model::LagrangianScene;
use rayon::prelude::*;

use super::law_choice::{LawChoice, take};

/// The law of two objects, the rows of which are next to each other in the scene.
pub(super) struct Couple {
    /// Index of the first one; that of the second is the next.
    first: usize,
    law: DistilledLaw,
}

/// The laws of pairs of objects whose rows are next to each other, which have one body each and may be a pair
/// by what is known of their own laws, `own`: those of the last rows first, each object once. An object is a
/// range of rows of the scene, so that others cannot be put together.
pub(super) fn couples<'a>(
    bodies: &[(usize, Vec<BodyPoses>)],
    own: &(dyn Fn(usize) -> Option<(&'a Law, &'a Known)> + Sync),
    choice: LawChoice<'_>,
) -> Vec<Couple> {
    let of_pair = |pair: &[(usize, Vec<BodyPoses>)]| {
        let [(first, a), (second, b)] = pair else { return None };
        let ([a], [b]) = (a.as_slice(), b.as_slice()) else { return None };
        let may_be_one = first + 1 == *second && may_be_a_pair([*first, *second].map(own));
        if !may_be_one || a.deforms || b.deforms {
            return None;
        }
        let choice = choice.of_object(*first);
        let together = [a.clone().at_times_of(b), b.clone().at_times_of(a)];
        if 2 * together[0].times.len() < a.times.len() {
            return None;
        }
        let law = couple_of_poses(together, choice.config, choice.seed)?;
        tracing::debug!(first, law = ?law.law, "the law of two objects that images show");
        (law.known.verdict != Verdict::Outside).then_some(Couple { first: *first, law })
    };
    let pairs: Vec<&[(usize, Vec<BodyPoses>)]> = bodies.windows(2).collect();
    let mut found: Vec<Couple> = pairs.into_par_iter().filter_map(of_pair).collect();
    found.reverse();
    found.dedup_by(|next, last| next.first + 1 == last.first);
    found
}

impl Couple {
    /// Whether an object is one of the two.
    pub(super) fn has(&self, object: usize) -> bool {
        [self.first, self.first + 1].contains(&object)
    }

    /// The scene with the two as one object by its law.
    pub(super) fn taken(self, scene: &LagrangianScene) -> LagrangianScene {
        let mut other = scene.clone();
        let second = other.objects.remove(self.first + 1);
        other.objects[self.first].members.end = second.members.end;
        take(self.law, &mut other, self.first);
        other
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use lgs_core::GaussianCloud;
    use lgs_dynamics::{Edit, Reversal};
    use lgs_mechanics::bands;
    use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
    use lgs_model::{Dynamics, GeneralisedDynamics, Motion, MotionConfig, ObjectModel};

    /// An object that moves freely along x.
    fn sliding(members: std::ops::Range<usize>, velocity: f64) -> ObjectModel {
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.05).expect("a law");
        let start = State { x: vec![0.0; 3], v: vec![velocity, 0.0, 0.0] };
        let known = bands::Known::default();
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
        ObjectModel { members, dynamics: Dynamics::Generalised(dynamics), recording: None }
    }

    #[test]
    fn two_objects_become_one_of_two_bodies_and_others_keep_their_rows() {
        let places: Vec<[f32; 3]> = (0..5).map(|i| [i as f32, 0.0, 0.0]).collect();
        let cloud = GaussianCloud::isotropic(places.clone(), 0.15, [0.1, 0.5, 0.2], 0.9);
        let scene = LagrangianScene {
            dynamic_gaussians: cloud,
            velocities: vec![[0.0; 3]; 5],
            objects: vec![sliding(0..1, 1.0), sliding(1..3, 1.0), sliding(3..5, -1.0)],
            ..LagrangianScene::still(
                GaussianCloud::default(),
                MotionConfig { dt: 0.05, time_window: 1.0 },
                [1.0; 3],
            )
        };
        // Two bodies side by side, with a mass ratio, an offset, and nothing that acts on them.
        let law = Law::new(Coordinates::Pair, Vec::new(), vec![1.0, 0.0, 0.0, 0.0], 0.05).expect("a law");
        let start = State { x: vec![1.0, 0.0, 0.0, 3.5, 0.0, 0.0], v: vec![0.5, 0.0, 0.0, 0.0, 2.0, 0.0] };
        let law = DistilledLaw {
            law,
            start,
            bodies: Bodies::of_sizes(&[2, 2]),
            bases: vec![(DMat3::IDENTITY, DVec3::X), (DMat3::IDENTITY, 3.5 * DVec3::X)],
            known: bands::Known::default(),
            q0: places[1..].to_vec(),
            v0: vec![[0.0; 3]; 4],
            report: lgs_distill::DistillReport::default(),
        };
        let other = Couple { first: 1, law }.taken(&scene);
        let rows: Vec<_> = other.objects.iter().map(|object| object.members.clone()).collect();
        assert_eq!(rows, [0..1, 1..5]);
        let later = Motion::new(&other, Edit::default(), Reversal::default()).state_at(1.0).q;
        let expected = [[1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [2.5, 0.0, 0.0], [3.0, 2.0, 0.0], [4.0, 2.0, 0.0]];
        for (found, expected) in later.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < 1e-4, "{later:?}");
        }
    }
}
