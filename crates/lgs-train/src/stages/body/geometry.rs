//! The geometry of generalised coordinates as unknowns: where a body's centre of mass, its pivot or its axis
//! lies. The particles stay where they are at t = 0.

use glam::DVec3;
use lgs_core::geometry::{exp, quaternion};
use lgs_mechanics::coordinates::Coordinates;
use lgs_model::GeneralisedDynamics;

/// Number of unknowns: the centre of mass of a free body and the pivot of a ball joint have three, a hinge
/// has two for the direction of its axis and two for its place, and a second one on the first body two more.
pub(super) fn unknowns(dynamics: &GeneralisedDynamics) -> usize {
    match dynamics.law.coordinates {
        Coordinates::Rigid(_) | Coordinates::Ball(_) => 3,
        Coordinates::Hinge(_) => 4,
        Coordinates::Tree(_) => 6,
        _ => 0,
    }
}

/// Units: the body's radius for places, a radian for directions.
pub(super) fn units(dynamics: &GeneralisedDynamics, radius: f64) -> Vec<f64> {
    match dynamics.law.coordinates {
        Coordinates::Hinge(_) => vec![1.0, 1.0, radius, radius],
        Coordinates::Tree(_) => vec![1.0, 1.0, radius, radius, radius, radius],
        _ => vec![radius; unknowns(dynamics)],
    }
}

/// Changes the geometry by some lengths and angles.
pub(super) fn change(by: &[f64], dynamics: &mut GeneralisedDynamics) {
    let GeneralisedDynamics { law, start, .. } = dynamics;
    match &mut law.coordinates {
        Coordinates::Rigid(_) => {
            // Another point of the body, in its own axes, takes the part of the centre of mass.
            let (offset, turn) = (DVec3::from_slice(by), quaternion(&start.x).normalize());
            let spin = DVec3::from_slice(&start.v);
            add(&mut start.x[4..], turn * offset);
            add(&mut start.v[3..], turn * spin.cross(offset));
        }
        Coordinates::Ball(ball) => {
            let offset = DVec3::from_slice(by);
            add(&mut ball.pivot, offset);
            add(&mut ball.arm, -(quaternion(&start.x).normalize().inverse() * offset));
        }
        Coordinates::Hinge(hinge) => change_hinge(by, &mut hinge.axis, &mut hinge.pivot),
        Coordinates::Tree(tree) => {
            let (first, second) = DVec3::from_array(tree.axis).any_orthonormal_pair();
            let joint = exp(DVec3::from_array(tree.axis) * -start.x[0]) * (first * by[4] + second * by[5]);
            change_hinge(by, &mut tree.axis, &mut tree.pivot);
            add(&mut tree.link, joint);
        }
        _ => {}
    }
}

/// Turns an axis by the first two of some changes, and moves its point across it by the next two.
fn change_hinge(by: &[f64], axis: &mut [f64; 3], pivot: &mut [f64; 3]) {
    let old = DVec3::from_array(*axis);
    let (first, second) = old.any_orthonormal_pair();
    *axis = (old + first * by[0] + second * by[1]).normalize().to_array();
    add(pivot, first * by[2] + second * by[3]);
}

fn add(values: &mut [f64], change: DVec3) {
    values.iter_mut().zip(change.to_array()).for_each(|(value, change)| *value += change);
}
