//! Scenes of motions as one meets them every day: what slides to a stop, swings in air, hangs on a rubber
//! band, rolls up a slope.

use super::super::body::{Body, Part, Stage};
use super::super::draws::Draws;
use super::super::laws::{Field, Hinge, Point, RigidBody, Rolling};
use super::super::shape::Shape;
use super::super::texture::Texture;
use super::super::view::Rig;
use super::entry::{Entry, alone, ball, floor, framed, simulated};
use super::fields::body_in_fields;
use super::hinges::{swinging, turning_rotor, upright};
use glam::{DMat3, DQuat, DVec3, dvec3};

pub(super) const ENTRIES: [Entry; 8] = [
    Entry::new(
        "sliding-block",
        "a block that slides on a floor against dry friction, and stops after the window",
        "deceleration 0.9 to 1.3, stop at 1.0 to 1.5",
        sliding_block,
    ),
    Entry::new(
        "stopping-wheel",
        "a wheel that dry friction brings to rest after the window",
        "deceleration 3 to 5 rad per squared unit of time, stop at 1.0 to 1.5, axis within 0.6 rad of the \
         vertical",
        stopping_wheel,
    ),
    Entry::new(
        "swing",
        "a pendulum on a hinge, in air that damps it",
        "k = m g l / I 18 to 30, drag 0.4 to 1, angle at the start 0.8 to 1.4 rad",
        swing,
    ),
    Entry::new(
        "elastic-pendulum",
        "a body that swings on a rubber band",
        "g 2 to 3, stiffness 20 to 40, length 0.6 to 0.8, pulled aside by 0.3 to 0.7 rad",
        elastic_pendulum,
    ),
    Entry::new(
        "damped-springs",
        "a body held by springs of unequal stiffness, damped",
        "stiffnesses 12 to 18, 20 to 28 and 32 to 44, drag 0.4 to 1, displacement 0.4 to 0.6",
        damped_springs,
    ),
    Entry::new(
        "magnetic-trap",
        "a charged body on a spring in a magnetic field, whose plane of swing turns",
        "stiffness 16 to 26, gyration 1 to 2, displacement 0.5 to 0.7",
        magnetic_trap,
    ),
    Entry::new(
        "conical-pendulum",
        "a rod with a bob on a ball joint, which swings around",
        "weight over inertia 14 to 22, tilt 0.5 to 0.9 rad, rate about the vertical 0.6 to 1.1 of that of a \
         circle",
        conical_pendulum,
    ),
    Entry::new(
        "slope",
        "a ball that rolls up a slope and back",
        "radius 0.3 to 0.4, tilt 0.15 to 0.3 rad, deceleration 1.2 to 1.8, turns back at 0.5 to 0.9",
        slope,
    ),
];

fn sliding_block(draws: &mut Draws) -> (Stage, Rig) {
    let (friction, stop) = (draws.within(0.9..1.3), draws.within(1.0..1.5));
    let direction = draws.horizontal();
    let law = Point {
        law: "dry friction",
        kind: "dissipative",
        start: -0.25 * friction * stop * stop * direction,
        velocity: friction * stop * direction,
        fields: vec![Field::DryFriction(friction)],
    };
    block_on_floor(draws, law)
}

/// A block that slides on a floor by the law of a point.
pub(super) fn block_on_floor(draws: &mut Draws, law: Point) -> (Stage, Rig) {
    let half = dvec3(draws.within(0.26..0.36), draws.within(0.22..0.3), draws.within(0.14..0.2));
    let mut block =
        Part::new(Shape::Cuboid(half), DVec3::ZERO, Texture::new(draws.palette(), draws.within(0.4..0.6)));
    block.rotation = DMat3::from_rotation_z(draws.within(-1.5..1.5));
    let [motion] = simulated(law);
    framed(Stage { bodies: vec![Body::of("block", motion, block)], fixed: vec![floor(-half.z, 1.6)] })
}

fn stopping_wheel(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.tilted(0.1..0.6);
    let (friction, stop) = (draws.within(3.0..5.0), draws.within(1.0..1.5));
    let law = Hinge {
        law: "hinge with dry friction",
        kind: "dissipative",
        rate: friction * stop * draws.either_sign(0.999..1.0).signum(),
        friction,
        ..Hinge::about(axis, upright(axis))
    };
    turning_rotor(draws, "wheel", law)
}

fn swing(draws: &mut Draws) -> (Stage, Rig) {
    let axis = draws.horizontal();
    let law = Hinge {
        law: "damped hinge under gravity",
        kind: "dissipative",
        angle: draws.either_sign(0.8..1.4),
        rate: draws.within(-1.0..1.0),
        gravity: draws.within(18.0..30.0),
        drag: draws.within(0.4..1.0),
        ..Hinge::about(axis, DMat3::from_cols(axis.cross(DVec3::Z), axis, DVec3::Z))
    };
    swinging(draws, "swing", law)
}

