//! Scenes of bodies that hit more than the floor: walls, or each other.

use super::super::body::{Body, Part, Stage};
use super::super::bounce::{Bounce, Wall};
use super::super::collisions::{Balls, Collisions};
use super::super::draws::Draws;
use super::super::motion::Motion;
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, ball, floor, framed};
use glam::{DMat3, DVec3, dvec3};
use std::sync::Arc;

pub(super) const ENTRIES: [Entry; 4] = [
    Entry::new(
        "wall",
        "a ball that bounces off a floor and a wall; before t = 0 it is in the flight of t = 0",
        "g 2.5 to 4, restitution 0.6 to 0.85, floor at 0.25 to 0.35, wall at 0.5 to 0.58, speed to it 0.8 \
         to 1.2, no friction",
        one_wall,
    ),
    Entry::new(
        "corner",
        "a ball that bounces off a floor and two walls; before t = 0 it is in the flight of t = 0",
        "g 2.5 to 4, restitution 0.6 to 0.85, floor at 0.25 to 0.35, walls at 0.14 to 0.18 and 0.5 to 0.58, \
         speeds towards them 0.8 to 1.2, no friction",
        corner,
    ),
    Entry::new(
        "colliding-balls",
        "three balls on a floor without friction: one hits the second, which hits the third",
        "radius 0.26 to 0.34, speed 1.2 to 1.6, collisions at 0.2 to 0.3 and 0.45 to 0.6, restitution 0.8 on",
        colliding_balls,
    ),
    Entry::new(
        "bouncing-balls",
        "two balls that hit each other in the air and bounce off a floor; before t = 0 they are in the \
         flights of t = 0",
        "radius 0.2 to 0.26, g 2.5 to 4, restitution 0.75 to 0.9, collision at 0.2 to 0.28, impacts of the \
         first flights at 0.42 to 0.52, speeds 0.5 to 0.8",
        bouncing_balls,
    ),
];

/// The last time of the ground truth.
const LAST_TIME: f64 = 2.25;

/// A wall that a ball of a radius reaches at the end of a way along a level direction, and its part: upright,
/// two units long.
fn wall(toward: DVec3, way: f64, radius: f64) -> (Wall, Part) {
    let (half, thickness) = (0.7, 0.05);
    let texture = Texture::new([0x5a6f8a, 0x7f9cb8, 0x4a586f], 0.9).with_contrast(0.7);
    let center = (way + radius + thickness) * toward + (half - radius) * DVec3::Z;
    let slab = Part::new(Shape::Cuboid(dvec3(thickness, 1.0, half)), center, texture);
    let part = slab.turned(DVec3::Z, toward.y.atan2(toward.x));
    (Wall { normal: -toward, offset: -way }, part)
}

/// A ball whose flight of t = 0 touches the floor within the window, and that comes to upright walls, each
/// across the one before, with speeds and at times.
fn bouncing<const N: usize>(draws: &mut Draws, walls: [(f64, f64); N]) -> (Stage, Rig) {
    let (gravity, radius) = (draws.within(2.5..4.0), draws.within(0.2..0.26));
    let (before, after) = (draws.within(0.8..0.9), draws.within(0.25..0.35));
    let mut toward = draws.horizontal();
    let mut velocity = 0.5 * gravity * (after - before) * DVec3::Z;
    let (mut fixed, mut upright) = (vec![floor(-radius, 1.5)], Vec::new());
    for (speed, time) in walls {
        let (plane, part) = wall(toward, speed * time, radius);
        upright.push(plane);
        fixed.push(part);
        velocity += speed * toward;
        toward = DVec3::Z.cross(toward);
    }
    let motion = Motion::Bounce(Bounce {
        start: 0.5 * gravity * before * after * DVec3::Z,
        velocity,
        gravity,
        restitution: draws.within(0.6..0.85),
        rest_height: 0.0,
        walls: upright,
    });
    let ball = ball(draws, radius);
    framed(Stage { bodies: vec![Body::of("ball", motion, ball)], fixed })
}

