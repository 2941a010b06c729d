//! Hits that the law of one body tells of and that of another one has not: who touches a body that is struck
//! is struck as well (method §5.9).

use glam::DVec3;
use lgs_distill::BodyPoses;
use lgs_mechanics::Law;
use lgs_mechanics::contact::{Contact, Impact, Origin, noticeable};
use lgs_mechanics::coordinates::Coordinates;

use super::thresholds::{OPPOSITE, SAME_HIT, TOUCHES};

/// Hits of a body of which others tell, or its own law.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Told {
    /// As each of them tells it, in the order of times.
    hits: Vec<VelocityJump>,
    /// Times that differ by no more are one hit.
    within: f64,
    /// Whether the law that its images show has all of them, or has been sought through them.
    pub(super) are_known: bool,
}

impl Told {
    /// The times of the hits, ascending.
    pub(super) fn times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.hits.iter().map(|hit| hit.time).collect();
        times.dedup_by(|next, last| *next - *last <= self.within);
        times
    }

    /// Whether a law has the body struck as one of those who tell of it was: with the opposite impulse.
    pub(super) fn agree_with(&self, law: &Law) -> bool {
        let is_told = |own: VelocityJump| {
            let mut told = self.hits.iter().filter(|hit| hit.is_at(own.time, self.within)).peekable();
            told.peek().is_none() || told.any(|hit| own.can_be_one_hit_with(hit))
        };
        jumps(law, &law.impulses).all(is_told)
    }
}

/// A sudden change of a body's velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
struct VelocityJump {
    time: f64,
    /// Change of the velocity of the centre, where that is free and known.
    change: Option<DVec3>,
}

impl VelocityJump {
    fn is_at(&self, time: f64, within: f64) -> bool {
        (self.time - time).abs() <= within
    }

    /// Whether two bodies may have struck each other, by the change of velocity of each: their impulses are
    /// opposite. A body on a joint gets one from there as well, and may have been struck by any.
    fn can_be_one_hit_with(&self, other: &Self) -> bool {
        let Some((own, other)) = self.change.zip(other.change) else { return true };
        own.dot(other) <= OPPOSITE * own.length() * other.length()
    }
}

/// Laws of an object that tell of hits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Telling<'a> {
    /// The one that its images show.
    pub(super) shown: Option<&'a Law>,
    /// The one that it has.
    pub(super) own: Option<&'a Law>,
}

impl<'a> Telling<'a> {
    /// The law that tells of what strikes the object and may be another body: the one that images show, or if
    /// that has no hit, its own.
    fn law(self) -> Option<&'a Law> {
        self.shown.filter(|law| !struck(law).is_empty()).or(self.own)
    }

    /// What strikes the object at a time, another body or a plane.
    fn at(self, time: f64, within: f64) -> Option<VelocityJump> {
        let of = |law: &Law| {
            let events: Vec<Impact> = law.events().cloned().collect();
            jumps(law, &events).find(|jump| jump.is_at(time, within))
        };
        self.shown.and_then(of).or_else(|| self.own.and_then(of))
    }
}

/// The hits of each of some bodies by others, as the laws of these have them, and those that it had before.
/// Objects of one rigid body each take part.
pub(super) fn hits_by_others(bodies: &[(usize, Vec<BodyPoses>)], laws: &[Telling<'_>]) -> Vec<Told> {
    let jumps = laws.iter().map(|laws| laws.law().map_or_else(Vec::new, struck)).collect();
    let among = Among { bodies: bodies.iter().map(single).collect(), laws, jumps };
    (0..bodies.len()).map(|own| among.told_of(own)).collect()
}

/// Bodies, and what strikes each.
struct Among<'a> {
    bodies: Vec<Option<&'a BodyPoses>>,
    laws: &'a [Telling<'a>],
    jumps: Vec<Vec<VelocityJump>>,
}

impl Among<'_> {
    fn told_of(&self, own: usize) -> Told {
        let Some(body) = self.bodies[own] else { return Told { are_known: true, ..Told::default() } };
        let within = SAME_HIT * interval(body);
        let others = (0..self.bodies.len()).filter(|other| *other != own);
        let mut hits: Vec<VelocityJump> = others.flat_map(|other| self.told_by(other, own, within)).collect();
        hits.extend(self.own_hits(own));
        hits.sort_by(|a, b| a.time.total_cmp(&b.time));
        let shown: &[Impact] = self.laws[own].shown.map_or(&[], |law| &law.impulses);
        let known: Vec<f64> = shown.iter().map(|event| event.time).chain(body.hits.iter().copied()).collect();
        let is_known = |hit: &VelocityJump| known.iter().any(|time| hit.is_at(*time, within));
        Told { are_known: hits.iter().all(is_known), hits, within }
    }

    /// What strikes another body while a body touches it that was not struck differently then.
    fn told_by(&self, other: usize, own: usize, within: f64) -> impl Iterator<Item = VelocityJump> {
        let may_be = move |hit: &VelocityJump| {
            let known = self.laws[own].at(hit.time, within);
            self.touch(own, other, hit.time) && known.is_none_or(|known| known.can_be_one_hit_with(hit))
        };
        self.jumps[other].iter().copied().filter(may_be)
    }

    /// What its own law has strike a body, but no plane, where another one is near: sought in images that do
    /// not show it by themselves.
    fn own_hits(&self, own: usize) -> impl Iterator<Item = VelocityJump> {
        let touches_any =
            move |time: f64| (0..self.bodies.len()).any(|other| other != own && self.touch(own, other, time));
        let impulses = self.laws[own].law().into_iter().flat_map(|law| jumps(law, &law.impulses));
        let touching = impulses.filter(move |jump| touches_any(jump.time));
        touching.map(|jump| VelocityJump { change: None, ..jump })
    }

    fn touch(&self, own: usize, other: usize, time: f64) -> bool {
        self.bodies[own].zip(self.bodies[other]).is_some_and(|(own, other)| touch(own, other, time))
    }
}

