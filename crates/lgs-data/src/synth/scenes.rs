//! The seven scenes: bodies, laws and cameras. Constants keep the moving bodies in view of most cameras over
//! [−0.75, 2.25], which a test checks.

use super::body::{Body, Part, Stage};
use super::motion::Motion;
use super::shape::Shape;
use super::texture::Texture;
use super::view::Rig;
use glam::{DMat3, DQuat, DVec3, dvec3};
use lgs_core::stream;
use rand::RngExt;
use std::f64::consts::TAU;

/// A scene's name and what moves in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneInfo {
    /// Name on the command line.
    pub name: &'static str,
    /// One line on what it shows.
    pub description: &'static str,
}

/// A scene ready to be photographed.
pub(super) struct Scene {
    pub(super) info: SceneInfo,
    pub(super) stage: Stage,
    pub(super) rig: Rig,
}

type Build = fn() -> (Stage, Rig);

const SCENES: [(SceneInfo, Build); 7] = [
    (
        SceneInfo { name: "falling-ball", description: "a ball in free fall from rest: uniform gravity" },
        falling_ball,
    ),
    (
        SceneInfo {
            name: "fan",
            description: "three blades and a hub in uniform rotation about a fixed axis",
        },
        fan,
    ),
    (
        SceneInfo {
            name: "projectile",
            description: "a thrown box with a constant spin: gravity and rotation",
        },
        projectile,
    ),
    (
        SceneInfo { name: "pendulum", description: "a rigid pendulum of large amplitude, released at rest" },
        pendulum,
    ),
    (
        SceneInfo {
            name: "spring",
            description: "a block on an isotropic spring, pushed off the axis: an ellipse",
        },
        spring,
    ),
    (SceneInfo { name: "sled", description: "a sled sliding straight against linear drag" }, sled),
    (
        SceneInfo {
            name: "room",
            description: "a static furnished room with three independent moving bodies: crate, turntable, circling ball",
        },
        room,
    ),
];

/// All scenes.
#[must_use]
pub fn scenes() -> Vec<SceneInfo> {
    SCENES.iter().map(|(info, _)| *info).collect()
}

/// The scene of a name; the seed shifts its textures.
pub(super) fn scene(name: &str, seed: u64) -> Option<Scene> {
    let &(info, build) = SCENES.iter().find(|(info, _)| info.name == name)?;
    let (mut stage, rig) = build();
    let mut rng = stream(seed, "synthetic textures", 0);
    let parts = stage.bodies.iter_mut().flat_map(|body| &mut body.parts).chain(&mut stage.fixed);
    parts.for_each(|part| part.texture.phase = rng.random_range(0.0..TAU));
    Some(Scene { info, stage, rig })
}

/// A camera ring of radius `distance` that frames a square of half-side `half` at the target.
fn ring(target: DVec3, distance: f64, half: f64) -> Rig {
    Rig::Hemisphere { target, distance, fov: 2.0 * (half / distance).atan() }
}

fn alone(name: &'static str, motion: Motion, center: DVec3, parts: Vec<Part>) -> Stage {
    Stage { bodies: vec![Body { name, motion, parts, center }], fixed: Vec::new() }
}

fn falling_ball() -> (Stage, Rig) {
    let motion = Motion::Ballistic {
        start: dvec3(0.0, 0.0, 1.0),
        velocity: DVec3::ZERO,
        gravity: 0.9,
        spin: DVec3::ZERO,
    };
    let texture = Texture::new([0xd7263d, 0x1b2a6b, 0xf2a541], 0.55);
    let ball = Part::new(Shape::Ellipsoid(DVec3::splat(0.5)), DVec3::ZERO, texture);
    (alone("ball", motion, DVec3::ZERO, vec![ball]), ring(dvec3(0.0, 0.0, -0.1), 5.0, 1.7))
}

