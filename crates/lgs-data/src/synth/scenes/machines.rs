//! Scenes of wheels, pendulums, tops and rockets whose laws have several terms.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::laws::{Hinge, Pair, Pull, RigidBody, Rolling};
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, ball, floor, framed, simulated};
use super::hinges::{swinging, turning_rotor, upright};
use glam::{DMat3, DQuat, DVec3, dvec3};
use std::f64::consts::PI;

pub(super) const ENTRIES: [Entry; 10] = [
    Entry::new(
        "driven-pendulum",
        "a pendulum on the shaft of a motor, damped",
        "k = m g l / I 12 to 20, torque 4 to 8, drag 0.4 to 1, angle at the start 0.3 to 0.7 rad against the \
         torque",
        driven_pendulum,
    ),
    Entry::new(
        "falling-pole",
        "a pole on a hinge that falls over from near its upright, in air",
        "k = m g l / I 5 to 9, angle from the upright 0.3 to 0.6 rad, drag 0.2 to 0.5",
        falling_pole,
    ),
    Entry::new(
        "rubbing-balance",
        "a torsion spring whose bearing rubs",
        "stiffness 24 to 40, friction 1.5 to 3.5 rad per squared unit of time, angle 1 to 1.5 rad",
        rubbing_balance,
    ),
    Entry::new(
        "flywheel",
        "a paddle wheel that the air brakes by the square of its rate",
        "rate 4 to 6, drag 0.05 to 0.1 per radian",
        flywheel,
    ),
    Entry::new(
        "magnet-pendulum",
        "a pendulum with a magnet at its lowest point, which repels it",
        "k = m g l / I 14 to 20, second harmonic 0.6 to 0.9 of it, angle 1.2 to 1.8 rad",
        magnet_pendulum,
    ),
    Entry::new(
        "rolling-spring",
        "a ball that rolls on a floor, held by a spring at its centre",
        "radius 0.3 to 0.4, stiffness over mass 12 to 24, displacement 0.5 to 0.7, drag 0.1 to 0.4",
        rolling_spring,
    ),
    Entry::new(
        "yo-yo",
        "a disc that unwinds from a vertical string",
        "radius of the axle 0.1 to 0.16, acceleration 0.5 to 0.9, thrown up by 0.4 to 0.6 of it",
        yo_yo,
    ),
    Entry::new(
        "rocket",
        "a body whose engine pushes along its own axis while it turns",
        "thrust 1 to 2, rate 2 to 4",
        rocket,
    ),
    Entry::new(
        "braked-top",
        "a leaning top on a tip whose bearing takes its spin away",
        "weight over inertia 3 to 6, spin 16 to 24, tilt 0.3 to 0.6 rad, drag of the spin 0.2 to 0.5",
        braked_top,
    ),
    Entry::new(
        "repelling-pair",
        "two balls that repel each other as 1/r²",
        "k 0.5 to 0.9, distance 0.7 to 0.9, mass ratio 0.5 to 1, speed towards each other 0.4 to 0.8",
        repelling_pair,
    ),
];

/// A hinge with a horizontal axis, whose body hangs along −z at θ = 0.
pub(super) fn horizontal_hinge(draws: &mut Draws) -> Hinge {
    let axis = draws.horizontal();
    Hinge::about(axis, DMat3::from_cols(axis.cross(DVec3::Z), axis, DVec3::Z))
}

fn driven_pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let hinge = horizontal_hinge(draws);
    let torque = draws.either_sign(4.0..8.0);
    let law = Hinge {
        law: "hinge under gravity and a constant torque",
        kind: "forced",
        angle: -torque.signum() * draws.within(0.3..0.7),
        rate: draws.within(-1.0..1.0),
        gravity: draws.within(12.0..20.0),
        torque,
        drag: draws.within(0.4..1.0),
        ..hinge
    };
    swinging(draws, "pendulum", law)
}

fn falling_pole(draws: &mut Draws) -> (Stage, Rig) {
    let hinge = horizontal_hinge(draws);
    let law = Hinge {
        law: "damped hinge under gravity",
        kind: "dissipative",
        angle: PI - draws.within(0.3..0.6),
        rate: draws.within(-0.2..0.2),
        gravity: draws.within(5.0..9.0),
        drag: draws.within(0.2..0.5),
        ..hinge
    };
    swinging(draws, "pendulum", law)
}

fn rubbing_balance(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.tilted(0.1..0.6);
    let law = Hinge {
        law: "torsion spring with dry friction",
        kind: "dissipative",
        angle: draws.either_sign(1.0..1.5),
        rate: draws.within(-1.0..1.0),
        stiffness: draws.within(24.0..40.0),
        friction: draws.within(1.5..3.5),
        ..Hinge::about(axis, upright(axis))
    };
    turning_rotor(draws, "wheel", law)
}

fn flywheel(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.tilted(0.1..0.6);
    let law = Hinge {
        law: "hinge with quadratic drag",
        kind: "dissipative",
        rate: draws.either_sign(4.0..6.0),
        quadratic_drag: draws.within(0.05..0.1),
        ..Hinge::about(axis, upright(axis))
    };
    turning_rotor(draws, "wheel", law)
}

