//! A ball that bounces on a level floor and between upright walls, in closed form from impact to impact.

use super::pose::Pose;
use crate::edit::MotionEdit;
use crate::thresholds::REST_FLIGHT;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Free fall between impacts that reverse the velocity across floor or wall and scale it by the restitution;
/// the velocity along them stays (no friction), and the ball keeps its orientation.
///
/// Conservative: gravity `g`. Nothing is scaled by γ: the impact is an event. Before t = 0 the ball is in the
/// flight that it is in at t = 0: it was thrown from where the past begins.
#[derive(Clone, Debug)]
pub(super) struct Bounce {
    pub(super) start: DVec3,
    pub(super) velocity: DVec3,
    pub(super) gravity: f64,
    pub(super) restitution: f64,
    /// Height of the ball's centre when it touches the floor.
    pub(super) rest_height: f64,
    /// Upright walls.
    pub(super) walls: Vec<Wall>,
}

/// An upright wall, at which the ball's centre turns back at `normal · q = offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    /// Level unit vector to the side of the ball.
    pub(super) normal: DVec3,
    pub(super) offset: f64,
}

impl Wall {
    /// Time until a centre with a velocity is there, if it comes nearer.
    fn time_to(&self, center: DVec3, velocity: DVec3) -> Option<f64> {
        let approach = -self.normal.dot(velocity);
        (approach > 0.0).then(|| ((self.normal.dot(center) - self.offset) / approach).max(0.0))
    }

    fn describe(&self) -> Value {
        json!({"normal": self.normal.to_array(), "offset": self.offset})
    }
}

/// Free flight from a moment on.
#[derive(Clone, Copy)]
struct Flight {
    since: f64,
    height: f64,
    speed: f64,
}

impl Bounce {
    /// Times of the impacts up to `end`.
    pub(super) fn impacts(&self, end: f64) -> Vec<f64> {
        let mut flight = self.first();
        let mut times = Vec::new();
        while let Some(next) = self.next(&flight).filter(|next| next.since <= end) {
            times.push(next.since);
            flight = next;
        }
        times
    }

    pub(super) fn pose(&self, t: f64) -> Pose {
        let mut flight = self.first();
        let mut resting = false;
        while t > flight.since && !resting {
            match self.next(&flight).filter(|next| next.since <= t) {
                Some(next) => {
                    resting = 2.0 * next.speed <= REST_FLIGHT * self.gravity;
                    flight = next;
                }
                None => break,
            }
        }
        let dt = t - flight.since;
        let fallen = flight.height + flight.speed * dt - 0.5 * self.gravity * dt * dt;
        let level = self.level(t);
        let z = if resting { self.rest_height } else { fallen };
        Pose::rigid(DMat3::IDENTITY, DVec3::new(level.x, level.y, z))
    }

    /// Where the ball is along the floor.
    fn level(&self, t: f64) -> DVec3 {
        let (mut since, mut center, mut velocity) = (0.0, self.start, self.velocity);
        let next = |center: DVec3, velocity: DVec3| {
            let times = self.walls.iter().filter_map(|wall| Some((wall, wall.time_to(center, velocity)?)));
            times.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        while let Some((wall, wait)) = next(center, velocity).filter(|(_, wait)| since + wait < t) {
            (since, center) = (since + wait, center + velocity * wait);
            velocity -= (1.0 + self.restitution) * wall.normal.dot(velocity) * wall.normal;
        }
        center + velocity * (t - since)
    }

    fn first(&self) -> Flight {
        Flight { since: 0.0, height: self.start.z, speed: self.velocity.z }
    }

    /// The flight after the next impact; nothing if there is none.
    fn next(&self, flight: &Flight) -> Option<Flight> {
        let drop = flight.height - self.rest_height;
        let impact = (flight.speed.powi(2) + 2.0 * self.gravity * drop).sqrt();
        let duration = (flight.speed + impact) / self.gravity;
        (duration > REST_FLIGHT).then_some(Flight {
            since: flight.since + duration,
            height: self.rest_height,
            speed: self.restitution * impact,
        })
    }

    pub(super) fn edited(&self, edit: MotionEdit) -> Self {
        Self {
            velocity: edit.velocity_scale * self.velocity,
            gravity: edit.potential_scale * self.gravity,
            ..self.clone()
        }
    }

    pub(super) fn describe(&self) -> Value {
        json!({
            "law": "bounce", "kind": "event", "coordinates": "rigid",
            "constants": {"g": self.gravity, "restitution": self.restitution},
            "start": self.start.to_array(), "velocity": self.velocity.to_array(),
            "rest_height": self.rest_height, "impacts": self.impacts(2.25),
            "conservative": ["g"], "nonconservative": [],
            "walls": self.walls.iter().map(Wall::describe).collect::<Vec<_>>(),
        })
    }
}
