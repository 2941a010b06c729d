//! Scenes that no autonomous law explains.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::guided::{Guided, Walk, Wander};
use super::super::motion::Motion;
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, framed};
use glam::{DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 4] = [
    Entry::new(
        "walker",
        "a figure that walks at a changing cadence: limbs driven by time",
        "speed 0.3 to 0.5, cadence 1.1 to 1.6 per unit of time, swings 0.5 to 0.8 rad",
        walker,
    )
    .unexplained(),
    Entry::new(
        "led",
        "a body led along a random smooth path, also in the past",
        "four waves a coordinate with frequencies 0.3 to 1.8, amplitude about 0.5",
        led,
    )
    .unexplained(),
    Entry::new(
        "grabbed",
        "a body in free fall that is grabbed half-way through the window and led away; its past is free fall",
        "g 1 to 1.6, grabbed at 0.3 to 0.45, path as of `led`",
        grabbed,
    )
    .unexplained(),
    Entry::new(
        "released",
        "a body that a hand leads and lets go in the window: from then on it falls freely",
        "g 1.2 to 1.8, let go at 0.2 to 0.35, path as of `led`",
        released,
    )
    .unexplained(),
];

fn wanders(draws: &mut Draws, amplitude: f64) -> [Wander; 3] {
    std::array::from_fn(|_| Wander::draw(draws, amplitude))
}

fn boxy(draws: &mut Draws) -> Vec<Part> {
    let half = dvec3(draws.within(0.34..0.42), draws.within(0.26..0.32), draws.within(0.28..0.36));
    let mut solid = Part::new(Shape::Cuboid(half), DVec3::ZERO, Texture::new(draws.palette(), 0.5));
    solid.rotation = draws.orientation();
    vec![solid]
}

fn led(draws: &mut Draws) -> (Stage, Rig) {
    let motion = Motion::Guided(Box::new(Guided::Led {
        start: DVec3::ZERO,
        path: wanders(draws, 0.5),
        axis: draws.tilted(0.0..1.2),
        angle: Wander::draw(draws, 0.8),
    }));
    let parts = boxy(draws);
    framed(alone("led", motion, DVec3::ZERO, parts))
}

fn grabbed(draws: &mut Draws) -> (Stage, Rig) {
    let gravity = draws.within(1.0..1.6);
    let motion = Motion::Guided(Box::new(Guided::Grabbed {
        start: DVec3::ZERO,
        velocity: draws.within(0.4..0.7) * draws.horizontal() + draws.within(0.2..0.5) * DVec3::Z,
        gravity,
        grabbed: draws.within(0.3..0.45),
        path: wanders(draws, 0.5),
    }));
    let parts = boxy(draws);
    framed(alone("grabbed", motion, DVec3::ZERO, parts))
}

fn released(draws: &mut Draws) -> (Stage, Rig) {
    let motion = Motion::Guided(Box::new(Guided::Released {
        start: DVec3::ZERO,
        path: wanders(draws, 0.3),
        released: draws.within(0.2..0.35),
        gravity: draws.within(1.2..1.8),
    }));
    let parts = boxy(draws);
    framed(alone("released", motion, DVec3::ZERO, parts))
}

fn walker(draws: &mut Draws) -> (Stage, Rig) {
    let walk = Walk {
        start: DVec3::ZERO,
        direction: draws.horizontal(),
        speed: draws.within(0.3..0.5),
        cadence: draws.within(1.1..1.6),
        bob: draws.within(0.03..0.06),
        change: Wander::draw(draws, 0.9),
    };
    let (hips, legs, arms) = (draws.within(0.16..0.2), draws.within(0.5..0.8), draws.within(0.5..0.8));
    let mut limb = |name, joint: DVec3, swing: f64, lag: f64, half: DVec3, hang: f64| {
        let texture = Texture::new(draws.palette(), 0.4);
        let part = Part::new(Shape::Cuboid(half), dvec3(0.0, 0.0, hang), texture);
        let motion = Motion::Guided(Box::new(Guided::Gait { walk: walk.clone(), joint, swing, lag }));
        Body { name, motion, parts: vec![part], center: dvec3(0.0, 0.0, hang) }
    };
    let (leg, arm) = (dvec3(0.11, 0.10, 0.34), dvec3(0.08, 0.07, 0.28));
    let half_turn = std::f64::consts::PI;
    let bodies = vec![
        limb("trunk", DVec3::ZERO, 0.06, 0.4, dvec3(0.20, 0.30, 0.36), 0.42),
        limb("left leg", dvec3(0.0, hips, 0.0), legs, 0.0, leg, -0.34),
        limb("right leg", dvec3(0.0, -hips, 0.0), legs, half_turn, leg, -0.34),
        limb("left arm", dvec3(0.0, 0.39, 0.70), arms, half_turn, arm, -0.28),
        limb("right arm", dvec3(0.0, -0.39, 0.70), arms, 0.0, arm, -0.28),
    ];
    framed(Stage { bodies, fixed: Vec::new() })
}
