//! Laws chosen by images (method §6): the poses of a body at the times of the frames, as the images show
//! them, are free of the errors that a source model makes at the ends of a window, and of its smoothness; a
//! law is chosen for them as stage 1 chose one for the source's tracks.

use std::collections::BTreeMap;

use lgs_data::dataset::Frame;
use lgs_distill::{BodyPoses, DistilledLaw, PartLaws, known_impacts, law_of_poses, part_laws_of_poses};
use lgs_mechanics::Law;
use lgs_mechanics::bands::{Known, Verdict};
use lgs_model::{LagrangianScene, ObjectModel};
use rayon::prelude::*;

use super::drawn::{Drawn, decibels_between};
use super::image_couples::{Couple, couples};
use super::image_displacement::{Found, well_shown};
use super::image_hits::{Telling, Told, hits_by_others};
use super::image_poses::{ImagePoses, Part};
use super::law_choice::{LawChoice, Sought, own_law, take, turn_shapes};
use super::newton::squared_error_of;
use super::pose_search::displacements;
use super::recorded_bodies::{
    bodies_of, has_law, has_parts, recorded, with_poses_of_images, with_recorded_bodies,
};
use super::recorder::parts;
use super::thresholds::{MOST_GIVEN_BACK, ROUNDS_OF_HITS};

/// The scene with the laws that the images of some frames show, where there are any, and these do not draw
/// the images worse than the scene's own motion by more than a law may be below its source.
///
/// Objects without a law in generalised coordinates are offered one if they move like a rigid body, and take
/// it if it claims to explain or to describe them. Tells by how many decibels the images are drawn better.
pub(super) fn with_laws_of_images(
    scene: LagrangianScene,
    frames: &[&Frame],
    choice: LawChoice<'_>,
    has_time_for_parts: &dyn Fn() -> bool,
) -> (LagrangianScene, f64) {
    let config = choice.config;
    let times = times_in_window(frames);
    if times.first() != Some(&0.0) || !config.chooses_laws() {
        return (scene, 0.0);
    }
    let mut offered = bodies_of(&scene, &times);
    offered.retain(|(index, _)| choice.sought != Sought::Known || has_law(&scene.objects[*index]));
    if offered.is_empty() {
        return (scene, 0.0);
    }
    let recorded = with_recorded_bodies(&scene, &offered, &times);
    let poses = ImagePoses::new(&recorded, &times);
    let (offered, parts): (Vec<usize>, Vec<Vec<Part>>) = offered.into_iter().unzip();
    let found = displacements(&poses, &parts.concat(), frames);
    let mut found = found.iter();
    let found: Vec<Vec<&Vec<Found>>> =
        parts.iter().map(|parts| found.by_ref().take(parts.len()).collect()).collect();
    let bodies = parts.iter().zip(&found).map(|(parts, found)| poses.of_bodies(parts, found));
    let mut bodies: Vec<_> = offered.iter().copied().zip(bodies).collect();
    let before = squared_error_of(&scene, frames);
    let posed = with_poses_of_images((&scene, before), &mut bodies, frames);
    let shown = offered.iter().copied().zip(found.iter().map(|found| well_shown(found))).collect();
    let mut bodies = at_well_shown_times(bodies, &shown);
    let (offers, couples) = offers_and_couples(&scene, &mut bodies, choice, has_time_for_parts);
    let mut best = Drawn::new(posed, frames);
    offers.into_iter().for_each(|offer| best.take_if_near(offer.taken(&best.scene), 0.0));
    // Poses of each object follow the images in everything.
    let slack = MOST_GIVEN_BACK * (before - best.error).max(0.0);
    couples.into_iter().for_each(|couple| best.take_if_near(Some(couple.taken(&best.scene)), slack));
    (best.scene, decibels_between(best.error, before))
}

/// The distinct times of frames since t = 0, ascending.
fn times_in_window(frames: &[&Frame]) -> Vec<f32> {
    let mut times: Vec<f32> = frames.iter().map(|frame| frame.time).filter(|&time| time >= 0.0).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    times
}

/// The bodies of objects at the times at which images show them well, given by index for every object.
fn at_well_shown_times(bodies: Vec<ObjectPoses>, shown: &BTreeMap<usize, Vec<usize>>) -> Vec<ObjectPoses> {
    let at = |(object, bodies): ObjectPoses| {
        let bodies = bodies.into_iter().map(|body| body.at(&shown[&object]));
        (object, bodies.collect())
    };
    bodies.into_iter().map(at).collect()
}

