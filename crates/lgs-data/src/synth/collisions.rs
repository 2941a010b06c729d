//! Equal balls that slide on a level floor without friction and collide with each other, in closed form from
//! collision to collision.

use super::pose::Pose;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Number of balls.
pub(super) const BALLS: usize = 3;

/// Straight motion of all balls between collisions, which exchange a part of the velocity along the line of
/// the centres. The balls keep their orientations: nothing rubs. Before t = 0 they move straight as well.
#[derive(Clone, Debug)]
pub(super) struct Collisions {
    radius: f64,
    restitution: f64,
    /// Time up to which collisions are known.
    until: f64,
    flights: Vec<Flight>,
}

/// Straight motion from a moment on.
#[derive(Clone, Copy, Debug)]
struct Flight {
    since: f64,
    places: [DVec3; BALLS],
    velocities: [DVec3; BALLS],
}

impl Flight {
    fn place(&self, ball: usize, t: f64) -> DVec3 {
        self.places[ball] + (t - self.since) * self.velocities[ball]
    }

    /// Time until two balls of a radius touch that come nearer to each other; nothing if they do not.
    fn touch(&self, [a, b]: [usize; 2], radius: f64) -> Option<f64> {
        let (apart, rate) = (self.places[b] - self.places[a], self.velocities[b] - self.velocities[a]);
        let (square, closing) = (rate.length_squared(), -apart.dot(rate));
        let root = closing.powi(2) - square * (apart.length_squared() - 4.0 * radius * radius);
        (closing > 0.0 && root >= 0.0).then(|| ((closing - root.sqrt()) / square).max(0.0))
    }

    /// The motion after the next collision; nothing if there is none.
    fn next(&self, radius: f64, restitution: f64) -> Option<Self> {
        let pairs = [[0, 1], [0, 2], [1, 2]];
        let touching = pairs.iter().filter_map(|&pair| Some((self.touch(pair, radius)?, pair)));
        let (after, [a, b]) = touching.min_by(|one, other| one.0.total_cmp(&other.0))?;
        let since = self.since + after;
        let mut next = Self { since, places: [0, 1, 2].map(|ball| self.place(ball, since)), ..*self };
        let along = (next.places[b] - next.places[a]).normalize();
        let exchanged =
            0.5 * (1.0 + restitution) * (self.velocities[a] - self.velocities[b]).dot(along) * along;
        next.velocities[a] -= exchanged;
        next.velocities[b] += exchanged;
        Some(next)
    }
}

impl Collisions {
    /// The motion from places and velocities at t = 0, up to a time.
    pub(super) fn new(
        places: [DVec3; BALLS],
        velocities: [DVec3; BALLS],
        (radius, restitution): (f64, f64),
        until: f64,
    ) -> Self {
        let first = Flight { since: 0.0, places, velocities };
        let next = |flight: &Flight| flight.next(radius, restitution);
        let is_before = |flight: &Flight| flight.since <= until;
        let flights = std::iter::successors(Some(first), next).take_while(is_before).collect();
        Self { radius, restitution, until, flights }
    }

    /// The motion from the same places with scaled velocities.
    pub(super) fn edited(&self, velocity_scale: f64) -> Self {
        let Flight { places, velocities, .. } = self.flights[0];
        let of_material = (self.radius, self.restitution);
        Self::new(places, velocities.map(|v| v * velocity_scale), of_material, self.until)
    }

    /// Times of the collisions.
    pub(super) fn times(&self) -> Vec<f64> {
        self.flights[1..].iter().map(|flight| flight.since).collect()
    }

    pub(super) fn pose(&self, ball: usize, t: f64) -> Pose {
        let begun = self.flights.partition_point(|flight| flight.since <= t).max(1);
        Pose::rigid(DMat3::IDENTITY, self.flights[begun - 1].place(ball, t))
    }

    /// Name and constants, for `scene.json`.
    pub(super) fn describe(&self) -> Value {
        let constants = json!({"restitution": self.restitution, "collisions": self.times()});
        json!({
            "law": "collisions of equal balls", "kind": "dissipative", "coordinates": "rigid",
            "constants": constants
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_that_collide_keep_their_momentum_and_never_overlap() {
        let places = [DVec3::ZERO, DVec3::new(1.0, 0.1, 0.0), DVec3::new(2.0, 0.2, 0.0)];
        let motion = Collisions::new(places, [2.0 * DVec3::X, DVec3::ZERO, DVec3::ZERO], (0.3, 0.8), 2.0);
        assert!(motion.times().len() >= 2, "{:?}", motion.times());
        let at = |t: f64| [0, 1, 2].map(|ball| motion.pose(ball, t).position);
        for step in 0..200 {
            let t = 0.01 * f64::from(step);
            let [a, b, c] = at(t);
            assert!((a + b + c - (places.iter().sum::<DVec3>() + 2.0 * t * DVec3::X)).length() < 1e-12);
            assert!(a.distance(b).min(b.distance(c)).min(a.distance(c)) > 0.6 - 1e-9, "t {t}");
        }
        // Nothing but the start has a time: half as fast, all happens twice as late.
        let slower = motion.edited(0.5);
        assert!((slower.times()[0] - 2.0 * motion.times()[0]).abs() < 1e-12);
        assert!(slower.pose(1, 1.4).position.distance(motion.pose(1, 0.7).position) < 1e-12);
    }
}
