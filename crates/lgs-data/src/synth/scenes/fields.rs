//! Scenes of bodies that move without turning, in fields of force.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::laws::{Field, Pair, Point, Pull};
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, framed, simulated};
use glam::{DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 5] = [
    Entry::new(
        "kepler",
        "a body on an elliptic orbit about a centre that attracts as 1/r²",
        "k 8 to 14, nearest distance 0.5 to 0.62, eccentricity 0.15 to 0.4, plane within 0.9 rad of the \
         horizontal",
        kepler,
    ),
    Entry::new(
        "double-well",
        "a body that crosses between two wells of an even quartic potential",
        "quartic 8 to 14, half the wells' distance 0.5 to 0.65, stiffness across 8 to 16, energy 1.3 to 2.5 \
         times the barrier",
        double_well,
    ),
    Entry::new(
        "quadratic-drag",
        "a thrown body against drag that grows with the square of its speed, under gravity",
        "drag 0.45 to 0.7 per unit of length, g 0.4 to 0.8, speed 0.95 to 1.15",
        quadratic_drag,
    ),
    Entry::new(
        "magnet",
        "a charged body in a uniform magnetic field, with gravity for every other seed",
        "gyration 2.6 to 4.2, speed across 0.9 to 1.3 and along up to 0.15, g 0 or 0.2 to 0.4, field within \
         0.5 rad of the horizontal",
        magnet,
    ),
    Entry::new(
        "spring-pair",
        "two balls joined by a spring, thrown",
        "k 14 to 28, length 0.8 to 1, mass ratio 0.45 to 1.6, g 0.7 to 1.1",
        spring_pair,
    ),
];

/// A box or an ellipsoid in some orientation, with a knob that shows it.
fn knobbed(draws: &mut Draws) -> Vec<Part> {
    let half = dvec3(draws.within(0.30..0.38), draws.within(0.26..0.34), draws.within(0.28..0.36));
    let shape = if draws.happens(0.5) { Shape::Cuboid(0.9 * half) } else { Shape::Ellipsoid(half) };
    let orientation = draws.orientation();
    let mut solid = Part::new(shape, DVec3::ZERO, Texture::new(draws.palette(), draws.within(0.45..0.6)));
    solid.rotation = orientation;
    let knob = Part::new(
        Shape::Ellipsoid(DVec3::splat(0.16)),
        orientation * dvec3(0.05, -0.08, 0.30),
        Texture::new(draws.palette(), 0.35),
    );
    vec![solid, knob]
}

pub(super) fn body_in_fields(draws: &mut Draws, law: Point) -> (Stage, Rig) {
    let parts = knobbed(draws);
    let [motion] = simulated(law);
    framed(alone("body", motion, DVec3::ZERO, parts))
}

fn kepler(draws: &mut Draws) -> (Stage, Rig) {
    let (k, nearest, eccentricity) =
        (draws.within(8.0..14.0), draws.within(0.5..0.62), draws.within(0.15..0.4));
    let normal = draws.tilted(0.0..0.9) * draws.either_sign(0.999..1.0).signum();
    let out = normal.any_orthonormal_vector();
    let speed = (k * (1.0 + eccentricity) / nearest).sqrt();
    // A little before the nearest point or after it.
    let lead = draws.within(-0.5..0.5);
    let radius = nearest * (1.0 + eccentricity) / (1.0 + eccentricity * f64::cos(lead));
    let (sin, cos) = f64::sin_cos(lead);
    let sideways = normal.cross(out);
    let momentum = speed * nearest;
    let velocity = (k / momentum) * (-sin * out + (eccentricity + cos) * sideways);
    let law = Point {
        law: "central power law",
        kind: "conservative",
        start: radius * (cos * out + sin * sideways),
        velocity,
        fields: vec![Field::Power { center: DVec3::ZERO, k, n: -2.0 }],
    };
    body_in_fields(draws, law)
}