/// The body of an object that has one, which does not deform.
fn single((_, bodies): &(usize, Vec<BodyPoses>)) -> Option<&BodyPoses> {
    match bodies.as_slice() {
        [body] if !body.deforms && body.times.len() > 1 => Some(body),
        _ => None,
    }
}

/// Sudden changes of velocity by what may be another body: impulses, or impacts on a plane that nothing at
/// rest shows.
fn struck(law: &Law) -> Vec<VelocityJump> {
    let is_other = |contact: &Contact| contact.origin == Origin::Fitted && contact.walls.is_empty();
    let may_be_another = law.contact.as_ref().is_some_and(is_other);
    let impacts = law.impacts.iter().filter(|_| may_be_another);
    let events: Vec<Impact> = impacts.chain(&law.impulses).cloned().collect();
    jumps(law, &events).collect()
}

/// Events of a law that are not small beside the largest one.
fn jumps<'a>(law: &'a Law, events: &'a [Impact]) -> impl Iterator<Item = VelocityJump> + 'a {
    let is_free = matches!(law.coordinates, Coordinates::Point | Coordinates::Rigid(_));
    let change = move |event: &Impact| {
        let of_center = event.change.last_chunk::<3>().copied();
        of_center.filter(|_| is_free).map(DVec3::from)
    };
    noticeable(events).map(move |event| VelocityJump { time: event.time, change: change(event) })
}

fn interval(body: &BodyPoses) -> f64 {
    let [first, last] = [body.times[0], body.times[body.times.len() - 1]];
    (last - first) / (body.times.len() - 1) as f64
}

/// Whether two bodies are so near to each other at a time that they may touch.
fn touch(one: &BodyPoses, other: &BodyPoses, time: f64) -> bool {
    let place = |body: &BodyPoses| {
        body.poses[body.times.partition_point(|sample| *sample < time).min(body.poses.len() - 1)].1
    };
    let radius = |body: &BodyPoses| {
        let square = body.shape.iter().map(|point| point.length_squared()).sum::<f64>();
        (square / body.shape.len().max(1) as f64).sqrt()
    };
    place(one).distance(place(other)) <= TOUCHES * (radius(one) + radius(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

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
            deviations: Vec::new(),
            hits: Vec::new(),
        };
        (index, vec![body])
    }

    fn law_with(time: f64, change: [f64; 3]) -> Law {
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.02).expect("a law");
        Law { impulses: vec![Impact { time, change: change.to_vec() }], ..law }
    }

    fn shown(law: &Law) -> Telling<'_> {
        Telling { shown: Some(law), own: None }
    }

    /// Times of hits of each body, and whether all of them are known.
    fn told(bodies: &[(usize, Vec<BodyPoses>)], laws: &[Telling<'_>]) -> Vec<(Vec<f64>, bool)> {
        hits_by_others(bodies, laws).iter().map(|told| (told.times(), told.are_known)).collect()
    }

    #[test]
    fn a_body_is_hit_when_one_that_it_touches_is_struck() {
        let bodies = [ball(0, 0.0, 1.0), ball(1, 1.0, 0.0), ball(2, 5.0, 0.0)];
        let [first, far] = [law_with(0.4, [1.0, 0.0, 0.0]), law_with(0.2, [1.0, 0.0, 0.0])];
        let quiet = Law { impulses: Vec::new(), ..first.clone() };
        let none = Telling::default();
        let hits = told(&bodies, &[shown(&first), shown(&quiet), shown(&far)]);
        assert_eq!(hits, [(vec![0.4], true), (vec![0.4], false), (vec![], true)]);
        assert_eq!(told(&bodies, &[shown(&first), none, none])[1], (vec![0.4], false));
        let known = law_with(0.41, [-1.0, 0.1, 0.0]);
        let hits = told(&bodies, &[shown(&first), shown(&known), none]);
        assert_eq!(hits[..2], [(vec![0.4], true), (vec![0.4], true)]);
        // A hit that the tracks of a source have shown is sought in images that do not show it by themselves.
        let own = Telling { shown: Some(&quiet), own: Some(&first) };
        let hits = told(&bodies, &[own, none, none]);
        assert_eq!(hits, [(vec![0.4], false), (vec![0.4], false), (vec![], true)]);
        let mut sought = bodies;
        sought[0].1[0].hits = vec![0.41];
        assert_eq!(told(&sought, &[own, none, none])[0], (vec![0.4], true));
    }

    #[test]
    fn bodies_whose_impulses_are_not_opposite_have_not_struck_each_other() {
        // A ball that bounces, and its shadow, whose path has a kink at the same time.
        let bodies = [ball(0, 0.0, 1.0), ball(1, 1.0, 0.0)];
        let [up, along] = [law_with(0.4, [0.0, 0.0, 2.0]), law_with(0.4, [1.0, 0.0, 0.0])];
        let none = Telling::default();
        let hits = hits_by_others(&bodies, &[shown(&up), shown(&along)]);
        assert_eq!(hits[1].hits, [VelocityJump { time: 0.4, change: None }], "its own alone");
        // A law that was found through a hit has to have the opposite impulse, too.
        let hits = hits_by_others(&bodies, &[shown(&up), none]);
        assert!(!hits[1].agree_with(&along) && hits[1].agree_with(&law_with(0.41, [0.1, 0.0, -1.0])));
        assert!(hits[1].agree_with(&law_with(0.1, [1.0, 0.0, 0.0])), "nobody tells of that one");
    }
}