fn fan() -> (Stage, Rig) {
    let axis = dvec3(0.30, -0.20, 0.93).normalize();
    let motion = Motion::Rotor { center: DVec3::ZERO, spin: 2.4 * axis, phase: 0.0 };
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
    (alone("rotor", motion, DVec3::ZERO, parts), ring(DVec3::ZERO, 4.0, 1.15))
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
fn projectile() -> (Stage, Rig) {
    let motion = Motion::Ballistic {
        start: dvec3(-0.45, -0.1, 0.35),
        velocity: dvec3(0.60, 0.15, 0.90),
        gravity: 1.2,
        spin: dvec3(0.0, 0.0, 2.6),
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
    (alone("box", motion, DVec3::ZERO, parts), ring(dvec3(0.0, 0.05, 0.0), 5.0, 1.65))
}

/// A compound pendulum like a metronome's: a bar that turns about its middle, heavier below than above.
fn pendulum() -> (Stage, Rig) {
    let motion =
        Motion::Pendulum { pivot: DVec3::ZERO, axis: DVec3::Y, amplitude: 0.45, small_angle_frequency: 5.2 };
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
    (alone("pendulum", motion, DVec3::ZERO, parts), ring(DVec3::ZERO, 4.4, 1.3))
}

fn spring() -> (Stage, Rig) {
    let (displacement, velocity) = (dvec3(0.70, -0.20, 0.20), dvec3(1.0, 2.3, 0.8));
    let motion = Motion::Harmonic { center: DVec3::ZERO, displacement, velocity, frequency: 4.2 };
    let texture = Texture::new([0x264653, 0x2a9d8f, 0xd1495b], 0.55);
    let block = Part::new(Shape::Cuboid(dvec3(0.36, 0.30, 0.33)), DVec3::ZERO, texture)
        .turned(dvec3(0.6, 0.0, 0.8), 0.5);
    let knob = Part::new(
        Shape::Ellipsoid(DVec3::splat(0.2)),
        dvec3(-0.1, -0.1, 0.38),
        Texture::new([0xe9c46a, 0x9d4edd, 0xc1121f], 0.4),
    );
    (alone("block", motion, DVec3::ZERO, vec![block, knob]), ring(DVec3::ZERO, 4.4, 1.25))
}

fn sled() -> (Stage, Rig) {
    let motion = Motion::Drag { start: dvec3(0.07, 0.0, 0.0), velocity: dvec3(1.4, 0.0, 0.0), drag: 0.9 };
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
    (alone("sled", motion, dvec3(0.0, 0.0, 0.1), parts), ring(dvec3(0.0, 0.0, 0.05), 4.6, 1.55))
}

fn room() -> (Stage, Rig) {
    let stage = Stage { bodies: vec![crate_on_a_spring(), turntable(), circling_ball()], fixed: furniture() };
    (stage, Rig::Arc { target: dvec3(0.0, 0.5, 1.0), y: -2.9, reach: 2.0, heights: [0.8, 2.3], fov: 1.22 })
}

fn furniture() -> Vec<Part> {
    let wall = Texture::new([0xcfc6b8, 0xa8b5b2, 0xd9b99b], 1.9).with_contrast(0.8);
    let floor = Texture::new([0x8a6a4f, 0xb08968, 0x6f5a48], 1.2).with_contrast(0.7);
    vec![
        Part::new(Shape::Interior(dvec3(2.6, 2.7, 1.6)), dvec3(0.0, -0.5, 1.6), wall),
        Part::new(Shape::Cuboid(dvec3(2.6, 2.7, 0.01)), dvec3(0.0, -0.5, 0.0), floor),
        Part::new(
            Shape::Cuboid(dvec3(0.35, 0.30, 0.75)),
            dvec3(2.2, 1.85, 0.75),
            Texture::new([0x3a506b, 0x5bc0be, 0x1c2541], 0.9),
        ),
        Part::new(
            Shape::Cuboid(dvec3(0.75, 0.22, 0.30)),
            dvec3(-0.3, 1.95, 0.30),
            Texture::new([0x6b705c, 0xcb997e, 0x3f4238], 0.8),
        ),
    ]
}

fn crate_on_a_spring() -> Body {
    let motion = Motion::Harmonic {
        center: dvec3(1.15, 0.55, 0.47),
        displacement: dvec3(0.58, 0.0, 0.0),
        velocity: DVec3::ZERO,
        frequency: 5.0,
    };
    let texture = Texture::new([0xc1121f, 0xffba08, 0x6a040f], 0.7);
    Body {
        name: "crate",
        motion,
        parts: vec![Part::new(Shape::Cuboid(DVec3::splat(0.45)), DVec3::ZERO, texture)],
        center: DVec3::ZERO,
    }
}

fn turntable() -> Body {
    let motion = Motion::Rotor { center: dvec3(-1.25, 0.40, 0.0), spin: dvec3(0.0, 0.0, 2.6), phase: 0.0 };
    let parts = vec![
        Part::new(
            Shape::Cylinder(0.78, 0.12),
            dvec3(0.0, 0.0, 0.13),
            Texture::new([0x023047, 0x8ecae6, 0xffb703], 0.8),
        ),
        Part::new(
            Shape::Cuboid(dvec3(0.20, 0.30, 0.36)),
            dvec3(0.38, 0.05, 0.61),
            Texture::new([0x7b2cbf, 0xff9e00, 0x240046], 0.6),
        ),
        Part::new(
            Shape::Ellipsoid(DVec3::splat(0.30)),
            dvec3(-0.36, -0.05, 0.55),
            Texture::new([0x006d77, 0xedf6f9, 0x2b2d42], 0.5),
        ),
    ];
    Body { name: "turntable", motion, parts, center: dvec3(0.0, 0.0, 0.45) }
}

fn circling_ball() -> Body {
    let (displacement, velocity) = (dvec3(-0.90, 0.0, 0.15), dvec3(0.5, 0.4, 2.0));
    let motion = Motion::Harmonic { center: dvec3(0.05, -0.25, 2.0), displacement, velocity, frequency: 4.4 };
    let skin = Texture::new([0x14532d, 0xf1faee, 0xd00070], 0.65);
    Body {
        name: "circling ball",
        motion,
        parts: vec![Part::new(Shape::Ellipsoid(DVec3::splat(0.5)), DVec3::ZERO, skin)],
        center: DVec3::ZERO,
    }
}