fn double_well(draws: &mut Draws) -> (Stage, Rig) {
    let (c, w, k) = (draws.within(8.0..14.0), draws.within(0.5..0.65), draws.within(8.0..16.0));
    let axis = draws.tilted(0.7..1.57);
    let across = axis.any_orthonormal_vector();
    let barrier = 0.25 * c * w * w * w * w;
    let x = draws.either_sign(0.5..1.0) * w;
    let rise = draws.within(1.3..2.5) * barrier - 0.25 * c * (x * x - w * w).powi(2);
    let along = (2.0 * rise).sqrt() * draws.either_sign(0.999..1.0).signum();
    let law = Point {
        law: "double well",
        kind: "conservative",
        start: x * axis + draws.within(0.0..0.15) * across,
        velocity: along * axis + draws.within(-0.4..0.4) * across.cross(axis),
        fields: vec![Field::DoubleWell { center: DVec3::ZERO, along: axis, c, w, k }],
    };
    body_in_fields(draws, law)
}

fn quadratic_drag(draws: &mut Draws) -> (Stage, Rig) {
    let (drag, gravity) = (draws.within(0.45..0.7), draws.within(0.4..0.8));
    let climb = draws.within(0.3..0.7f64);
    let direction = climb.cos() * draws.horizontal() + climb.sin() * DVec3::Z;
    let law = Point {
        law: "quadratic drag",
        kind: "dissipative",
        start: DVec3::ZERO,
        velocity: draws.within(0.95..1.15) * direction,
        fields: vec![Field::Gravity(gravity), Field::QuadraticDrag(drag)],
    };
    body_in_fields(draws, law)
}

fn magnet(draws: &mut Draws) -> (Stage, Rig) {
    let rise = draws.within(-0.5..0.5f64);
    let field = rise.cos() * draws.horizontal() + rise.sin() * DVec3::Z;
    let across = field.any_orthonormal_vector();
    let gravity = if draws.happens(0.5) { 0.0 } else { draws.within(0.2..0.4) };
    let fields = [Field::Magnetic(draws.either_sign(2.6..4.2) * field), Field::Gravity(gravity)];
    let law = Point {
        law: "uniform magnetic field",
        kind: "gyroscopic",
        start: DVec3::ZERO,
        velocity: draws.within(0.9..1.3) * across + draws.within(-0.15..0.15) * field,
        fields: fields.into_iter().take(if gravity == 0.0 { 1 } else { 2 }).collect(),
    };
    body_in_fields(draws, law)
}

fn spring_pair(draws: &mut Draws) -> (Stage, Rig) {
    let (length, mass_ratio, gravity) =
        (draws.within(0.8..1.0), draws.within(0.45..1.6), draws.within(0.7..1.1));
    let arm = draws.tilted(0.5..1.4);
    let across = arm.any_orthonormal_vector();
    let (stretched, turn) = (length * draws.within(1.15..1.4), draws.either_sign(0.3..0.8));
    // The centre of mass is thrown up, so that it falls back over the whole of the truth.
    let share = mass_ratio / (1.0 + mass_ratio);
    let thrown = draws.within(0.1..0.3) * draws.horizontal() + draws.within(0.6..0.8) * gravity * DVec3::Z;
    let law = Pair {
        starts: [-share * stretched * arm, (1.0 - share) * stretched * arm],
        velocities: [thrown - share * turn * across, thrown + (1.0 - share) * turn * across],
        mass_ratio,
        pull: Pull::Spring { k: draws.within(14.0..28.0), length },
        gravity,
    };
    let motions: [_; 2] = simulated(law);
    let body = |(name, motion)| {
        let radius = draws.within(0.26..0.34);
        let texture = Texture::new(draws.palette(), draws.within(0.35..0.5));
        let ball = Part::new(Shape::Ellipsoid(DVec3::splat(radius)), DVec3::ZERO, texture);
        Body::of(name, motion, ball)
    };
    let bodies = ["first", "second"].into_iter().zip(motions).map(body).collect();
    framed(Stage { bodies, fixed: Vec::new() })
}