fn one_wall(draws: &mut Draws) -> (Stage, Rig) {
    let late = (draws.within(0.8..1.2), draws.within(0.5..0.58));
    bouncing(draws, [late])
}

fn corner(draws: &mut Draws) -> (Stage, Rig) {
    let early = (draws.within(0.8..1.2), draws.within(0.14..0.18));
    let late = (draws.within(0.8..1.2), draws.within(0.5..0.58));
    bouncing(draws, [early, late])
}

/// Each collision is aimed at a little off the centre; what comes after the second is as it comes.
fn colliding_balls(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, restitution) = (draws.within(0.26..0.34), draws.within(0.8..1.0));
    let (first, second) = (draws.within(0.2..0.3), draws.within(0.45..0.6));
    let velocity = draws.within(1.2..1.6) * draws.horizontal();
    let turned = |v: DVec3, angle: f64| DMat3::from_rotation_z(angle) * v;
    let (miss, next_miss) = (draws.either_sign(0.2..0.5), draws.either_sign(0.2..0.5));
    let along = turned(velocity.normalize(), miss);
    let pushed = 0.5 * (1.0 + restitution) * velocity.dot(along) * along;
    let places = [
        -2.0 * radius * along - first * velocity,
        DVec3::ZERO,
        (second - first) * pushed + 2.0 * radius * turned(along, next_miss),
    ];
    let starts = vec![velocity, DVec3::ZERO, DVec3::ZERO];
    let balls = Balls { radius, restitution, gravity: 0.0 };
    let collisions = Collisions::new(balls, places.to_vec(), starts, LAST_TIME);
    let bodies = colliding(draws, collisions, radius, &["first ball", "second ball", "third ball"]);
    framed(Stage { bodies, fixed: vec![floor(-radius, 2.4)] })
}

/// The bodies of balls that collide.
fn colliding(draws: &mut Draws, collisions: Collisions, radius: f64, names: &[&'static str]) -> Vec<Body> {
    let collisions = Arc::new(collisions);
    let body = |(index, &name): (usize, &&'static str)| {
        Body::of(
            name,
            Motion::Colliding { collisions: Arc::clone(&collisions), ball: index },
            ball(draws, radius),
        )
    };
    names.iter().enumerate().map(body).collect()
}

/// Each ball is in a flight that leaves the floor before the past begins and would meet it in the window;
/// the balls touch before they do, a little off the line of their way.
fn bouncing_balls(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, gravity) = (draws.within(0.2..0.26), draws.within(2.5..4.0));
    let (time, direction) = (draws.within(0.2..0.28), draws.horizontal());
    let mut flight = |toward: DVec3| {
        let (before, after) = (draws.within(0.8..0.9), draws.within(0.42..0.52));
        let velocity = draws.within(0.5..0.8) * toward + 0.5 * gravity * (after - before) * DVec3::Z;
        (0.5 * gravity * before * after, velocity, 0.5 * gravity * (before + time) * (after - time))
    };
    let flights = [flight(direction), flight(-direction)];
    let rise = flights[1].2 - flights[0].2;
    let miss = DMat3::from_rotation_z(draws.either_sign(0.1..0.4)) * direction;
    let apart = (4.0 * radius * radius - rise * rise).sqrt() * miss;
    let place = |(height, velocity, _): (f64, DVec3, f64), at: DVec3| {
        at - time * DVec3::new(velocity.x, velocity.y, 0.0) + height * DVec3::Z
    };
    let places = vec![place(flights[0], -0.5 * apart), place(flights[1], 0.5 * apart)];
    let starts = flights.iter().map(|(_, velocity, _)| *velocity).collect();
    let balls = Balls { radius, restitution: draws.within(0.75..0.9), gravity };
    let collisions = Collisions::new(balls, places, starts, LAST_TIME);
    let bodies = colliding(draws, collisions, radius, &["first ball", "second ball"]);
    framed(Stage { bodies, fixed: vec![floor(-radius, 2.4)] })
}