/// What the poses of each object's bodies offer it: a law, through hits where others tell of them, or laws
/// of parts of the window; and the laws of two objects, which need none of parts.
fn offers_and_couples(
    scene: &LagrangianScene,
    bodies: &mut [ObjectPoses],
    choice: LawChoice<'_>,
    has_time_for_parts: &dyn Fn() -> bool,
) -> (Vec<Offer>, Vec<Couple>) {
    let offer =
        |(index, bodies): &ObjectPoses| Offer::new((scene, *index), bodies.clone(), choice.of_object(*index));
    let offers = first_offers(scene, bodies, &offer);
    let offers = with_hits((scene, offers), bodies, &offer);
    if choice.sought != Sought::All {
        return (offers, Vec::new());
    }
    let known = |object: usize| {
        let offer = offers.iter().find(|offer| offer.object == object)?;
        offer.law_or_own(&scene.objects[object])
    };
    let couples = couples(bodies, &known, choice);
    if !has_time_for_parts() {
        return (offers, couples);
    }
    let is_alone = |object: usize| !couples.iter().any(|couple| couple.has(object));
    (with_parts((scene, offers), bodies, choice, &is_alone), couples)
}

/// Offers with laws of parts of the window, for objects that are in no couple and have no law of all of it
/// that is trusted.
fn with_parts(
    (scene, offers): (&LagrangianScene, Vec<Offer>),
    bodies: &[ObjectPoses],
    choice: LawChoice<'_>,
    is_alone: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<Offer> {
    let with_parts = |(offer, (index, bodies)): (Offer, &ObjectPoses)| {
        if !is_alone(*index) {
            return offer;
        }
        offer.with_parts(&scene.objects[*index], bodies, choice.of_object(*index))
    };
    offers.into_par_iter().zip(bodies).map(with_parts).collect()
}

/// Index of an object, and the poses of its bodies as images show them.
type ObjectPoses = (usize, Vec<BodyPoses>);

/// What the poses of bodies offer by themselves: a law of all their times.
type OfBodies<'a> = &'a (dyn Fn(&ObjectPoses) -> Offer + Sync);

/// What bodies offer where only the laws of the scene tell of hits. A law through these comes first: it takes
/// less time than to find that no law describes the motion without them.
fn first_offers(scene: &LagrangianScene, bodies: &mut [ObjectPoses], offer: OfBodies<'_>) -> Vec<Offer> {
    let own = |(object, _): &ObjectPoses| own_law(&scene.objects[*object]).map(|own| &own.law);
    let laws: Vec<Telling<'_>> = bodies.iter().map(|body| Telling { shown: None, own: own(body) }).collect();
    let told = hits_by_others(bodies, &laws);
    let without_hits = |(object, bodies): &ObjectPoses| {
        let bodies = bodies.iter().map(|body| BodyPoses { hits: Vec::new(), ..body.clone() });
        offer(&(*object, bodies.collect()))
    };
    let through = through_hits(bodies, &told, offer);
    let first =
        |(through, body): (Option<Offer>, &ObjectPoses)| through.unwrap_or_else(|| without_hits(body));
    through.into_par_iter().zip(&*bodies).map(first).collect()
}

/// What bodies offer where others that they touch were struck, as far as the laws of these say so: a law
/// through hits at these times, if there is one. What is found tells of hits of others in turn.
fn with_hits(
    (scene, mut offers): (&LagrangianScene, Vec<Offer>),
    bodies: &mut [ObjectPoses],
    offer: OfBodies<'_>,
) -> Vec<Offer> {
    for _ in 0..ROUNDS_OF_HITS {
        let own = |object: usize| own_law(&scene.objects[object]).map(|own| &own.law);
        let laws: Vec<Telling<'_>> = offers
            .iter()
            .map(|offer| Telling { shown: offer.shown.as_ref(), own: own(offer.object) })
            .collect();
        let told = hits_by_others(bodies, &laws);
        let found = through_hits(bodies, &told, offer);
        if found.iter().all(Option::is_none) {
            break;
        }
        let hit = |(offer, hit): (Offer, Option<Offer>)| hit.unwrap_or(offer);
        offers = offers.into_iter().zip(found).map(hit).collect();
    }
    offers
}

/// The laws of bodies through hits of which they have been told and did not know, where these agree with what
/// was told. The bodies are given the hits.
fn through_hits(bodies: &mut [ObjectPoses], told: &[Told], offer: OfBodies<'_>) -> Vec<Option<Offer>> {
    for ((_, bodies), told) in bodies.iter_mut().zip(told) {
        let times = told.times();
        bodies.iter_mut().filter(|_| !times.is_empty()).for_each(|body| body.hits.clone_from(&times));
    }
    let through = |(body, told): (&ObjectPoses, &Told)| {
        let obeys = |law: &Law| is_struck(law) && told.agree_with(law);
        let found = (!told.are_known).then(|| offer(body));
        found.filter(|offer| offer.law_of_window().is_some_and(obeys))
    };
    bodies.par_iter().zip(told).map(through).collect()
}

/// What the poses of an object's bodies offer it.
struct Offer {
    object: usize,
    /// The law of all the window that they show.
    shown: Option<Law>,
    /// The same, if it may take the place of what the object has.
    law: Option<DistilledLaw>,
    /// Laws of parts of it, where none explains all of it, with the poses themselves.
    parts: Option<(PartLaws, BodyPoses)>,
}

impl Offer {
    /// A law of all the window, if there is one.
    fn new(
        (scene, object): (&LagrangianScene, usize),
        bodies: Vec<BodyPoses>,
        LawChoice { config, seed, .. }: LawChoice<'_>,
    ) -> Self {
        let own = &scene.objects[object];
        let end = bodies.first().and_then(|body| body.times.last()).copied().unwrap_or_default();
        let is_told = bodies.iter().any(|body| !body.hits.is_empty());
        let found = law_of_poses(bodies, config, seed);
        tracing::debug!(object, law = ?found.as_ref().map(|law| &law.law), "the law that images show");
        // In the place of laws of parts one of all the window has to forecast, or to go through hits of which
        // others tell: it is trusted once these are a contact.
        let is_enough = |law: &DistilledLaw| {
            !has_parts(own) || law.known.trusted[1] > end || (is_told && is_struck(&law.law))
        };
        let is_law =
            |law: &DistilledLaw| has_law(own) || (law.known.verdict != Verdict::Outside && is_enough(law));
        let shown = found.as_ref().map(|found| found.law.clone());
        Self { object, shown, law: found.filter(is_law), parts: None }
    }

    fn law_of_window(&self) -> Option<&Law> {
        self.law.as_ref().map(|law| &law.law)
    }

    /// The law of all the window that is offered, or else the object's own, and what is known of it.
    fn law_or_own<'a>(&'a self, own: &'a ObjectModel) -> Option<(&'a Law, &'a Known)> {
        let of_own = || own_law(own).map(|own| (&own.law, &own.known));
        self.law.as_ref().map(|law| (&law.law, &law.known)).or_else(of_own)
    }

    /// Laws of parts of the window in the place of one of all of it that is not trusted beyond it, where they
    /// forecast better; `own` is the object as it is.
    fn with_parts(
        self,
        own: &ObjectModel,
        bodies: &[BodyPoses],
        LawChoice { config, seed, .. }: LawChoice<'_>,
    ) -> Self {
        let [body] = bodies else { return self };
        let known = self.law_or_own(own);
        let end = body.times.last().copied().unwrap_or_default();
        let is_trusted = known.is_some_and(|(_, known)| known.trusted[1] > end);
        // A law through hits of which others tell needs no parts.
        let is_hit = !body.hits.is_empty() && self.law_of_window().is_some_and(is_struck);
        if is_trusted || is_hit || has_parts(own) {
            return self;
        }
        let impacts = known.map_or_else(Vec::new, |(law, known)| known_impacts(law, known));
        let parts = part_laws_of_poses(body.clone(), &impacts, config, seed);
        let is_better = known.is_none_or(|(_, known)| parts.forecast_better(known));
        if parts.is_empty() || !is_better {
            return self;
        }
        Self { law: None, parts: Some((parts, body.clone())), ..self }
    }

    /// The scene with what is offered; nothing if nothing is.
    fn taken(self, scene: &LagrangianScene) -> Option<LagrangianScene> {
        let mut other = scene.clone();
        if let Some(law) = self.law {
            take(law, &mut other, self.object);
            return Some(other);
        }
        let (laws, body) = self.parts?;
        let recording = recorded(&body, &body.poses.first()?.0)?.with_parts(parts(&laws));
        let members = other.objects[self.object].members.clone();
        other.dynamic_gaussians.means[members].copy_from_slice(recording.start());
        turn_shapes(&mut other, self.object, &body.poses[..1]);
        other.objects[self.object].recording = Some(recording);
        Some(other)
    }
}

/// Whether others strike a body, by its law.
fn is_struck(law: &Law) -> bool {
    !law.impulses.is_empty()
}
