//! Objects that hit each other: their laws between the hits, and the hits as they follow.

use std::borrow::Cow;

use lgs_dynamics::Edit;
use lgs_mechanics::contact::Impact;
use lgs_mechanics::mutual_contact::{Moving, MutualContact};
use lgs_mechanics::{Law, MechanicsError};
use serde::{Deserialize, Serialize};

use super::generalised::exact;
use super::{GeneralisedDynamics, LagrangianScene};
use crate::thresholds::RESOLVED_WINDOWS;

/// Objects of a scene that hit each other (method §5.9).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectContact {
    /// The objects, ascending, in the order of the contact's bodies.
    pub objects: Vec<usize>,
    /// Their spheres, masses, restitution and friction.
    pub contact: MutualContact,
    /// Others like it, drawn from what is known of it.
    #[serde(default)]
    pub drawn: Vec<MutualContact>,
    /// Whether hits in the captured window are those that the laws have, as long as no object is edited; else
    /// all hits are those that follow.
    pub replays_window: bool,
}

impl ObjectContact {
    /// What is wrong with it in a scene of some objects; nothing if it fits.
    pub(super) fn misfit(&self, scene: &LagrangianScene) -> Option<String> {
        let all = || std::iter::once(&self.contact).chain(&self.drawn);
        if let Some(error) = all().find_map(|contact| contact.check().err()) {
            return Some(error.to_string());
        }
        if let Some(drawn) = self.drawn.iter().find(|drawn| !self.contact.has_hits_of(drawn)) {
            return Some(format!("a drawn contact with other hits or bodies: {:?}", drawn.bodies));
        }
        if self.objects.len() != self.contact.bodies.len() {
            return Some(format!("{} objects, {} bodies", self.objects.len(), self.contact.bodies.len()));
        }
        if self.objects.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Some("objects that do not ascend".to_owned());
        }
        let misfit = |(&object, hits): (&usize, &Vec<usize>)| match scene.law_of_body(object) {
            None => Some(format!("object {object}, which has no law of a single body")),
            Some(GeneralisedDynamics { law, .. }) => {
                let (absent, count) =
                    (hits.iter().find(|hit| **hit >= law.impulses.len()), law.impulses.len());
                absent.map(|hit| format!("impulse {hit} of object {object}, which has {count}"))
            }
        };
        self.objects.iter().zip(self.contact.bodies.iter().map(|body| &body.hits)).find_map(misfit)
    }
}

impl LagrangianScene {
    /// The law of an object that may hit others: of a single body, and not recorded.
    #[must_use]
    pub fn law_of_body(&self, object: usize) -> Option<&GeneralisedDynamics> {
        let object = self.objects.get(object).filter(|object| object.recording.is_none())?;
        let of_body = |dynamics: &&GeneralisedDynamics| dynamics.law.coordinates.bodies() == 1;
        object.dynamics.generalised().filter(of_body)
    }
}

/// The laws by which the objects of an edited scene move, where these are not their own.
pub(super) struct EditedLaws {
    /// Laws of edited objects whose motion needs a finer step.
    resolved: Vec<Option<Law>>,
    /// The same with the hits that follow from the edit, or after the captured window.
    hit: Vec<Option<Law>>,
    /// Time up to which hits are known.
    until: f64,
}

impl EditedLaws {
    pub(super) fn new(scene: &LagrangianScene, edits: &[Edit]) -> Self {
        let until = RESOLVED_WINDOWS * f64::from(scene.motion.time_window);
        let resolve = |(object, &edit): (&super::ObjectModel, &Edit)| match object
            .dynamics
            .generalised()?
            .law_under(edit, until)
        {
            Cow::Owned(law) => Some(law),
            Cow::Borrowed(_) => None,
        };
        let resolved: Vec<Option<Law>> = scene.objects.iter().zip(edits).map(resolve).collect();
        Self { hit: resolved.clone(), resolved, until: known_until(scene, edits) }
    }

    /// The law of an object; nothing where it is its own.
    pub(super) fn of(&self, object: usize) -> Option<&Law> {
        self.hit[object].as_ref()
    }