fn magnet_pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let hinge = horizontal_hinge(draws);
    let gravity = draws.within(14.0..20.0);
    let law = Hinge {
        law: "pendulum over a magnet",
        kind: "conservative",
        angle: draws.either_sign(1.2..1.8),
        rate: draws.within(-1.0..1.0),
        gravity,
        second_harmonic: -draws.within(0.6..0.9) * gravity,
        ..hinge
    };
    swinging(draws, "pendulum", law)
}

fn rolling_spring(draws: &mut Draws) -> (Stage, Rig) {
    let radius = draws.within(0.3..0.4);
    let direction = draws.horizontal();
    let displaced = draws.either_sign(0.5..0.7);
    let law = Rolling {
        direction,
        normal: DVec3::Z,
        radius,
        place: displaced,
        speed: draws.within(-0.5..0.5),
        // Two sevenths of what a spring pulls turn the ball.
        stiffness: draws.within(12.0..24.0) / 1.4,
        resistance: draws.within(0.1..0.4),
        ..Rolling::at(DVec3::ZERO)
    };
    let ball = ball(draws, radius);
    let [motion] = simulated(law);
    framed(Stage { bodies: vec![Body::of("ball", motion, ball)], fixed: vec![floor(-radius, 1.6)] })
}

fn yo_yo(draws: &mut Draws) -> (Stage, Rig) {
    let (axis, axle) = (draws.horizontal(), draws.within(0.1..0.16));
    let fall = draws.within(0.5..0.9);
    let law = Hinge {
        law: "disc on a string",
        kind: "conservative",
        rate: -draws.within(0.4..0.6) * fall / axle,
        torque_of_weight: fall / axle,
        advance: -axle * DVec3::Z,
        ..Hinge::about(axis, upright(axis))
    };
    let disc = Part::new(
        Shape::Cylinder(draws.within(0.34..0.44), draws.within(0.1..0.16)),
        DVec3::ZERO,
        Texture::new(draws.palette(), draws.within(0.4..0.55)),
    );
    let [motion] = simulated(law);
    framed(alone("disc", motion, DVec3::ZERO, vec![disc]))
}

fn rocket(draws: &mut Draws) -> (Stage, Rig) {
    let half = dvec3(draws.within(0.14..0.2), draws.within(0.2..0.26), draws.within(0.36..0.46));
    let squares = half * half;
    let axis = draws.horizontal();
    let law = RigidBody {
        law: "thrust along the body",
        drift: draws.within(0.2..0.4) * draws.horizontal(),
        rotation: DQuat::from_mat3(&DMat3::from_cols(axis.cross(DVec3::Z), axis, DVec3::Z)),
        spin: draws.either_sign(2.0..4.0) * DVec3::Y,
        thrust: draws.within(1.0..2.0),
        ..RigidBody::free(dvec3(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) / 3.0)
    };
    let solid = Part::new(Shape::Cuboid(half), DVec3::ZERO, Texture::new(draws.palette(), 0.45));
    let [motion] = simulated(law);
    framed(alone("rocket", motion, DVec3::ZERO, vec![solid]))
}

fn braked_top(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, thickness, height) = (draws.within(0.4..0.5), draws.within(0.08..0.12), 0.45);
    let across = 0.25 * radius * radius + thickness * thickness / 3.0 + height * height;
    let inertia = dvec3(across, across, 0.5 * radius * radius);
    let rotation = DQuat::from_axis_angle(draws.horizontal(), draws.within(0.3..0.6));
    let law = RigidBody {
        law: "top with a rubbing tip",
        coordinates: "joint",
        rotation,
        spin: draws.either_sign(16.0..24.0) * DVec3::Z,
        weight: across * draws.within(3.0..6.0),
        drag: [0.0, draws.within(0.2..0.5)],
        ..RigidBody::free(inertia)
    };
    let disc = Part::new(
        Shape::Cylinder(radius, thickness),
        dvec3(0.0, 0.0, height),
        Texture::new(draws.palette(), draws.within(0.35..0.5)),
    );
    let stem = Part::new(
        Shape::Cuboid(dvec3(0.06, 0.06, 0.5 * height)),
        dvec3(0.0, 0.0, 0.5 * height),
        Texture::new(draws.palette(), 0.4),
    );
    let [motion] = simulated(law);
    framed(alone("top", motion, dvec3(0.0, 0.0, height), vec![disc, stem]))
}

fn repelling_pair(draws: &mut Draws) -> (Stage, Rig) {
    let (k, distance, mass_ratio) = (draws.within(0.5..0.9), draws.within(0.7..0.9), draws.within(0.5..1.0));
    let arm = draws.tilted(0.6..1.5);
    let share = mass_ratio / (1.0 + mass_ratio);
    let approach = draws.within(0.4..0.8) * arm + draws.either_sign(0.2..0.4) * arm.any_orthonormal_vector();
    let drift = draws.within(0.1..0.3) * draws.horizontal();
    let law = Pair {
        starts: [-share * distance * arm, (1.0 - share) * distance * arm],
        velocities: [drift + share * approach, drift - (1.0 - share) * approach],
        mass_ratio,
        pull: Pull::Attraction { k: -k },
        gravity: 0.0,
    };
    let motions: [_; 2] = simulated(law);
    let body = |(name, motion)| Body::of(name, motion, ball(draws, 0.2));
    let bodies = ["first", "second"].into_iter().zip(motions).map(body).collect();
    framed(Stage { bodies, fixed: Vec::new() })
}
