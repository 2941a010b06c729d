//! Hits that the law of one body tells of and that of another one has not: who touches a body that is struck
//! is struck as well (method §5.9).

use lgs_distill::BodyPoses;
use lgs_mechanics::Law;
use lgs_mechanics::contact::{Impact, Origin, noticeable};

use super::thresholds::{SAME_HIT, TOUCHES};

/// Hits of a body of which others tell.
#[derive(Debug, PartialEq)]
pub(super) struct Told {
    /// Their times, ascending.
    pub(super) times: Vec<f64>,
    /// Whether the law that its images show has all of them, or has been sought through them.
    pub(super) are_known: bool,
}

/// Laws of an object that tell of hits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Telling<'a> {
    /// The one that its images show.
    pub(super) shown: Option<&'a Law>,
    /// The one that it has.
    pub(super) own: Option<&'a Law>,
}

impl Telling<'_> {
    /// Times at which the object is struck: by the law that images show, or if that has no hit, by its own.
    fn times(self) -> Vec<f64> {
        let of = |law: Option<&Law>| law.map(|law| struck(law).collect::<Vec<f64>>()).unwrap_or_default();
        Some(of(self.shown)).filter(|times| !times.is_empty()).unwrap_or_else(|| of(self.own))
    }
}

/// The hits of each of some bodies by others, as the laws of these have them, and those that it had before.
/// Objects of one rigid body each take part.
pub(super) fn hits_by_others(bodies: &[(usize, Vec<BodyPoses>)], laws: &[Telling<'_>]) -> Vec<Told> {
    let times: Vec<Vec<f64>> = laws.iter().map(|laws| laws.times()).collect();
    let of_body = |own: usize| {
        let Some(body) = single(&bodies[own]) else { return Told { times: Vec::new(), are_known: true } };
        let interval = interval(body);
        let mut hits = Vec::new();
        for (other, times) in times.iter().enumerate().filter(|(other, _)| *other != own) {
            let Some(other) = single(&bodies[other]) else { continue };
            hits.extend(times.iter().copied().filter(|&time| touch(body, other, time)));
        }
        // What it was found to be struck by is sought in its images as well, if there is another body.
        let is_near = |time: &f64| {
            let others = (0..bodies.len()).filter(|other| *other != own);
            others.filter_map(|other| single(&bodies[other])).any(|other| touch(body, other, *time))
        };
        hits.extend(times[own].iter().copied().filter(is_near));
        hits.sort_by(f64::total_cmp);
        hits.dedup_by(|next, last| *next - *last <= SAME_HIT * interval);
        let shown: &[Impact] = laws[own].shown.map_or(&[], Law::impulses);
        let known: Vec<f64> = shown.iter().map(|event| event.time).chain(body.hits.iter().copied()).collect();
        let is_known = |hit: &f64| known.iter().any(|time| (time - hit).abs() <= SAME_HIT * interval);
        Told { are_known: hits.iter().all(is_known), times: hits }
    };
    (0..bodies.len()).map(of_body).collect()
}

/// The body of an object that has one, which does not deform.
fn single((_, bodies): &(usize, Vec<BodyPoses>)) -> Option<&BodyPoses> {
    match bodies.as_slice() {
        [body] if !body.deforms && body.times.len() > 1 => Some(body),
        _ => None,
    }
}

/// Times of sudden changes of velocity by what may be another body: impulses, or impacts on a plane that
/// nothing at rest shows.
fn struck(law: &Law) -> impl Iterator<Item = f64> {
    let events: &[Impact] = match &law.contact {
        Some(contact) if contact.origin != Origin::Fitted || !contact.walls.is_empty() => &[],
        _ => &law.events,
    };
    noticeable(events).map(|event| event.time)
}

fn interval(body: &BodyPoses) -> f64 {
    let [first, last] = [body.times[0], body.times[body.times.len() - 1]];
    (last - first) / (body.times.len() - 1) as f64
}

/// Whether two bodies are so near to each other at a time that they may touch.
fn touch(one: &BodyPoses, other: &BodyPoses, time: f64) -> bool {
    let sample = one.times.partition_point(|sample| *sample < time).min(one.poses.len() - 1);
    let radius = |body: &BodyPoses| {
        let square = body.shape.iter().map(|point| point.length_squared()).sum::<f64>();
        (square / body.shape.len().max(1) as f64).sqrt()
    };
    let distance = one.poses[sample].1.distance(other.poses[sample.min(other.poses.len() - 1)].1);
    distance <= TOUCHES * (radius(one) + radius(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use lgs_mechanics::coordinates::Coordinates;

    /// A ball of radius 0.3 that slides along x.
    fn ball(index: usize, start: f64, velocity: f64) -> (usize, Vec<BodyPoses>) {
        let times: Vec<f64> = (0..41).map(|k| 0.02 * f64::from(k)).collect();
        let pose = |&t: &f64| (DMat3::IDENTITY, DVec3::X * (start + velocity * t));
        let body = BodyPoses {
            poses: times.iter().map(pose).collect(),
            times,
            deforms: false,
            shape: [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|p| [0.3 * p, -0.3 * p]).collect(),
            slow_error: 0.0,
            surroundings: Vec::new(),
            hits: Vec::new(),
        };
        (index, vec![body])
    }

    fn struck_at(times: &[f64]) -> Law {
        let event = |&time: &f64| Impact { time, change: vec![1.0, 0.0, 0.0] };
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.02).expect("a law");
        Law { events: times.iter().map(event).collect(), ..law }
    }

    #[test]
    fn a_body_is_hit_when_one_that_it_touches_is_struck() {
        let bodies = [ball(0, 0.0, 1.0), ball(1, 1.0, 0.0), ball(2, 5.0, 0.0)];
        let laws = [struck_at(&[0.4]), struck_at(&[]), struck_at(&[0.2])];
        let told = |times: &[f64], are_known| Told { times: times.to_vec(), are_known };
        let shown = |law| Telling { shown: Some(law), own: None };
        let none = Telling::default();
        let hits = hits_by_others(&bodies, &[shown(&laws[0]), shown(&laws[1]), shown(&laws[2])]);
        assert_eq!(hits, [told(&[0.4], true), told(&[0.4], false), told(&[], true)]);
        assert_eq!(hits_by_others(&bodies, &[shown(&laws[0]), none, none])[1], told(&[0.4], false));
        let known = struck_at(&[0.41]);
        let hits = hits_by_others(&bodies, &[shown(&laws[0]), shown(&known), none]);
        assert_eq!(hits[..2], [told(&[0.4], true), told(&[0.4], true)]);
        // A hit that the tracks of a source have shown is sought in images that do not show it by themselves.
        let own = Telling { shown: Some(&laws[1]), own: Some(&laws[0]) };
        let hits = hits_by_others(&bodies, &[own, none, none]);
        assert_eq!(hits, [told(&[0.4], false), told(&[0.4], false), told(&[], true)]);
        let mut sought = bodies;
        sought[0].1[0].hits = vec![0.41];
        assert_eq!(hits_by_others(&sought, &[own, none, none])[0], told(&[0.4], true));
    }
}
