//! The six object scenes with laws in closed form. Seed 0 keeps their constants; any other draws them.

use super::super::body::{Part, Stage};
use super::super::draws::Draws;
use super::super::motion::Motion;
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, framed, ring};
use glam::{DMat3, DQuat, DVec3, dvec3};
use std::f64::consts::TAU;

pub(super) const ENTRIES: [Entry; 6] = [
    Entry::new(
        "falling-ball",
        "a ball in free fall from rest: uniform gravity",
        "g 0.6 to 1.1 (seed 0: 0.9)",
        falling_ball,
    ),
    Entry::new(
        "fan",
        "three blades and a hub in uniform rotation about a fixed axis",
        "rate 1.8 to 3.2 (seed 0: 2.4), axis within 0.6 rad of the vertical",
        fan,
    ),
    Entry::new(
        "projectile",
        "a thrown box with a constant spin: gravity and rotation",
        "g 0.9 to 1.3 (seed 0: 1.2), spin 1.8 to 3.2 about the vertical (2.6), velocity scaled by \
         0.8 to 1.05 and turned",
        projectile,
    ),
    Entry::new(
        "pendulum",
        "a rigid pendulum of large amplitude, released at rest",
        "amplitude 0.35 to 0.6 rad (seed 0: 0.45), small-angle frequency 4.4 to 5.8 (5.2)",
        pendulum,
    ),
    Entry::new(
        "spring",
        "a block on an isotropic spring, pushed off the axis: an ellipse",
        "frequency 3.4 to 5 (seed 0: 4.2), start and velocity scaled by 0.8 to 1.05 and turned \
         about the vertical",
        spring,
    ),
    Entry::new(
        "sled",
        "a sled sliding straight against linear drag",
        "drag 0.6 to 1 (seed 0: 0.9), speed scaled by 0.8 to 1 (1.4)",
        sled,
    ),
];

/// The cameras of seed 0, or others that frame what the seed has drawn.
fn usual_or_framed(draws: &Draws, stage: Stage, usual: Rig) -> (Stage, Rig) {
    if draws.keeps_usual() { (stage, usual) } else { framed(stage) }
}

fn falling_ball(draws: &mut Draws) -> (Stage, Rig) {
    let motion = Motion::Ballistic {
        start: dvec3(0.0, 0.0, 1.0),
        velocity: DVec3::ZERO,
        gravity: draws.usual_or(0.9, 0.6..1.1),
        spin: DVec3::ZERO,
    };
    let texture = Texture::new([0xd7263d, 0x1b2a6b, 0xf2a541], 0.55);
    let ball = Part::new(Shape::Ellipsoid(DVec3::splat(0.5)), DVec3::ZERO, texture);
    usual_or_framed(
        draws,
        alone("ball", motion, DVec3::ZERO, vec![ball]),
        ring(dvec3(0.0, 0.0, -0.1), 5.0, 1.7),
    )
}

fn fan(draws: &mut Draws) -> (Stage, Rig) {
    let drawn = draws.tilted(0.1..0.6);
    let axis = if draws.keeps_usual() { dvec3(0.30, -0.20, 0.93).normalize() } else { drawn };
    let spin = draws.usual_or(2.4, 1.8..3.2) * axis;
    let motion = Motion::Rotor { center: DVec3::ZERO, spin, phase: 0.0 };
    let upright = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, axis));
    let colors =
        [[0xd1495b, 0x5f0f40, 0xf2a65a], [0x00798c, 0x0b3954, 0x8fd694], [0xedae49, 0x8a4f00, 0x3d5a80]];
    let mut parts: Vec<Part> =
        colors.iter().enumerate().map(|(i, &c)| blade(TAU * i as f64 / 3.0, c)).collect();
    parts.push(Part::new(
        Shape::Cylinder(0.24, 0.15),
        DVec3::ZERO,
        Texture::new([0x30343f, 0x8d99ae, 0x5c677d], 0.4),
    ));
    for part in &mut parts {
        part.center = upright * part.center;
        part.rotation = upright * part.rotation;
    }
    usual_or_framed(draws, alone("rotor", motion, DVec3::ZERO, parts), ring(DVec3::ZERO, 4.0, 1.15))
}

/// A pitched blade along x, turned about z.
fn blade(angle: f64, colors: [u32; 3]) -> Part {
    let turn = DMat3::from_rotation_z(angle);
    let mut part = Part::new(
        Shape::Cuboid(dvec3(0.42, 0.21, 0.045)),
        turn * dvec3(0.60, 0.0, 0.0),
        Texture::new(colors, 0.5),
    );
    part.rotation = turn * DMat3::from_rotation_x(0.42);
    part
}

