//! Motions of bodies that hit each other, found from hit to hit.

use super::hit::{Struck, impulse};
use super::thresholds::{AFTER, HALVINGS, LEAST_LOOKS, LOOK, LOOKS, MOST_HITS, MOST_LOOKS};
use super::{MutualContact, RoundBody};
use crate::contact::Impact;
use crate::coordinates::{Embedding, State};
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::law::Law;
use crate::system::System;
use glam::DVec3;

/// How one of the bodies moves when no other one hits it.
#[derive(Clone, Copy, Debug)]
pub struct Moving<'a> {
    /// Its law; the impulses of it are those of its own motion.
    pub law: &'a Law,
    /// Configuration and velocity at t = 0.
    pub start: &'a State,
    /// Scales of its motion.
    pub edit: Edit,
}

/// A body with the impulses that it has got so far.
struct Follower<'a> {
    of: Moving<'a>,
    law: Law,
    round: &'a RoundBody,
}

impl Follower<'_> {
    fn states(&self, times: &[f64]) -> Result<Vec<State>, MechanicsError> {
        System::new(&self.law, self.of.edit).states(self.of.start, times)
    }

    fn state(&self, time: f64) -> Result<State, MechanicsError> {
        Ok(self.states(&[time])?.remove(0))
    }

    /// Where the centre of its sphere is.
    fn center(&self, state: &State) -> DVec3 {
        let embedding = Embedding::new(&self.law.coordinates, &self.of.start.x);
        embedding.placements(&state.x)[0].apply(self.round.center.into())
    }

    /// The speed of that centre.
    fn speed(&self, state: &State) -> f64 {
        let embedding = Embedding::new(&self.law.coordinates, &self.of.start.x);
        embedding.rates(&state.x, &state.v)[0].apply(self.round.center.into()).length()
    }

    /// Adds an impulse in the order of time, a little later than one of the same time.
    fn meet(&mut self, mut impulse: Impact, after: f64) {
        let impulses = &mut self.law.impulses;
        let place = impulses.partition_point(|other| other.time <= impulse.time);
        if let Some(before) = place.checked_sub(1).map(|i| impulses[i].time) {
            impulse.time = impulse.time.max(before + after);
        }
        impulses.insert(place, impulse);
    }
}

/// Two bodies that touch at a time.
struct Hit {
    pair: [usize; 2],
    time: f64,
    /// Speed at which those part that have touched before and lean on each other: by which they would be out
    /// of each other at the next look.
    lifted: Option<f64>,
}

