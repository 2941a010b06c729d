//! Scenes of bodies that turn, roll, deform or hit the floor.

use super::super::body::{Body, Part, Stage};
use super::super::bounce::Bounce;
use super::super::draws::Draws;
use super::super::laws::{Modal, RigidBody, Rolling};
use super::super::motion::Motion;
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, ball, floor, framed, simulated};
use glam::{DMat3, DQuat, DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 5] = [
    Entry::new(
        "rolling-ball",
        "a ball that rolls without slipping and slows down",
        "radius 0.36 to 0.46, speed 0.9 to 1.2, resistance 0.5 to 0.9 per unit of time",
        rolling_ball,
    ),
    Entry::new(
        "top",
        "a heavy symmetric top about a fixed tip: precession and nutation",
        "weight over inertia 2 to 4.5, spin 6 to 9, tilt 0.25 to 0.6 rad, disc radius 0.5 to 0.62",
        top,
    ),
    Entry::new(
        "tumbling",
        "an asymmetric body that tumbles freely about its intermediate axis",
        "half-edges 0.55 to 0.7, 0.38 to 0.46, 0.2 to 0.28 (homogeneous), spin 3 to 4.2, drift up to 0.12",
        tumbling,
    ),
    Entry::new(
        "vibration",
        "a body that vibrates and stretches in two damped modes",
        "frequencies 4 to 5.5 and 6.5 to 9, damping 0.05 to 0.3, amplitudes 0.32 to 0.45 and \
         0.25 to 0.45 of its size",
        vibration,
    ),
    Entry::new(
        "bounce",
        "a ball that bounces on a floor; before t = 0 it is in the flight of t = 0",
        "g 2.5 to 4, restitution 0.6 to 0.85, first impact at 0.3 to 0.5, horizontal speed 0.2 to 0.45, no \
         friction",
        bounce,
    ),
];

fn rolling_ball(draws: &mut Draws) -> (Stage, Rig) {
    let radius = draws.within(0.36..0.46);
    let law = Rolling {
        direction: draws.horizontal(),
        radius,
        speed: draws.within(0.9..1.2),
        resistance: draws.within(0.5..0.9),
        ..Rolling::at(DVec3::ZERO)
    };
    let ball = Part::new(
        Shape::Ellipsoid(DVec3::splat(radius)),
        DVec3::ZERO,
        Texture::new(draws.palette(), draws.within(0.45..0.6)),
    );
    let [motion] = simulated(law);
    framed(alone("ball", motion, DVec3::ZERO, vec![ball]))
}

fn top(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, half_height, arm) =
        (draws.within(0.5..0.62), draws.within(0.08..0.13), draws.within(0.4..0.5));
    // A homogeneous disc on a stem without mass, about the tip, per unit of mass.
    let across = 0.25 * radius * radius + half_height * half_height / 3.0 + arm * arm;
    let inertia = dvec3(across, across, 0.5 * radius * radius);
    let tilt = draws.within(0.25..0.6);
    let law = RigidBody {
        law: "heavy top",
        coordinates: "joint",
        rotation: DQuat::from_axis_angle(draws.horizontal(), tilt),
        spin: dvec3(draws.within(-0.6..0.6), draws.within(-0.6..0.6), draws.either_sign(6.0..9.0)),
        weight: across * draws.within(2.0..4.5),
        ..RigidBody::free(inertia)
    };
    let parts = vec![
        Part::new(
            Shape::Cylinder(radius, half_height),
            dvec3(0.0, 0.0, arm),
            Texture::new(draws.palette(), 0.5),
        ),
        Part::new(
            Shape::Cylinder(0.09, 0.5 * arm),
            dvec3(0.0, 0.0, 0.5 * arm),
            Texture::new(draws.palette(), 0.3),
        ),
        Part::new(
            Shape::Ellipsoid(dvec3(0.12, 0.12, 0.2)),
            dvec3(0.0, 0.0, arm + half_height),
            Texture::new(draws.palette(), 0.3),
        ),
    ];
    let [motion] = simulated(law);
    framed(alone("top", motion, dvec3(0.0, 0.0, 0.7 * arm), parts))
}

fn tumbling(draws: &mut Draws) -> (Stage, Rig) {
    let half = dvec3(draws.within(0.55..0.7), draws.within(0.38..0.46), draws.within(0.2..0.28));
    let squares = half * half;
    let orientation = draws.orientation();
    let law = RigidBody {
        drift: draws.within(0.03..0.12) * draws.horizontal(),
        rotation: DQuat::from_mat3(&orientation),
        spin: dvec3(draws.either_sign(0.2..0.6), draws.either_sign(3.0..4.2), draws.either_sign(0.2..0.6)),
        ..RigidBody::free(dvec3(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) / 3.0)
    };
    let solid = Part::new(Shape::Cuboid(half), DVec3::ZERO, Texture::new(draws.palette(), 0.55));
    let [motion] = simulated(law);
    framed(alone("box", motion, DVec3::ZERO, vec![solid]))
}

fn vibration(draws: &mut Draws) -> (Stage, Rig) {
    let (law, body) = jelly(draws);
    let [motion] = simulated(law);
    framed(alone("jelly", motion, DVec3::ZERO, vec![body]))
}

/// A body that vibrates in place.
pub(super) fn jelly(draws: &mut Draws) -> (Modal, Part) {
    let frame = draws.orientation();
    let (along, across) = (frame.x_axis, frame.y_axis);
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let stretch = outer(along, along) - 0.35 * (DMat3::IDENTITY - outer(along, along));
    let shear = 0.7 * (outer(along, across) + outer(across, along));
    let squared = |v: f64| v * v;
    let law = Modal {
        center: DVec3::ZERO,
        modes: [stretch, shear],
        amplitudes: [draws.either_sign(0.32..0.45), draws.either_sign(0.25..0.45)],
        rates: [draws.within(-1.0..1.0), draws.within(-1.0..1.0)],
        stiffness: [squared(draws.within(4.0..5.5)), squared(draws.within(6.5..9.0))],
        damping: [draws.within(0.05..0.3), draws.within(0.05..0.3)],
        velocity: DVec3::ZERO,
        gravity: 0.0,
    };
    let radii = dvec3(draws.within(0.55..0.75), draws.within(0.5..0.65), draws.within(0.5..0.7));
    (law, Part::new(Shape::Ellipsoid(radii), DVec3::ZERO, Texture::new(draws.palette(), 0.6)))
}

fn bounce(draws: &mut Draws) -> (Stage, Rig) {
    let (gravity, radius) = (draws.within(2.5..4.0), draws.within(0.26..0.34));
    // The flight of t = 0 would touch the floor at these two times.
    let (before, after) = (draws.within(0.82..0.95), draws.within(0.3..0.5));
    let across = draws.within(0.2..0.45) * draws.horizontal();
    let motion = Motion::Bounce(Bounce {
        start: dvec3(0.0, 0.0, 0.5 * gravity * before * after) - 0.75 * across,
        velocity: across + 0.5 * gravity * (after - before) * DVec3::Z,
        gravity,
        restitution: draws.within(0.6..0.85),
        rest_height: 0.0,
        walls: Vec::new(),
    });
    let ball = ball(draws, radius);
    framed(Stage { bodies: vec![Body::of("ball", motion, ball)], fixed: vec![floor(-radius, 1.5)] })
}
