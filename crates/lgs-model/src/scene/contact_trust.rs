//! How far forecasts are trusted, of edited objects and of those that hit each other: all of these move
//! together, by laws drawn for each and a contact drawn with them (method §5.9).

use lgs_dynamics::Edit;
use lgs_mechanics::bands::{PosteriorLaws, Verdict};

use super::contact::known_until;
use super::generalised::exact;
use super::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectContact};

impl LagrangianScene {
    /// Objects whose edits change the motion of one: itself, and those that it may hit; of a shadow those of
    /// the object that casts it.
    #[must_use]
    pub fn moved_with(&self, object: usize) -> Vec<usize> {
        let object = self.caster_of(object).unwrap_or(object);
        let mut contact = self.contact.iter().map(|contact| &contact.objects);
        contact.find(|objects| objects.contains(&object)).cloned().unwrap_or_else(|| vec![object])
    }

    /// Times between which the forecasts of some objects under an edit of each of the scene are trusted, by
    /// the laws that are drawn from what is known of their motion; nothing where there are none.
    #[must_use]
    pub fn trusted_under(&self, objects: &[usize], edits: &[Edit]) -> Vec<Option<[f64; 2]>> {
        let own = |&object: &usize| self.caster_of(object).unwrap_or(object);
        let objects: Vec<usize> = objects.iter().map(own).collect();
        let is_asked = |contact: &&ObjectContact| contact.objects.iter().any(|own| objects.contains(own));
        let contact = self.contact.as_ref().filter(is_asked);
        let struck = contact.map(|contact| self.posterior_with_hits(contact, edits));
        let trusted = |&object: &usize| {
            let (dynamics, edit) = (self.objects.get(object)?.dynamics.generalised()?, *edits.get(object)?);
            let place = contact.and_then(|contact| contact.objects.iter().position(|own| *own == object));
            let changed = match place.zip(struck.as_ref()) {
                Some((place, struck)) => struck.as_ref()?.get(place)?,
                None => dynamics.known.posterior.as_ref()?,
            };
            let points = self.dynamic_gaussians.means.get(self.objects[object].members.clone())?;
            let GeneralisedDynamics { law, start, bodies, known } = dynamics;
            known.trusted_by(changed, exact(edit), (law, start), (bodies, points))
        };
        objects.iter().map(trusted).collect()
    }

    /// The scene with the bands of objects that hit each other going on after the window by the hits that
    /// follow. An object is trusted beyond it then if all that strikes it is hits.
    #[must_use]
    pub fn with_bands_of_hits(mut self) -> Self {
        let edits = vec![Edit::default(); self.objects.len()];
        let struck = self.contact.as_ref().and_then(|contact| self.posterior_with_hits(contact, &edits));
        let Some((contact, struck)) = self.contact.as_ref().zip(struck) else { return self };
        let window = f64::from(self.motion.time_window);
        for ((&object, round), struck) in contact.objects.iter().zip(&contact.contact.bodies).zip(&struck) {
            let points = &self.dynamic_gaussians.means[self.objects[object].members.clone()];
            let Dynamics::Generalised(dynamics) = &mut self.objects[object].dynamics else { continue };
            let GeneralisedDynamics { law, start, bodies, known } = dynamics;
            let is_struck_by_others = round.hits.len() == law.impulses.len();
            let radius = known.radius_by(struck, lgs_mechanics::Edit::NONE, (law, start), (bodies, points));
            let Some(mut radius) = radius.filter(|_| is_struck_by_others) else { continue };
            if known.verdict == Verdict::Outside {
                continue;
            }
            let times = known.band.times.clone();
            let own = known.band.radius.iter().map(|radius| radius.unwrap_or(f64::INFINITY));
            let in_window = radius.iter_mut().zip(own).zip(&times).filter(|(_, time)| **time <= window);
            in_window.for_each(|((radius, own), _)| *radius = own);
            known.take_band_with_hits((&times, &radius), window, struck.path);
        }
        self
    }

    /// Laws drawn for the objects of a contact, with the hits that follow under edits.
    fn posterior_with_hits(&self, contact: &ObjectContact, edits: &[Edit]) -> Option<Vec<PosteriorLaws>> {
        let own = |&object: &usize| {
            let known = &self.law_of_body(object)?.known;
            Some((known.posterior.as_ref()?, exact(*edits.get(object)?), known.band.times.last()?))
        };
        let own = contact.objects.iter().map(own).collect::<Option<Vec<_>>>()?;
        let until = own.iter().map(|(.., until)| **until).fold(0.0, f64::max);
        let bodies: Vec<(&PosteriorLaws, lgs_mechanics::Edit)> =
            own.into_iter().map(|(posterior, edit, _)| (posterior, edit)).collect();
        contact.contact.with_hits(&contact.drawn, &bodies, [known_until(self, edits), until])
    }
}