impl MutualContact {
    /// The impulses of each body up to a time: its own ones, hits by other bodies up to `since` as its law
    /// has them, and from then on the hits that follow.
    ///
    /// # Errors
    /// If there are not as many motions as bodies, or one cannot be followed.
    pub fn impulses(
        &self,
        motions: &[Moving<'_>],
        [since, until]: [f64; 2],
    ) -> Result<Vec<Vec<Impact>>, MechanicsError> {
        if motions.len() != self.bodies.len() {
            let (what, found) = ("motions of the bodies of a contact".to_owned(), motions.len());
            return Err(MechanicsError::Size { what, expected: self.bodies.len(), found });
        }
        let mut bodies: Vec<Follower<'_>> =
            motions.iter().zip(&self.bodies).map(|(&of, round)| follower(of, round, since)).collect();
        let (mut time, mut last) = (since, None);
        for _ in 0..MOST_HITS {
            let Some(hit) = self.next_hit((&bodies, last), [time, until])? else { break };
            self.strike(&mut bodies, &hit, AFTER * until)?;
            (time, last) = (hit.time, Some(hit.pair));
        }
        Ok(bodies.into_iter().map(|body| body.law.impulses).collect())
    }

    /// Distance of the surfaces of two bodies.
    fn gap(&self, [a, b]: [usize; 2], centers: [DVec3; 2]) -> f64 {
        centers[0].distance(centers[1]) - self.bodies[a].radius - self.bodies[b].radius
    }

    /// The first hit within a stretch of time, at the beginning of which the last pair has hit each other.
    fn next_hit(
        &self,
        (bodies, mut last): (&[Follower<'_>], Option<[usize; 2]>),
        [since, until]: [f64; 2],
    ) -> Result<Option<Hit>, MechanicsError> {
        let mut from = since;
        while from < until {
            let times = self.looks(bodies, [from, until])?;
            let places = bodies
                .iter()
                .map(|body| Ok(body.states(&times)?.iter().map(|state| body.center(state)).collect()))
                .collect::<Result<Vec<Vec<DVec3>>, MechanicsError>>()?;
            for look in 1..times.len() {
                if let Some(hit) = self.hit_between((bodies, last), &places, (&times, look))? {
                    return Ok(Some(hit));
                }
                last = None;
            }
            from = times[times.len() - 1];
        }
        Ok(None)
    }

    /// Times of the next looks at the bodies, the first of them now.
    fn looks(&self, bodies: &[Follower<'_>], [from, until]: [f64; 2]) -> Result<Vec<f64>, MechanicsError> {
        let mut speeds = Vec::new();
        for body in bodies {
            speeds.push(body.speed(&body.state(from)?));
        }
        speeds.sort_by(f64::total_cmp);
        let fastest: f64 = speeds.iter().rev().take(2).sum();
        let smallest = self.bodies.iter().map(|body| body.radius).fold(f64::INFINITY, f64::min);
        let interval = (LOOK * smallest / fastest).clamp(until / MOST_LOOKS, until / LEAST_LOOKS);
        let count = (((until - from) / interval).ceil() as usize).clamp(1, LOOKS);
        Ok((0..=count).map(|look| (from + look as f64 * interval).min(until)).collect())
    }

    /// The first hit between a look and the one before it: of two bodies that have come to touch, or touched
    /// and have come nearer. Those that had just hit each other then lean on each other.
    fn hit_between(
        &self,
        (bodies, last): (&[Follower<'_>], Option<[usize; 2]>),
        places: &[Vec<DVec3>],
        (times, look): (&[f64], usize),
    ) -> Result<Option<Hit>, MechanicsError> {
        let mut first: Option<Hit> = None;
        for pair in self.pairs() {
            let gap = |look: usize| self.gap(pair, pair.map(|body| places[body][look]));
            let [before, now] = [gap(look - 1), gap(look)];
            if now >= 0.0 || now >= before {
                continue;
            }
            let span = [times[look - 1], times[look]];
            let lifted = (last == Some(pair)).then(|| -now / (span[1] - span[0]));
            let time = match lifted {
                Some(_) => span[1],
                None if before <= self.touching(pair) => span[0],
                None => self.touch(bodies, pair, (span, [before, now]))?,
            };
            if first.as_ref().is_none_or(|hit| time < hit.time) {
                first = Some(Hit { pair, time, lifted });
            }
        }
        Ok(first)
    }

    /// Distance within which surfaces touch: what rounding leaves of a hit.
    fn touching(&self, [a, b]: [usize; 2]) -> f64 {
        1e-9 * (self.bodies[a].radius + self.bodies[b].radius)
    }

    /// The time between two at which the distance of two surfaces becomes zero.
    fn touch(
        &self,
        bodies: &[Follower<'_>],
        pair: [usize; 2],
        ([mut low, mut high], [mut above, mut below]): ([f64; 2], [f64; 2]),
    ) -> Result<f64, MechanicsError> {
        for turn in 0..HALVINGS {
            // A secant, and every third time a half: neither end stays where it is.
            let part = if turn % 3 == 2 { 0.5 } else { (above / (above - below)).clamp(0.01, 0.99) };
            let time = low + part * (high - low);
            let states = [bodies[pair[0]].state(time)?, bodies[pair[1]].state(time)?];
            let centers = [0, 1].map(|i| bodies[pair[i]].center(&states[i]));
            let gap = self.gap(pair, centers);
            if gap > 0.0 {
                (low, above) = (time, gap);
            } else {
                (high, below) = (time, gap);
            }
            if above < 0.1 * self.touching(pair) {
                break;
            }
        }
        Ok(low)
    }

    /// Gives both bodies of a hit their impulses. Those that lean on each other do not bounce.
    fn strike(&self, bodies: &mut [Follower<'_>], hit: &Hit, after: f64) -> Result<(), MechanicsError> {
        let states = [bodies[hit.pair[0]].state(hit.time)?, bodies[hit.pair[1]].state(hit.time)?];
        let centers = [0, 1].map(|i| bodies[hit.pair[i]].center(&states[i]));
        let Some(normal) = (centers[1] - centers[0]).try_normalize() else { return Ok(()) };
        let place = centers[0] + normal * self.bodies[hit.pair[0]].radius;
        let struck = [0, 1].map(|i| {
            let body = &bodies[hit.pair[i]];
            Struck::new(&body.law, &body.of.start.x, &states[i], (place, body.round.mass))
        });
        let [Some(first), Some(second)] = struck else { return Ok(()) };
        let approach = (first.velocity - second.velocity).dot(normal);
        if approach <= 0.0 {
            return Ok(());
        }
        let parting = hit.lifted.unwrap_or(self.restitution * approach);
        let push = impulse([&first, &second], normal, parting, self.friction);
        let changes = [first.change(-push), second.change(push)];
        for (&body, change) in hit.pair.iter().zip(changes) {
            bodies[body].meet(Impact { time: hit.time, change }, after);
        }
        Ok(())
    }
}

/// A body before the hits that are to be found.
fn follower<'a>(of: Moving<'a>, round: &'a RoundBody, since: f64) -> Follower<'a> {
    let mut law = of.law.clone();
    let is_kept = |(index, impulse): (usize, Impact)| {
        (impulse.time <= since || !round.hits.contains(&index)).then_some(impulse)
    };
    law.impulses = law.impulses.into_iter().enumerate().filter_map(is_kept).collect();
    Follower { of, law, round }
}
