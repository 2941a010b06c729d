//! Equal balls that collide with each other, sliding on a level floor without friction or bouncing off it, in
//! closed form from event to event.

use super::pose::Pose;
use crate::edit::MotionEdit;
use crate::thresholds::REST_FLIGHT;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// What balls are made of, and what pulls them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balls {
    /// Radius of each.
    pub(super) radius: f64,
    /// Restitution, of balls with each other and with the floor.
    pub(super) restitution: f64,
    /// Acceleration along −z; without it the balls stay at their height.
    pub(super) gravity: f64,
}

/// Free motion of all balls between events: collisions, which exchange a part of the velocity along the line
/// of the centres, and bounces off a floor on which centres are at z = 0. The balls keep their orientations:
/// nothing rubs. Before t = 0 they are in the flights of t = 0.
///
/// Conservative: gravity `g`. Nothing is scaled by γ: what happens are events.
#[derive(Clone, Debug)]
pub(super) struct Collisions {
    balls: Balls,
    /// Time up to which events are known.
    until: f64,
    flights: Vec<Flight>,
}

/// Free motion from a moment on.
#[derive(Clone, Debug)]
struct Flight {
    since: f64,
    /// Whether two balls collided then.
    collided: bool,
    places: Vec<DVec3>,
    velocities: Vec<DVec3>,
}

/// What ends a flight.
#[derive(Clone, Copy)]
enum Event {
    Collision([usize; 2]),
    Bounce(usize),
}

impl Flight {
    fn place(&self, ball: usize, t: f64, gravity: f64) -> DVec3 {
        let dt = t - self.since;
        let pull = if self.rests(ball) { 0.0 } else { gravity };
        self.places[ball] + dt * self.velocities[ball] - 0.5 * pull * dt * dt * DVec3::Z
    }

    /// Whether a ball stays on the floor.
    fn rests(&self, ball: usize) -> bool {
        self.places[ball].z == 0.0 && self.velocities[ball].z == 0.0
    }

    /// Time until two balls of a radius touch that come nearer to each other; nothing if they do not.
    fn touch(&self, [a, b]: [usize; 2], radius: f64) -> Option<f64> {
        let (apart, rate) = (self.places[b] - self.places[a], self.velocities[b] - self.velocities[a]);
        let (square, closing) = (rate.length_squared(), -apart.dot(rate));
        let root = closing.powi(2) - square * (apart.length_squared() - 4.0 * radius * radius);
        (closing > 0.0 && root >= 0.0).then(|| ((closing - root.sqrt()) / square).max(0.0))
    }

    /// Time until a ball meets the floor, if it is pulled there and does not rest on it.
    fn landing(&self, ball: usize, gravity: f64) -> Option<f64> {
        let (height, speed) = (self.places[ball].z, self.velocities[ball].z);
        let wait = (speed + (speed.powi(2) + 2.0 * gravity * height.max(0.0)).sqrt()) / gravity;
        (gravity > 0.0 && !self.rests(ball)).then_some(wait)
    }

    /// The motion after the next event; nothing if there is none.
    fn next(&self, &Balls { radius, restitution, gravity }: &Balls) -> Option<Self> {
        let count = self.places.len();
        let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
        let collisions = pairs.filter_map(|pair| Some((self.touch(pair, radius)?, Event::Collision(pair))));
        let bounces = (0..count).filter_map(|ball| Some((self.landing(ball, gravity)?, Event::Bounce(ball))));
        let (after, event) = collisions.chain(bounces).min_by(|one, other| one.0.total_cmp(&other.0))?;
        let since = self.since + after;
        let mut places: Vec<DVec3> = (0..count).map(|ball| self.place(ball, since, gravity)).collect();
        let mut velocities = self.velocities.clone();
        for ball in (0..count).filter(|&ball| !self.rests(ball)) {
            velocities[ball].z -= gravity * after;
        }
        match event {
            Event::Collision([a, b]) => {
                let along = (places[b] - places[a]).normalize();
                let exchanged =
                    0.5 * (1.0 + restitution) * (velocities[a] - velocities[b]).dot(along) * along;
                velocities[a] -= exchanged;
                velocities[b] += exchanged;
            }
            Event::Bounce(ball) => {
                let speed = -restitution * velocities[ball].z;
                let is_brief = 2.0 * speed <= REST_FLIGHT * gravity;
                (places[ball].z, velocities[ball].z) = (0.0, if is_brief { 0.0 } else { speed });
            }
        }
        Some(Self { since, collided: matches!(event, Event::Collision(_)), places, velocities })
    }
}

impl Collisions {
    /// The motion from places and velocities at t = 0, up to a time.
    pub(super) fn new(balls: Balls, places: Vec<DVec3>, velocities: Vec<DVec3>, until: f64) -> Self {
        let first = Flight { since: 0.0, collided: false, places, velocities };
        let is_before = |flight: &Flight| flight.since <= until;
        let flights = std::iter::successors(Some(first), |flight: &Flight| flight.next(&balls));
        let flights = flights.take_while(is_before).collect();
        Self { balls, until, flights }
    }