fn elastic_pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let (gravity, k, length) = (draws.within(2.0..3.0), draws.within(20.0..40.0), draws.within(0.6..0.8));
    let (aside, angle) = (draws.horizontal(), draws.within(0.3..0.7f64));
    let stretched = (length + gravity / k) * draws.within(1.1..1.3);
    let law = Point {
        law: "elastic pendulum",
        kind: "conservative",
        start: stretched * (angle.sin() * aside - angle.cos() * DVec3::Z),
        velocity: draws.either_sign(0.2..0.6) * aside.cross(DVec3::Z),
        fields: vec![Field::Gravity(gravity), Field::RestLength { end: DVec3::ZERO, k, length }],
    };
    body_in_fields(draws, law)
}

fn damped_springs(draws: &mut Draws) -> (Stage, Rig) {
    let k = dvec3(draws.within(12.0..18.0), draws.within(20.0..28.0), draws.within(32.0..44.0));
    let aside = draws.tilted(0.0..std::f64::consts::PI);
    let law = Point {
        law: "damped springs",
        kind: "dissipative",
        start: draws.within(0.4..0.6) * aside,
        velocity: draws.within(1.0..2.0) * aside.any_orthonormal_vector(),
        fields: vec![
            Field::Spring { center: DVec3::ZERO, frame: draws.orientation(), k },
            Field::LinearDrag(draws.within(0.4..1.0)),
        ],
    };
    body_in_fields(draws, law)
}

fn magnetic_trap(draws: &mut Draws) -> (Stage, Rig) {
    let field = draws.tilted(0.0..0.5);
    let aside = field.any_orthonormal_vector();
    let k = draws.within(16.0..26.0);
    let law = Point {
        law: "spring in a magnetic field",
        kind: "gyroscopic",
        start: draws.within(0.5..0.7) * aside,
        velocity: draws.within(-0.6..0.6) * field.cross(aside) + draws.within(-0.4..0.4) * field,
        fields: vec![
            Field::Spring { center: DVec3::ZERO, frame: DMat3::IDENTITY, k: DVec3::splat(k) },
            Field::Magnetic(draws.either_sign(1.0..2.0) * field),
        ],
    };
    body_in_fields(draws, law)
}

fn conical_pendulum(draws: &mut Draws) -> (Stage, Rig) {
    let (length, radius) = (draws.within(0.75..0.95), draws.within(0.24..0.32));
    // A homogeneous ball on a rod without mass, about the joint, per unit of mass.
    let across = length * length + 0.4 * radius * radius;
    let (weight, tilt) = (draws.within(14.0..22.0), draws.within(0.5..0.9f64));
    // The centre of mass lies on the body's z axis, which hangs down.
    let rotation = DQuat::from_axis_angle(draws.horizontal(), std::f64::consts::PI - tilt);
    let around = (weight / tilt.cos()).sqrt() * draws.either_sign(0.6..1.1);
    let law = RigidBody {
        law: "pendulum on a ball joint",
        coordinates: "joint",
        rotation,
        spin: rotation.conjugate() * (around * DVec3::Z),
        weight: across * weight,
        ..RigidBody::free(dvec3(across, across, 0.4 * radius * radius))
    };
    let rod = Part::new(
        Shape::Cuboid(dvec3(0.07, 0.09, 0.5 * length)),
        dvec3(0.0, 0.0, 0.5 * length),
        Texture::new(draws.palette(), 0.4),
    );
    let bob = Part::new(
        Shape::Ellipsoid(DVec3::splat(radius)),
        dvec3(0.0, 0.0, length),
        Texture::new(draws.palette(), 0.45),
    );
    let [motion] = simulated(law);
    framed(alone("bob", motion, dvec3(0.0, 0.0, 0.7 * length), vec![rod, bob]))
}

fn slope(draws: &mut Draws) -> (Stage, Rig) {
    let (radius, tilt) = (draws.within(0.3..0.4), draws.within(0.15..0.3f64));
    let (slope, turns_back) = (draws.within(1.2..1.8), draws.within(0.5..0.9));
    let ahead = draws.horizontal();
    let direction = tilt.cos() * ahead + tilt.sin() * DVec3::Z;
    let normal = tilt.cos() * DVec3::Z - tilt.sin() * ahead;
    let speed = slope * turns_back;
    let law = Rolling {
        direction,
        normal,
        radius,
        speed,
        slope,
        resistance: draws.within(0.05..0.2),
        ..Rolling::at(DVec3::ZERO)
    };
    let ball = ball(draws, radius);
    let [motion] = simulated(law);
    framed(alone("ball", motion, DVec3::ZERO, vec![ball]))
}

#[cfg(test)]
mod tests {
    use super::super::super::find;

    #[test]
    fn what_dry_friction_stops_stays_where_it_is() {
        for (scene, seed) in [("sliding-block", 1), ("stopping-wheel", 2)] {
            let motion = &find(scene, seed).expect("a scene").stage.bodies[0].motion;
            let moved = |from: f64, to: f64| {
                let (a, b) = (motion.pose(from), motion.pose(to));
                (b.position - a.position).length() + (b.linear.x_axis - a.linear.x_axis).length()
            };
            assert!(moved(0.75, 0.95) > 0.02, "{scene} still moves at the end of the window");
            assert!(moved(1.6, 2.25) < 2e-3, "{scene} has stopped");
        }
    }
}