#[cfg(test)]
mod tests {
    use lgs_mechanics::Law;
    use lgs_mechanics::bands::{DrawnLaws, PositionBand, StartedLaw};

    use super::*;
    use crate::scene::contact_testing::row;

    /// The row of balls, with laws drawn whose velocities differ by a part, and contacts whose restitution
    /// differs by as much.
    fn drawn(part: f64) -> LagrangianScene {
        let mut scene = row();
        let times: Vec<f64> = (-8..=24).map(|i| 0.125 * f64::from(i)).collect();
        for object in &mut scene.objects {
            let Dynamics::Generalised(dynamics) = &mut object.dynamics else { continue };
            let started = |by: f64| {
                let (mut law, mut start) = (dynamics.law.clone(), dynamics.start.clone());
                start.v.iter_mut().for_each(|v| *v *= 1.0 + by);
                law.impulses.iter_mut().flat_map(|hit| &mut hit.change).for_each(|v| *v *= 1.0 + by);
                StartedLaw { law, start }
            };
            let drawn = vec![started(-part), started(part)];
            let laws = vec![DrawnLaws { middle: started(0.0), order: vec![0], part: 1.0, drawn }];
            let known = &mut dynamics.known;
            known.posterior = Some(PosteriorLaws { laws, window: 1.0, path: 1.0, radius: 1e-3 });
            known.band = PositionBand { radius: vec![Some(1e-3); times.len()], times: times.clone() };
            (known.verdict, known.trusted) = (Verdict::Described, [-1.0, 1.0]);
        }
        let contact = scene.contact.as_mut().expect("a contact");
        let bouncing = |restitution: f64| lgs_mechanics::mutual_contact::MutualContact {
            restitution,
            ..contact.contact.clone()
        };
        contact.drawn = vec![bouncing(1.0 - part), bouncing(1.0)];
        scene
    }

    fn trusted(scene: &LagrangianScene) -> Vec<(Verdict, f64)> {
        let of = |object: &crate::scene::ObjectModel| {
            let known = &object.dynamics.generalised().expect("a law").known;
            (known.verdict, known.trusted[1])
        };
        scene.objects.iter().map(of).collect()
    }

    #[test]
    fn bodies_are_trusted_past_the_window_as_far_as_drawn_hits_agree() {
        let sure = trusted(&drawn(1e-3).with_bands_of_hits());
        assert_eq!(sure, [(Verdict::Explained, 3.0); 3]);
        // The first ball stays where it was hit; what it hit goes on to the third, by more or less than it.
        let unsure = trusted(&drawn(0.1).with_bands_of_hits());
        assert!(unsure[2].0 == Verdict::Described && unsure[2].1 < 1.6, "{unsure:?}");
    }

    #[test]
    fn a_body_that_something_else_strikes_is_not_trusted_past_the_window() {
        let mut scene = drawn(1e-3);
        let push = |law: &mut Law| law.impulses[0].time = 0.6;
        if let Dynamics::Generalised(dynamics) = &mut scene.objects[1].dynamics {
            push(&mut dynamics.law);
        }
        scene.contact.as_mut().expect("a contact").contact.bodies[1].hits.clear();
        assert_eq!(trusted(&scene.with_bands_of_hits())[1], (Verdict::Described, 1.0));
    }

    #[test]
    fn an_edit_of_one_body_is_one_of_all_that_it_may_hit() {
        let scene = drawn(0.02).with_bands_of_hits();
        assert_eq!((scene.moved_with(1), scene.moved_with(7)), (vec![0, 1, 2], vec![7]));
        let edits = |velocity_scale: f32| {
            let mut edits = vec![Edit::default(); 3];
            edits[0].velocity_scale = velocity_scale;
            edits
        };
        let until = |scale: f32| scene.trusted_under(&[2], &edits(scale))[0].expect("draws")[1];
        let [slow, fast] = [0.25, 3.0].map(until);
        assert!(fast < slow, "hit later, its motion is known for longer: {slow}, {fast}");
    }
}
