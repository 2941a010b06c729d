//! Scenes of bodies that keep their orientation and are carried, held or thrown off by what surrounds them.

use super::super::body::Stage;
use super::super::draws::Draws;
use super::super::laws::{Field, Point};
use super::super::view::Rig;
use super::entry::Entry;
use super::everyday::block_on_floor;
use super::fields::body_in_fields;
use glam::DVec3;

pub(super) const ENTRIES: [Entry; 9] = [
    Entry::new(
        "wind",
        "a thrown body in a steady wind, with drag by the square of the speed in the air",
        "g 0.8 to 1.2, drag 0.2 to 0.35 per unit of length, wind 0.8 to 1.5",
        wind,
    ),
    Entry::new(
        "whirlpool",
        "a body that a rotating liquid drags along",
        "drag 0.6 to 1.2, rate of the liquid 1.5 to 2.5, distance from its axis 0.3 to 0.5",
        whirlpool,
    ),
    Entry::new(
        "stiffening-spring",
        "a body on a spring that grows stiffer as it is stretched",
        "k 8 to 14, cubic stiffness 20 to 40, displacement 0.5 to 0.7",
        stiffening_spring,
    ),
    Entry::new(
        "rubbing-spring",
        "a block on a spring that rubs on the floor",
        "k 20 to 36, deceleration 0.8 to 1.6, displacement 0.6 to 0.8",
        rubbing_spring,
    ),
    Entry::new(
        "magnetic-spiral",
        "a charged body that spirals inward in a magnetic field and a resisting medium",
        "gyration 3 to 5, drag 0.4 to 0.9, speed 1.8 to 2.6",
        magnetic_spiral,
    ),
    Entry::new(
        "bowl",
        "a body that slides without friction in a round bowl",
        "radius 0.9 to 1.2, g 8 to 12, angle from the bottom 0.5 to 0.9 rad",
        bowl,
    ),
    Entry::new(
        "two-centres",
        "a body attracted as 1/r² by two fixed centres",
        "k 3 to 6 each, distance of the centres 0.5 to 0.7, start 0.9 to 1.1 from their middle",
        two_centres,
    ),
    Entry::new(
        "scattering",
        "a body that a fixed centre repels as 1/r²",
        "k 0.8 to 1.6, speed 1.6 to 2.2, aimed 0.15 to 0.35 past the centre",
        scattering,
    ),
    Entry::new(
        "self-sustained",
        "a body on a spring that is pushed on while it swings little, and damped while it swings far",
        "stiffness 16 to 26, push 1 to 2, amplitude of balance 0.5 to 0.7, displacement 0.3 to 0.45",
        self_sustained,
    ),
];

fn wind(draws: &mut Draws) -> (Stage, Rig) {
    let gravity = draws.within(0.8..1.2);
    let law = Point {
        law: "drag in a wind",
        kind: "forced",
        start: DVec3::ZERO,
        velocity: draws.within(0.3..0.6) * draws.horizontal() + draws.within(0.8..1.0) * DVec3::Z,
        fields: vec![
            Field::Gravity(gravity),
            Field::Wind { k: draws.within(0.2..0.35), wind: draws.within(0.8..1.5) * draws.horizontal() },
        ],
    };
    body_in_fields(draws, law)
}

fn whirlpool(draws: &mut Draws) -> (Stage, Rig) {
    let (drag, rate) = (draws.within(0.6..1.2), draws.either_sign(1.5..2.5));
    let out = draws.horizontal();
    let start = draws.within(0.3..0.5) * out;
    let law = Point {
        law: "drag in a rotating liquid",
        kind: "driven",
        start,
        velocity: draws.within(-0.3..0.3) * out + 0.8 * rate * DVec3::Z.cross(start),
        fields: vec![Field::Whirl { k: drag, rate: rate * DVec3::Z }],
    };
    body_in_fields(draws, law)
}

fn stiffening_spring(draws: &mut Draws) -> (Stage, Rig) {
    let aside = draws.tilted(0.0..std::f64::consts::PI);
    let (k, cubic) = (draws.within(8.0..14.0), draws.within(20.0..40.0));
    let law = Point {
        law: "stiffening spring",
        kind: "conservative",
        start: draws.within(0.5..0.7) * aside,
        velocity: draws.within(0.5..1.5) * aside.any_orthonormal_vector(),
        fields: vec![
            Field::Power { center: DVec3::ZERO, k, n: 1.0 },
            Field::Power { center: DVec3::ZERO, k: cubic, n: 3.0 },
        ],
    };
    body_in_fields(draws, law)
}

