//! Scenes of bodies on hinges.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::laws::{DoublePendulum, Hinge};
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, framed, simulated};
use glam::{DMat3, DQuat, DVec3, dvec3};
use std::f64::consts::TAU;

pub(super) const ENTRIES: [Entry; 4] = [
    Entry::new(
        "large-pendulum",
        "a pendulum that swings beyond 90 degrees about a hinge",
        "k = m g l / I 14 to 24, amplitude 1.75 to 2.45 rad, start within the swing, axis within 0.3 rad of \
         the horizontal",
        large_pendulum,
    ),
    Entry::new(
        "double-pendulum",
        "a pendulum hung on a pendulum: two hinges",
        "g 6 to 9, lengths 0.5 to 0.68, mass ratio 0.4 to 1, angles 0.4 to 1 rad, rates up to 1",
        double_pendulum,
    ),
    Entry::new(
        "spun-up-fan",
        "a fan spun up by a constant torque against linear drag",
        "torque over inertia 2 to 4, drag 0.2 to 0.6, rate at the start 0.3 to 1, axis within 0.6 rad of the \
         vertical, 3 to 5 blades",
        spun_up_fan,
    ),
    Entry::new(
        "torsion-spring",
        "a bar that swings on a torsion spring and is damped a little",
        "k 16 to 36, drag 0.1 to 0.4, angle 0.7 to 1.3 rad, rate up to 2, axis within 0.5 rad of the \
         vertical",
        torsion_spring,
    ),
];

/// A pendulum's body below its hinge along y: a rod and a bob.
fn hanging(draws: &mut Draws, length: f64, side: f64) -> Vec<Part> {
    let bob = dvec3(draws.within(0.26..0.34), draws.within(0.20..0.30), draws.within(0.26..0.34));
    let offset = dvec3(0.0, side, 0.0);
    vec![
        Part::new(
            Shape::Cuboid(dvec3(0.09, 0.07, 0.5 * length)),
            offset - dvec3(0.0, 0.0, 0.5 * length),
            Texture::new(draws.palette(), 0.4),
        ),
        Part::new(
            Shape::Ellipsoid(bob),
            offset - dvec3(0.0, 0.0, length),
            Texture::new(draws.palette(), 0.45),
        ),
    ]
}

fn large_pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let tilt = draws.within(-0.3..0.3f64);
    let axis = draws.horizontal() * tilt.cos() + DVec3::Z * tilt.sin();
    let up = (DVec3::Z - axis * axis.z).normalize();
    let (gravity, amplitude) = (draws.within(14.0..24.0), draws.within(1.75..2.45f64));
    let angle = amplitude * draws.either_sign(0.3..0.9);
    let rate =
        (2.0 * gravity * (angle.cos() - amplitude.cos())).sqrt() * draws.either_sign(0.999..1.0).signum();
    let base = DMat3::from_cols(axis.cross(up), axis, up);
    let (law, kind) = ("hinge under gravity", "conservative");
    let law = Hinge { law, kind, angle, rate, gravity, ..Hinge::about(axis, base) };
    swinging(draws, "pendulum", law)
}

/// A pendulum that follows the law of a hinge.
pub(super) fn swinging(draws: &mut Draws, name: &'static str, law: Hinge) -> (Stage, Rig) {
    let length = draws.within(0.75..0.95);
    let parts = hanging(draws, length, 0.0);
    let [motion] = simulated(law);
    framed(alone(name, motion, dvec3(0.0, 0.0, -0.7 * length), parts))
}

fn double_pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let lengths = [draws.within(0.5..0.68), draws.within(0.5..0.68)];
    let law = DoublePendulum {
        pivot: DVec3::ZERO,
        axis: draws.horizontal(),
        lengths,
        mass_ratio: draws.within(0.4..1.0),
        gravity: draws.within(6.0..9.0),
        angles: [draws.either_sign(0.4..1.0), draws.either_sign(0.4..1.0)],
        rates: [draws.within(-1.0..1.0), draws.within(-1.0..1.0)],
    };
    let motions: [_; 2] = simulated(law);
    let names = ["upper", "lower"];
    // Side by side along the axis, or the rods would pass through one another.
    let body = |(i, motion)| Body {
        name: names[i],
        motion,
        parts: hanging(draws, lengths[i], [-0.14, 0.2][i]),
        center: dvec3(0.0, 0.0, -0.6 * lengths[i]),
    };
    framed(Stage { bodies: motions.into_iter().enumerate().map(body).collect(), fixed: Vec::new() })
}

/// World axes from body axes that take the body's z axis to `axis`.
pub(super) fn upright(axis: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, axis))
}

fn spun_up_fan(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.tilted(0.1..0.6);
    let sign = draws.either_sign(0.999..1.0).signum();
    let law = Hinge {
        law: "hinge under a constant torque",
        kind: "driven",
        rate: sign * draws.within(0.3..1.0),
        torque: sign * draws.within(2.0..4.0),
        drag: draws.within(0.2..0.6),
        ..Hinge::about(axis, upright(axis))
    };
    turning_rotor(draws, "rotor", law)
}

/// A rotor that follows the law of a hinge.
pub(super) fn turning_rotor(draws: &mut Draws, name: &'static str, law: Hinge) -> (Stage, Rig) {
    let parts = rotor(draws);
    let [motion] = simulated(law);
    framed(alone(name, motion, DVec3::ZERO, parts))
}

/// Three to five blades about a hub, which turn about z.
fn rotor(draws: &mut Draws) -> Vec<Part> {
    let blades = draws.within(3.0..6.0) as usize;
    let (length, width, pitch) =
        (draws.within(0.34..0.44), draws.within(0.15..0.21), draws.within(0.25..0.6));
    let mut parts: Vec<Part> = (0..blades)
        .map(|i| {
            let turn = DMat3::from_rotation_z(TAU * i as f64 / blades as f64);
            let place = turn * dvec3(0.18 + length, 0.0, 0.0);
            let mut blade = Part::new(
                Shape::Cuboid(dvec3(length, width, 0.045)),
                place,
                Texture::new(draws.palette(), 0.45),
            );
            blade.rotation = turn * DMat3::from_rotation_x(pitch);
            blade
        })
        .collect();
    parts.push(Part::new(Shape::Cylinder(0.24, 0.15), DVec3::ZERO, Texture::new(draws.palette(), 0.4)));
    parts
}

fn torsion_spring(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.tilted(0.0..0.5);
    let law = Hinge {
        law: "torsion spring",
        kind: "dissipative",
        angle: draws.either_sign(0.7..1.3),
        rate: draws.within(-2.0..2.0),
        stiffness: draws.within(16.0..36.0),
        drag: draws.within(0.1..0.4),
        ..Hinge::about(axis, upright(axis))
    };
    let (length, radius) = (draws.within(0.7..0.9), draws.within(0.24..0.32));
    let knob = |x: f64, palette| {
        Part::new(Shape::Ellipsoid(DVec3::splat(radius)), dvec3(x, 0.0, 0.0), Texture::new(palette, 0.45))
    };
    let bar = Shape::Cuboid(dvec3(length, 0.14, 0.12));
    let parts = vec![
        Part::new(bar, DVec3::ZERO, Texture::new(draws.palette(), 0.45)),
        knob(length, draws.palette()),
        knob(-length, draws.palette()),
    ];
    let [motion] = simulated(law);
    framed(alone("bar", motion, DVec3::ZERO, parts))
}