    /// The motion from the same places under an edit.
    pub(super) fn edited(&self, edit: MotionEdit) -> Self {
        let Flight { places, velocities, .. } = self.flights[0].clone();
        let balls = Balls { gravity: edit.potential_scale * self.balls.gravity, ..self.balls };
        let velocities = velocities.into_iter().map(|v| v * edit.velocity_scale).collect();
        Self::new(balls, places, velocities, self.until)
    }

    /// Times of the collisions.
    pub(super) fn times(&self) -> Vec<f64> {
        self.flights.iter().filter(|flight| flight.collided).map(|flight| flight.since).collect()
    }

    pub(super) fn pose(&self, ball: usize, t: f64) -> Pose {
        let begun = self.flights.partition_point(|flight| flight.since <= t).max(1);
        Pose::rigid(DMat3::IDENTITY, self.flights[begun - 1].place(ball, t, self.balls.gravity))
    }

    /// Name and constants, for `scene.json`.
    pub(super) fn describe(&self) -> Value {
        let Balls { restitution, gravity, .. } = self.balls;
        let mut constants = json!({"restitution": restitution, "collisions": self.times()});
        let (law, kind) = if gravity > 0.0 {
            constants["g"] = json!(gravity);
            ("collisions of equal balls that bounce off a floor", "event")
        } else {
            ("collisions of equal balls", "dissipative")
        };
        json!({"law": law, "kind": kind, "coordinates": "rigid", "constants": constants})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF_AS_FAST: MotionEdit =
        MotionEdit { velocity_scale: 0.5, potential_scale: 1.0, force_scale: 1.0 };

    #[test]
    fn balls_that_collide_keep_their_momentum_and_never_overlap() {
        let places = vec![DVec3::ZERO, DVec3::new(1.0, 0.1, 0.0), DVec3::new(2.0, 0.2, 0.0)];
        let balls = Balls { radius: 0.3, restitution: 0.8, gravity: 0.0 };
        let velocities = vec![2.0 * DVec3::X, DVec3::ZERO, DVec3::ZERO];
        let motion = Collisions::new(balls, places.clone(), velocities, 2.0);
        assert!(motion.times().len() >= 2, "{:?}", motion.times());
        let at = |t: f64| [0, 1, 2].map(|ball| motion.pose(ball, t).position);
        for step in 0..200 {
            let t = 0.01 * f64::from(step);
            let [a, b, c] = at(t);
            assert!((a + b + c - (places.iter().sum::<DVec3>() + 2.0 * t * DVec3::X)).length() < 1e-12);
            assert!(a.distance(b).min(b.distance(c)).min(a.distance(c)) > 0.6 - 1e-9, "t {t}");
        }
        // Nothing but the start has a time: half as fast, all happens twice as late.
        let slower = motion.edited(HALF_AS_FAST);
        assert!((slower.times()[0] - 2.0 * motion.times()[0]).abs() < 1e-12);
        assert!(slower.pose(1, 1.4).position.distance(motion.pose(1, 0.7).position) < 1e-12);
    }

    #[test]
    fn a_ball_comes_to_rest_on_the_floor() {
        let balls = Balls { radius: 0.2, restitution: 0.5, gravity: 4.0 };
        let motion = Collisions::new(balls, vec![0.5 * DVec3::Z], vec![DVec3::X], 5.0);
        assert_eq!(motion.pose(0, 4.0).position, DVec3::new(4.0, 0.0, 0.0));
    }

    #[test]
    fn balls_that_fall_bounce_off_the_floor_and_off_each_other() {
        let balls = Balls { radius: 0.2, restitution: 1.0, gravity: 3.0 };
        let places = vec![DVec3::new(-0.5, 0.0, 0.5), DVec3::new(0.5, 0.0, 0.6)];
        let velocities = vec![DVec3::X, -DVec3::X];
        let motion = Collisions::new(balls, places, velocities, 3.0);
        assert_eq!(motion.times().len(), 1, "{:?}", motion.times());
        let energy = |flight: &Flight| -> f64 {
            let heights = flight.places.iter().map(|place| 3.0 * place.z);
            heights.chain(flight.velocities.iter().map(|v| 0.5 * v.length_squared())).sum()
        };
        for (flight, next) in motion.flights.iter().zip(&motion.flights[1..]) {
            assert!((energy(flight) - energy(next)).abs() < 1e-9, "at {}", next.since);
        }
        for step in 0..300 {
            let [a, b] = [0, 1].map(|ball| motion.pose(ball, 0.01 * f64::from(step)).position);
            assert!(a.distance(b) > 0.4 - 1e-9 && a.z.min(b.z) > -1e-9, "{a} {b}");
        }
    }
}
