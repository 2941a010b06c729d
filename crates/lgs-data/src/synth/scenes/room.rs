//! The room: independent moving bodies among furniture that stands still. Seed 0 keeps its constants.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::motion::Motion;
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::Entry;
use glam::{DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 1] = [Entry::new(
    "room",
    "a static furnished room with three independent moving bodies: crate, turntable, circling ball",
    "crate: amplitude 0.46 to 0.58 (seed 0: 0.58), frequency 4.2 to 5.4 (5); turntable: rate 1.9 to 3.2 \
     (2.6); ball: frequency 4.1 to 4.7 (4.4), amplitudes scaled by 0.8 to 1",
    room,
)];

fn room(draws: &mut Draws) -> (Stage, Rig) {
    let stage = Stage {
        bodies: vec![crate_on_a_spring(draws), turntable(draws), circling_ball(draws)],
        fixed: furniture(),
    };
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

fn crate_on_a_spring(draws: &mut Draws) -> Body {
    let motion = Motion::Harmonic {
        center: dvec3(1.15, 0.55, 0.47),
        displacement: dvec3(draws.usual_or(0.58, 0.46..0.58), 0.0, 0.0),
        velocity: DVec3::ZERO,
        frequency: draws.usual_or(5.0, 4.2..5.4),
    };
    let texture = Texture::new([0xc1121f, 0xffba08, 0x6a040f], 0.7);
    Body::of("crate", motion, Part::new(Shape::Cuboid(DVec3::splat(0.45)), DVec3::ZERO, texture))
}

fn turntable(draws: &mut Draws) -> Body {
    let spin = dvec3(0.0, 0.0, draws.usual_or(2.6, 1.9..3.2));
    let motion = Motion::Rotor { center: dvec3(-1.25, 0.40, 0.0), spin, phase: 0.0 };
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

fn circling_ball(draws: &mut Draws) -> Body {
    let displacement = draws.usual_or(1.0, 0.8..1.0) * dvec3(-0.90, 0.0, 0.15);
    let velocity = draws.usual_or(1.0, 0.8..1.0) * dvec3(0.5, 0.4, 2.0);
    let frequency = draws.usual_or(4.4, 4.1..4.7);
    let motion = Motion::Harmonic { center: dvec3(0.05, -0.25, 2.0), displacement, velocity, frequency };
    let skin = Texture::new([0x14532d, 0xf1faee, 0xd00070], 0.65);
    Body::of("circling ball", motion, Part::new(Shape::Ellipsoid(DVec3::splat(0.5)), DVec3::ZERO, skin))
}
