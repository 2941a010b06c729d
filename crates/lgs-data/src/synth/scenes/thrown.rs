//! Scenes of bodies that fly, spin or circle each other: several laws of other scenes at once.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::laws::{Hinge, Modal, Pair, Pull, RigidBody};
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, ball, floor, framed, simulated};
use super::free_bodies::jelly;
use super::hinges::{turning_rotor, upright};
use glam::{DQuat, DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 6] = [
    Entry::new(
        "thrown-box",
        "an asymmetric box that is thrown up and tumbles",
        "half-edges 0.4 to 0.5, 0.26 to 0.34, 0.15 to 0.2 (homogeneous), g 0.8 to 1.3, spin 2.5 to 4",
        thrown_box,
    ),
    Entry::new(
        "spinning-ball",
        "a thrown ball whose spin the air takes away",
        "g 0.8 to 1.2, spin 4 to 7, drag of the spin 0.5 to 1.2, of the flight 0.1 to 0.4",
        spinning_ball,
    ),
    Entry::new(
        "puck",
        "a disc that slides and turns on a floor until friction stops both, after the window",
        "deceleration 0.8 to 1.2, spin 2.5 to 4 rad per unit of time, both stop at 1 to 1.4",
        puck,
    ),
    Entry::new(
        "attracting-pair",
        "two balls that attract each other as 1/r² and circle each other",
        "k 1.2 to 2, distance 1.1 to 1.3, mass ratio 0.5 to 1, speed 0.75 to 0.95 of that of a circle, drift \
         0.1 to 0.3",
        attracting_pair,
    ),
    Entry::new(
        "falling-jelly",
        "a body that vibrates while it is thrown",
        "as vibration, g 0.6 to 1",
        falling_jelly,
    ),
    Entry::new(
        "screw",
        "a propeller that climbs its axis as it turns, against drag",
        "rate 3 to 5, drag 0.4 to 1, pitch 0.1 to 0.2 per radian, axis within 0.5 rad of the vertical",
        screw,
    ),
];

/// A throw that comes back to its height after a time.
fn thrown(draws: &mut Draws, gravity: f64) -> DVec3 {
    draws.within(0.15..0.4) * draws.horizontal() + draws.within(0.5..0.7) * gravity * DVec3::Z
}

fn thrown_box(draws: &mut Draws) -> (Stage, Rig) {
    let half = dvec3(draws.within(0.4..0.5), draws.within(0.26..0.34), draws.within(0.15..0.2));
    let (squares, gravity) = (half * half, draws.within(0.8..1.3));
    let orientation = draws.orientation();
    let law = RigidBody {
        law: "thrown rigid body",
        drift: thrown(draws, gravity),
        rotation: DQuat::from_mat3(&orientation),
        spin: dvec3(draws.either_sign(0.3..0.8), draws.either_sign(2.5..4.0), draws.either_sign(0.3..0.8)),
        gravity,
        ..RigidBody::free(dvec3(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) / 3.0)
    };
    let solid = Part::new(Shape::Cuboid(half), DVec3::ZERO, Texture::new(draws.palette(), 0.45));
    let [motion] = simulated(law);
    framed(alone("box", motion, DVec3::ZERO, vec![solid]))
}

fn spinning_ball(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, gravity) = (draws.within(0.3..0.4), draws.within(0.8..1.2));
    let axis = draws.tilted(0.0..1.5);
    let law = RigidBody {
        law: "spinning ball in air",
        drift: thrown(draws, gravity),
        spin: draws.either_sign(4.0..7.0) * axis,
        gravity,
        drag: [draws.within(0.1..0.4), draws.within(0.5..1.2)],
        ..RigidBody::free(DVec3::splat(0.4 * radius * radius))
    };
    let ball = ball(draws, radius);
    let [motion] = simulated(law);
    framed(alone("ball", motion, DVec3::ZERO, vec![ball]))
}