    /// Finds hits up to a time. Where a motion cannot be followed so far, the bodies pass through each other.
    pub(super) fn follow(&mut self, scene: &LagrangianScene, edits: &[Edit], until: f64) {
        let Some(ObjectContact { objects, contact, .. }) =
            scene.contact.as_ref().filter(|_| until > self.until)
        else {
            return;
        };
        self.until = until.max(2.0 * self.until).max(f64::from(scene.motion.time_window));
        let own = |&object: &usize| Some((object, scene.law_of_body(object)?));
        let Some(bodies) = objects.iter().map(own).collect::<Option<Vec<_>>>() else { return };
        let law = |object: usize| self.resolved[object].as_ref();
        let motions: Vec<Moving<'_>> = bodies
            .iter()
            .map(|&(object, GeneralisedDynamics { law: own, start, .. })| Moving {
                law: law(object).unwrap_or(own),
                start,
                edit: exact(edits[object]),
            })
            .collect();
        let span = [known_until(scene, edits), self.until];
        let impulses: Result<Vec<Vec<Impact>>, MechanicsError> = contact.impulses(&motions, span);
        for ((object, dynamics), impulses) in bodies.into_iter().zip(impulses.unwrap_or_default()) {
            let law = self.resolved[object].as_ref().unwrap_or(&dynamics.law).clone();
            self.hit[object] = Some(Law { impulses, ..law });
        }
    }
}

/// Time up to which the hits are those that the laws have.
pub(super) fn known_until(scene: &LagrangianScene, edits: &[Edit]) -> f64 {
    let is_edited = |contact: &ObjectContact| {
        !contact.replays_window || contact.objects.iter().any(|&object| edits[object] != Edit::default())
    };
    if scene.contact.as_ref().is_some_and(is_edited) { 0.0 } else { f64::from(scene.motion.time_window) }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use lgs_dynamics::Reversal;

    use super::*;
    use crate::scene::contact_testing::row;
    use crate::scene::{Motion, scene_from_tensors, scene_to_tensors};

    fn places(scene: &LagrangianScene, edit: Edit, time: f32) -> Vec<f32> {
        let state = Motion::new(scene, edit, Reversal::default()).state_at(time);
        state.q.iter().map(|q| q[0]).collect()
    }

    fn are_near(found: &[f32], expected: [f32; 3]) -> bool {
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-4)
    }

    #[test]
    fn objects_hit_each_other_after_the_window_and_under_edits() {
        let scene = row();
        let found = places(&scene, Edit::default(), 2.0);
        assert!(are_near(&found, [0.4, 2.0, 3.2]), "{found:?}");
        let twice = Edit { velocity_scale: 2.0, ..Edit::default() };
        let found = places(&scene, twice, 0.9);
        assert!(are_near(&found, [0.4, 2.0, 3.0]), "{found:?}");
        let half = Edit { velocity_scale: 0.5, ..Edit::default() };
        assert!(are_near(&places(&scene, half, 0.7), [0.35, 1.0, 2.6]), "none has been hit yet");
        let past = places(&scene, Edit::default(), -1.0);
        assert!(are_near(&past, [-1.0, 1.0, 2.6]), "{past:?}");
    }

    #[test]
    fn times_may_be_asked_for_in_any_order() {
        let scene = row();
        let mut motion = Motion::new(&scene, Edit::default(), Reversal::default());
        let times = [0.5, 9.0, 1.2, 2.0];
        let any: Vec<_> = times.map(|time| motion.state_at(time).q).to_vec();
        let each =
            times.map(|time| Motion::new(&scene, Edit::default(), Reversal::default()).state_at(time).q);
        let apart = any.iter().flatten().zip(each.iter().flatten()).map(|(a, b)| (a[0] - b[0]).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-5);
    }

    #[test]
    fn a_contact_is_kept_in_the_file_and_one_that_does_not_fit_is_refused() {
        let scene = row();
        let read = |scene: &LagrangianScene| {
            scene_from_tensors(&scene_to_tensors(scene, "test"), Path::new("scene"))
                .map(|scene| scene.contact)
        };
        assert_eq!(read(&scene).expect("a scene"), scene.contact);
        let wrong = |change: &dyn Fn(&mut ObjectContact)| {
            let mut scene = row();
            change(scene.contact.as_mut().expect("a contact"));
            read(&scene).expect_err("refused").to_string()
        };
        let cases = [
            (wrong(&|contact| contact.objects[2] = 5), "object 5"),
            (wrong(&|contact| contact.objects.swap(0, 1)), "ascend"),
            (wrong(&|contact| contact.objects.truncate(2)), "2 objects, 3 bodies"),
            (
                wrong(&|contact| contact.contact.bodies[2].hits = vec![0]),
                "impulse 0 of object 2, which has 0",
            ),
            (wrong(&|contact| contact.contact.bodies[1].radius = 0.0), "radius of a body"),
            (wrong(&|contact| contact.contact.restitution = 1.5), "restitution is 1.5"),
        ];
        for (message, expected) in cases {
            assert!(message.contains(expected) && message.contains("contact"), "{message}");
        }
    }
}