fn rubbing_spring(draws: &mut Draws) -> (Stage, Rig) {
    let (k, friction) = (draws.within(20.0..36.0), draws.within(0.8..1.6));
    let direction = draws.horizontal();
    let law = Point {
        law: "spring with dry friction",
        kind: "dissipative",
        start: draws.either_sign(0.6..0.8) * direction,
        velocity: draws.within(-0.5..0.5) * direction,
        fields: vec![Field::Power { center: DVec3::ZERO, k, n: 1.0 }, Field::DryFriction(friction)],
    };
    block_on_floor(draws, law)
}

fn magnetic_spiral(draws: &mut Draws) -> (Stage, Rig) {
    let field = draws.tilted(0.0..0.8);
    let across = field.any_orthonormal_vector();
    let law = Point {
        law: "magnetic field in a resisting medium",
        kind: "dissipative",
        start: DVec3::ZERO,
        velocity: draws.within(1.8..2.6) * across + draws.within(-0.2..0.2) * field,
        fields: vec![
            Field::Magnetic(draws.either_sign(3.0..5.0) * field),
            Field::LinearDrag(draws.within(0.4..0.9)),
        ],
    };
    body_in_fields(draws, law)
}

fn bowl(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, gravity) = (draws.within(0.9..1.2), draws.within(8.0..12.0));
    let (aside, angle) = (draws.horizontal(), draws.within(0.5..0.9f64));
    let law = Point {
        law: "sliding in a bowl",
        kind: "conservative",
        start: radius * (angle.sin() * aside - angle.cos() * DVec3::Z),
        velocity: draws.either_sign(0.6..1.6) * aside.cross(DVec3::Z),
        fields: vec![Field::Bowl { gravity }],
    };
    body_in_fields(draws, law)
}

fn two_centres(draws: &mut Draws) -> (Stage, Rig) {
    let (between, out) = (draws.horizontal(), draws.within(0.9..1.1));
    let arm = 0.5 * draws.within(0.5..0.7) * between;
    let normal = (DVec3::Z + draws.within(-0.4..0.4) * between).normalize();
    let start = out * (0.6 * between + 0.8 * normal.cross(between));
    let k = [draws.within(3.0..6.0), draws.within(3.0..6.0)];
    let around = ((k[0] + k[1]) / out).sqrt() * draws.within(0.9..1.1);
    let law = Point {
        law: "two attracting centres",
        kind: "conservative",
        start,
        velocity: around * normal.cross(start.normalize()),
        fields: vec![
            Field::Power { center: arm, k: k[0], n: -2.0 },
            Field::Power { center: -arm, k: k[1], n: -2.0 },
        ],
    };
    body_in_fields(draws, law)
}

fn scattering(draws: &mut Draws) -> (Stage, Rig) {
    let (ahead, k) = (draws.horizontal(), draws.within(0.8..1.6));
    let past = draws.either_sign(0.15..0.35) * ahead.cross(DVec3::Z) + draws.within(-0.2..0.2) * DVec3::Z;
    let law = Point {
        law: "central repulsion",
        kind: "conservative",
        start: past - draws.within(0.8..1.0) * ahead,
        velocity: draws.within(1.6..2.2) * ahead,
        fields: vec![Field::Power { center: DVec3::ZERO, k: -k, n: -2.0 }],
    };
    body_in_fields(draws, law)
}

fn self_sustained(draws: &mut Draws) -> (Stage, Rig) {
    let aside = draws.tilted(0.0..1.5);
    let k = draws.within(16.0..26.0);
    let law = Point {
        law: "self-sustained oscillation",
        kind: "driven",
        start: draws.within(0.3..0.45) * aside,
        velocity: draws.within(-0.5..0.5) * aside,
        fields: vec![
            Field::Power { center: DVec3::ZERO, k, n: 1.0 },
            Field::SelfSustained { k: draws.within(1.0..2.0), amplitude: draws.within(0.5..0.7) },
        ],
    };
    body_in_fields(draws, law)
}