/// The spin is vertical: spin and fall then commute, and the motion is that of a gyroscopic force with a
/// uniform potential.
fn projectile(draws: &mut Draws) -> (Stage, Rig) {
    let motion = Motion::Ballistic {
        start: dvec3(-0.45, -0.1, 0.35),
        velocity: draws.usual_or_turned(dvec3(0.60, 0.15, 0.90), 3.0, 0.8..1.05),
        gravity: draws.usual_or(1.2, 0.9..1.3),
        spin: dvec3(0.0, 0.0, draws.usual_or(2.6, 1.8..3.2)),
    };
    let parts = vec![
        Part::new(
            Shape::Cuboid(dvec3(0.50, 0.33, 0.28)),
            DVec3::ZERO,
            Texture::new([0x0b6e4f, 0xf4c095, 0x3d348b], 0.6),
        ),
        Part::new(
            Shape::Ellipsoid(DVec3::splat(0.22)),
            dvec3(0.22, 0.0, 0.36),
            Texture::new([0xd00000, 0xfb8b24, 0xb5179e], 0.45),
        ),
    ];
    usual_or_framed(draws, alone("box", motion, DVec3::ZERO, parts), ring(dvec3(0.0, 0.05, 0.0), 5.0, 1.65))
}

/// A compound pendulum like a metronome's: a bar that turns about its middle, heavier below than above.
fn pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let motion = Motion::Pendulum {
        pivot: DVec3::ZERO,
        axis: DVec3::Y,
        amplitude: draws.usual_or(0.45, 0.35..0.6),
        small_angle_frequency: draws.usual_or(5.2, 4.4..5.8),
    };
    let parts = vec![
        Part::new(
            Shape::Ellipsoid(dvec3(0.40, 0.30, 0.40)),
            dvec3(0.0, 0.0, -0.80),
            Texture::new([0x2a1e5c, 0xee4266, 0xffd23f], 0.55),
        ),
        Part::new(
            Shape::Ellipsoid(dvec3(0.34, 0.28, 0.34)),
            dvec3(0.0, 0.0, 0.84),
            Texture::new([0x30343f, 0x8d99ae, 0xf2a65a], 0.4),
        ),
        Part::new(
            Shape::Cuboid(dvec3(0.10, 0.10, 0.55)),
            DVec3::ZERO,
            Texture::new([0x0a8754, 0x3bceac, 0x0b3954], 0.5),
        ),
    ];
    usual_or_framed(draws, alone("pendulum", motion, DVec3::ZERO, parts), ring(DVec3::ZERO, 4.4, 1.3))
}

fn spring(draws: &mut Draws) -> (Stage, Rig) {
    let displacement = draws.usual_or_turned(dvec3(0.70, -0.20, 0.20), 3.0, 0.8..1.05);
    let velocity = draws.usual_or_turned(dvec3(1.0, 2.3, 0.8), 3.0, 0.8..1.05);
    let frequency = draws.usual_or(4.2, 3.4..5.0);
    let motion = Motion::Harmonic { center: DVec3::ZERO, displacement, velocity, frequency };
    let texture = Texture::new([0x264653, 0x2a9d8f, 0xd1495b], 0.55);
    let block = Part::new(Shape::Cuboid(dvec3(0.36, 0.30, 0.33)), DVec3::ZERO, texture)
        .turned(dvec3(0.6, 0.0, 0.8), 0.5);
    let knob = Part::new(
        Shape::Ellipsoid(DVec3::splat(0.2)),
        dvec3(-0.1, -0.1, 0.38),
        Texture::new([0xe9c46a, 0x9d4edd, 0xc1121f], 0.4),
    );
    usual_or_framed(
        draws,
        alone("block", motion, DVec3::ZERO, vec![block, knob]),
        ring(DVec3::ZERO, 4.4, 1.25),
    )
}

fn sled(draws: &mut Draws) -> (Stage, Rig) {
    let velocity = draws.usual_or(1.4, 1.1..1.4) * DVec3::X;
    let motion = Motion::Drag { start: dvec3(0.07, 0.0, 0.0), velocity, drag: draws.usual_or(0.9, 0.6..1.0) };
    let steel = Texture::new([0x22333b, 0x5e81ac, 0x88a0a8], 0.4);
    let parts = vec![
        Part::new(
            Shape::Cuboid(dvec3(0.58, 0.33, 0.08)),
            dvec3(0.0, 0.0, 0.05),
            Texture::new([0x7f4f24, 0xd08c60, 0x582f0e], 0.4),
        ),
        Part::new(Shape::Cuboid(dvec3(0.66, 0.06, 0.08)), dvec3(0.04, 0.24, -0.11), steel),
        Part::new(Shape::Cuboid(dvec3(0.66, 0.06, 0.08)), dvec3(0.04, -0.24, -0.11), steel),
        Part::new(
            Shape::Ellipsoid(dvec3(0.30, 0.28, 0.28)),
            dvec3(-0.20, 0.0, 0.37),
            Texture::new([0xc1121f, 0xfdf0d5, 0x4a0d67], 0.5),
        ),
        Part::new(
            Shape::Cuboid(dvec3(0.17, 0.22, 0.19)),
            dvec3(0.32, 0.0, 0.31),
            Texture::new([0x386641, 0xd4b483, 0x1d3557], 0.45),
        ),
    ];
    usual_or_framed(
        draws,
        alone("sled", motion, dvec3(0.0, 0.0, 0.1), parts),
        ring(dvec3(0.0, 0.0, 0.05), 4.6, 1.55),
    )
}