fn puck(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, height) = (draws.within(0.34..0.44), draws.within(0.1..0.16));
    let (friction, stop) = (draws.within(0.8..1.2), draws.within(1.0..1.4));
    let direction = draws.horizontal();
    let spin = draws.either_sign(2.5..4.0);
    let across = 0.25 * radius * radius + height * height / 3.0;
    let law = RigidBody {
        law: "sliding and turning disc",
        origin: -0.25 * friction * stop * stop * direction,
        drift: friction * stop * direction,
        spin: spin * DVec3::Z,
        friction: [friction, spin.abs() / stop],
        ..RigidBody::free(dvec3(across, across, 0.5 * radius * radius))
    };
    let disc = Part::new(
        Shape::Cylinder(radius, height),
        DVec3::ZERO,
        Texture::new(draws.palette(), draws.within(0.4..0.55)),
    );
    let [motion] = simulated(law);
    framed(Stage { bodies: vec![Body::of("puck", motion, disc)], fixed: vec![floor(-height, 1.6)] })
}

fn attracting_pair(draws: &mut Draws) -> (Stage, Rig) {
    let (k, distance, mass_ratio) = (draws.within(1.2..2.0), draws.within(1.1..1.3), draws.within(0.5..1.0));
    let normal = draws.tilted(0.0..0.8);
    let arm = normal.any_orthonormal_vector();
    let share = mass_ratio / (1.0 + mass_ratio);
    // The two fall around each other as one body about the other would, with the sum of both accelerations.
    let circle = (k * (1.0 + 1.0 / mass_ratio) / distance).sqrt();
    let around = draws.within(0.75..0.95) * circle * normal.cross(arm);
    let drift = draws.within(0.1..0.3) * draws.horizontal();
    let law = Pair {
        starts: [-share * distance * arm, (1.0 - share) * distance * arm],
        velocities: [drift - share * around, drift + (1.0 - share) * around],
        mass_ratio,
        pull: Pull::Attraction { k },
        gravity: 0.0,
    };
    let motions: [_; 2] = simulated(law);
    let body = |(name, motion)| {
        let radius = draws.within(0.22..0.28);
        let texture = Texture::new(draws.palette(), draws.within(0.35..0.5));
        Body::of(name, motion, Part::new(Shape::Ellipsoid(DVec3::splat(radius)), DVec3::ZERO, texture))
    };
    let bodies = ["first", "second"].into_iter().zip(motions).map(body).collect();
    framed(Stage { bodies, fixed: Vec::new() })
}

fn falling_jelly(draws: &mut Draws) -> (Stage, Rig) {
    let gravity = draws.within(0.6..1.0);
    let (own, body) = jelly(draws);
    let law = Modal { velocity: thrown(draws, gravity), gravity, ..own };
    let [motion] = simulated(law);
    framed(alone("jelly", motion, DVec3::ZERO, vec![body]))
}

fn screw(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.tilted(0.0..0.5);
    let law = Hinge {
        law: "screw with drag",
        kind: "dissipative",
        rate: draws.either_sign(3.0..5.0),
        drag: draws.within(0.4..1.0),
        advance: draws.within(0.1..0.2) * axis,
        ..Hinge::about(axis, upright(axis))
    };
    turning_rotor(draws, "propeller", law)
}

#[cfg(test)]
mod tests {
    use super::super::super::find;

    #[test]
    fn a_screw_climbs_in_step_with_its_turn() {
        let stage = find("screw", 3).expect("a scene").stage;
        let pose = |t: f64| stage.bodies[0].motion.pose(t);
        let way = |t: f64| (pose(t).position - pose(0.0).position).length();
        let turn = |t: f64| {
            let between = pose(t).linear * pose(0.0).linear.transpose();
            glam::DQuat::from_mat3(&between).to_axis_angle().1
        };
        assert!((way(0.2) / way(0.1) - turn(0.2) / turn(0.1)).abs() < 1e-9);
    }
}
