//! Scenes whose very laws are drawn: a body in a random combination of fields, one on a hinge with a random
//! combination of torques.

use super::super::body::Stage;
use super::super::draws::Draws;
use super::super::laws::{Field, Hinge, Point};
use super::super::view::Rig;
use super::entry::Entry;
use super::fields::body_in_fields;
use super::hinges::{swinging, turning_rotor, upright};
use super::machines::horizontal_hinge;
use glam::{DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 2] = [
    Entry::new(
        "random-fields",
        "a body in fields drawn at random: what holds it, gravity, a magnetic field, what resists it",
        "held by nothing, springs, a power of the distance, a band, a double well or a stiffening spring; \
         often gravity 0.5 to 2, sometimes a gyration of 1 to 3; resisted by nothing, linear or quadratic \
         drag, dry friction or a wind",
        random_fields,
    ),
    Entry::new(
        "random-hinge",
        "a body on a hinge with torques drawn at random: what it swings on, a motor, what resists it",
        "held by nothing, its weight, its weight and a magnet, a torsion spring, or weight and spring; \
         often a torque of 2 to 6 where there is no spring; resisted by nothing, linear or quadratic drag, \
         or dry friction",
        random_hinge,
    ),
];

fn random_fields(draws: &mut Draws) -> (Stage, Rig) {
    let (start, velocity, mut fields) = held(draws);
    if fields.is_empty() {
        fields.push(Field::Gravity(draws.within(0.6..1.2)));
    } else if draws.happens(0.4) {
        fields.push(Field::Gravity(draws.within(0.5..2.0)));
    }
    if draws.happens(0.3) {
        fields.push(Field::Magnetic(draws.either_sign(1.0..3.0) * draws.tilted(0.0..1.5)));
    }
    fields.extend(resistance(draws));
    let keeps_energy = |field: &Field| field.is_conservative() || matches!(field, Field::Magnetic(_));
    let kind = if fields.iter().all(keeps_energy) { "conservative" } else { "forced" };
    let law = Point { law: "fields drawn at random", kind, start, velocity, fields };
    body_in_fields(draws, law)
}

/// A start, a velocity and the fields that hold a body, if any do.
fn held(draws: &mut Draws) -> (DVec3, DVec3, Vec<Field>) {
    let (out, rate) = (draws.tilted(0.5..1.57), draws.within(3.0..5.0));
    let across = out.any_orthonormal_vector();
    let (from, speed) = (draws.within(0.5..0.7), draws.either_sign(0.2..1.5));
    let (start, velocity) = (from * out, speed * across + draws.within(-0.4..0.4) * out);
    let center = DVec3::ZERO;
    match draws.one_of(6) {
        0 => {
            let thrown = draws.within(0.3..0.6) * draws.horizontal() + draws.within(0.7..1.0) * DVec3::Z;
            (DVec3::ZERO, thrown, Vec::new())
        }
        1 => {
            let mut stiffness = || draws.within(8.0..30.0);
            let k = dvec3(stiffness(), stiffness(), stiffness());
            (start, velocity, vec![Field::Spring { center, frame: draws.orientation(), k }])
        }
        2 => {
            let n = draws.within(-2.0..3.0f64);
            let k = rate * rate * from.powf(1.0 - n);
            // What attracts more from near is not flown into.
            let around = draws.within(0.85..1.1) * rate * from * across;
            (start, if n < 0.0 { around } else { velocity }, vec![Field::Power { center, k, n }])
        }
        3 => {
            let band = Field::RestLength {
                end: -0.2 * out,
                k: draws.within(16.0..36.0),
                length: draws.within(0.5..0.7),
            };
            (start, velocity, vec![band])
        }
        4 => (start, velocity, vec![double_well(draws, out)]),
        _ => (start, velocity, stiffening_spring(draws)),
    }
}

fn double_well(draws: &mut Draws, along: DVec3) -> Field {
    let (c, w, k) = (draws.within(8.0..14.0), draws.within(0.4..0.55), draws.within(8.0..16.0));
    Field::DoubleWell { center: DVec3::ZERO, along, c, w, k }
}

fn stiffening_spring(draws: &mut Draws) -> Vec<Field> {
    let center = DVec3::ZERO;
    let (k, cubic) = (draws.within(6.0..14.0), draws.within(15.0..40.0));
    vec![Field::Power { center, k, n: 1.0 }, Field::Power { center, k: cubic, n: 3.0 }]
}

fn resistance(draws: &mut Draws) -> Option<Field> {
    match draws.one_of(6) {
        0 | 1 => None,
        2 => Some(Field::LinearDrag(draws.within(0.2..0.9))),
        3 => Some(Field::QuadraticDrag(draws.within(0.2..0.35))),
        4 => Some(Field::DryFriction(draws.within(0.5..1.2))),
        _ => {
            let wind = draws.within(0.6..1.2) * draws.horizontal();
            Some(Field::Wind { k: draws.within(0.2..0.35), wind })
        }
    }
}

/// Whether a body on a hinge has a weight, a magnet below it and a torsion spring.
const HOLDS: [[bool; 3]; 5] = [
    [false, false, false],
    [true, false, false],
    [true, true, false],
    [false, false, true],
    [true, false, true],
];

fn random_hinge(draws: &mut Draws) -> (Stage, Rig) {
    let [hangs, has_magnet, has_spring] = HOLDS[draws.one_of(HOLDS.len())];
    let hinge = if hangs {
        horizontal_hinge(draws)
    } else {
        let axis = draws.tilted(0.1..0.6);
        Hinge::about(axis, upright(axis))
    };
    let mut law = Hinge { law: "torques drawn at random", kind: "forced", ..hinge };
    (law.angle, law.rate) = if hangs || has_spring {
        (draws.either_sign(0.5..1.6), draws.within(-2.0..2.0))
    } else {
        (0.0, draws.either_sign(2.0..5.0))
    };
    if hangs {
        law.gravity = draws.within(10.0..22.0);
    }
    if has_magnet {
        law.second_harmonic = draws.either_sign(0.3..0.9) * law.gravity;
    }
    if has_spring {
        law.stiffness = draws.within(if hangs { 8.0..16.0 } else { 14.0..34.0 });
    }
    // A torque on a spring is the same as the spring turned.
    if !has_spring && draws.happens(0.4) {
        law.torque = draws.either_sign(2.0..6.0);
    }
    match draws.one_of(4) {
        1 => law.drag = draws.within(0.2..0.9),
        2 => law.quadratic_drag = draws.within(0.05..0.2),
        3 => law.friction = draws.within(1.0..3.0),
        _ => {}
    }
    if hangs { swinging(draws, "pendulum", law) } else { turning_rotor(draws, "wheel", law) }
}
