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
    /// Its law; the events of it are those of its own motion.
    pub law: &'a Law,
    /// Configuration and velocity at t = 0.
    pub start: &'a State,
    /// Scales of its motion.
    pub edit: Edit,
}

/// A body with the events that it has met so far.
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

    /// Adds an event in the order of time, a little later than one of the same time.
    fn meet(&mut self, mut event: Impact, after: f64) {
        let place = self.law.events.partition_point(|other| other.time <= event.time);
        if let Some(before) = place.checked_sub(1).map(|i| self.law.events[i].time) {
            event.time = event.time.max(before + after);
        }
        self.law.events.insert(place, event);
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
    /// The events of each body up to a time: its own ones, hits by other bodies up to `since` as its law has
    /// them, and from then on the hits that follow.
    ///
    /// # Errors
    /// If there are not as many motions as bodies, or one cannot be followed.
    pub fn events(
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
        let mut time = since;
        for _ in 0..MOST_HITS {
            let Some(hit) = self.next_hit(&bodies, [time, until])? else { break };
            time = hit.time;
            self.strike(&mut bodies, &hit, AFTER * until)?;
        }
        Ok(bodies.into_iter().map(|body| body.law.events).collect())
    }

    /// Distance of the surfaces of two bodies.
    fn gap(&self, [a, b]: [usize; 2], centers: [DVec3; 2]) -> f64 {
        centers[0].distance(centers[1]) - self.bodies[a].radius - self.bodies[b].radius
    }

    /// The first hit within a stretch of time.
    fn next_hit(
        &self,
        bodies: &[Follower<'_>],
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
                if let Some(hit) = self.hit_between(bodies, &places, (&times, look))? {
                    return Ok(Some(hit));
                }
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
    /// and have come nearer.
    fn hit_between(
        &self,
        bodies: &[Follower<'_>],
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
            let lifted = (before <= self.touching(pair)).then(|| -now / (span[1] - span[0]));
            let time = match lifted {
                Some(_) => span[1],
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
    let is_kept = |(index, event): (usize, Impact)| {
        (event.time <= since || !round.hits.contains(&index)).then_some(event)
    };
    law.events = law.events.into_iter().enumerate().filter_map(is_kept).collect();
    Follower { of, law, round }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::{Coordinates, Port};
    use crate::terms::Term;

    fn still(radius: f64, mass: f64, center: [f64; 3]) -> RoundBody {
        RoundBody { center, radius, mass, hits: Vec::new() }
    }

    fn free() -> Law {
        Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("a law")
    }

    #[test]
    fn a_ball_passes_its_speed_on_through_a_row() {
        let law = free();
        let places = [0.0, 1.0, 2.0];
        let contact = MutualContact {
            bodies: places.map(|x| still(0.3, 1.0, [x, 0.0, 0.0])).to_vec(),
            restitution: 1.0,
            friction: 0.0,
            deviations: [0.0; 2],
        };
        let speeds = [1.0, 0.0, 0.0];
        let starts: Vec<State> = places
            .iter()
            .zip(speeds)
            .map(|(&x, v)| State { x: vec![x, 0.0, 0.0], v: vec![v, 0.0, 0.0] })
            .collect();
        for scale in [1.0, 2.0] {
            let edit = Edit { velocity: scale, ..Edit::NONE };
            let motions: Vec<Moving<'_>> =
                starts.iter().map(|start| Moving { law: &law, start, edit }).collect();
            let events = contact.events(&motions, [0.0, 1.5]).expect("events");
            let times: Vec<Vec<f64>> =
                events.iter().map(|events| events.iter().map(|event| event.time).collect()).collect();
            let [first, second] = [0.4 / scale, 0.8 / scale];
            let near = |times: &[f64], expected: &[f64]| {
                times.len() == expected.len() && times.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-7)
            };
            assert!(near(&times[0], &[first]) && near(&times[1], &[first, second]), "{times:?}");
            assert!(
                near(&times[2], &[second]) && (events[2][0].change[0] - scale).abs() < 1e-9,
                "{events:?}"
            );
        }
    }

    #[test]
    fn a_ball_comes_to_lie_on_another_one() {
        let weight = Term::named("uniform-field", Port::Whole).expect("a term");
        let falling = Law::new(Coordinates::Point, vec![weight], vec![0.0, 0.0, -9.81], 0.01).expect("a law");
        let lying = free();
        let contact = MutualContact {
            bodies: vec![still(0.5, 1e6, [0.0; 3]), still(0.5, 1.0, [0.0, 0.0, 1.2])],
            restitution: 0.4,
            friction: 0.3,
            deviations: [0.0; 2],
        };
        let at = |z: f64| State { x: vec![0.0, 0.0, z], v: vec![0.0; 3] };
        let starts = [at(0.0), at(1.2)];
        let motions = [(&lying, &starts[0]), (&falling, &starts[1])].map(|(law, start)| Moving {
            law,
            start,
            edit: Edit::NONE,
        });
        let events = contact.events(&motions, [0.0, 3.0]).expect("events").remove(1);
        let law = Law { events, ..falling.clone() };
        let times: Vec<f64> = (0..30).map(|k| 0.1 * f64::from(k)).collect();
        let states = System::new(&law, Edit::NONE).states(&starts[1], &times).expect("states");
        assert!(states.iter().all(|state| state.x[2] > 0.95), "{states:?}");
        assert!((states[29].x[2] - 1.0).abs() < 0.05 && states[29].v[2].abs() < 0.5, "{:?}", states[29]);
    }

    #[test]
    fn hits_up_to_a_time_are_those_of_the_law() {
        let struck = Impact { time: 0.25, change: vec![0.0, 0.5, 0.0] };
        let mut law = free();
        law.events = vec![Impact { time: 0.1, change: vec![0.0; 3] }, struck.clone()];
        let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
        let far = State { x: vec![9.0, 0.0, 0.0], v: vec![0.0; 3] };
        let other = free();
        let mut bodies = vec![still(0.3, 1.0, [0.0; 3]), still(0.3, 1.0, [9.0, 0.0, 0.0])];
        bodies[0].hits = vec![1];
        let contact = MutualContact { bodies, restitution: 1.0, friction: 0.0, deviations: [0.0; 2] };
        let motions =
            [(&law, &start), (&other, &far)].map(|(law, start)| Moving { law, start, edit: Edit::NONE });
        let events = |since: f64| contact.events(&motions, [since, 1.0]).expect("events").remove(0);
        assert_eq!(events(0.5), law.events, "known ones stay");
        assert_eq!(events(0.0), law.events[..1], "a hit that does not happen is gone, the push stays");
    }
}
