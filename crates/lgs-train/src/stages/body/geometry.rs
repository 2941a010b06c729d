//! The geometry of generalised coordinates as unknowns: where a body's centre of mass, its pivot or its axis
//! lies. The particles stay where they are at t = 0.

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
    if unknowns(dynamics) > 0 {
        let GeneralisedDynamics { law, start, .. } = dynamics;
        law.coordinates.change_geometry(start, by);
    }
}
