//! Joints, centres of mass and laws of bodies whose motion is known.

use super::geometry::{center_of_mass, pivot};
use super::turning::Turning;
use super::{Laws, find_law};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::testing::block;
use glam::DVec3;
use lgs_core::geometry::rotation_by;
use lgs_mechanics::coordinates::Coordinates;

const SAMPLES: usize = 61;

fn times() -> Vec<f64> {
    (0..SAMPLES).map(|i| 0.75 * i as f64 / (SAMPLES - 1) as f64).collect()
}

fn motion(pose: impl Fn(f64) -> Pose) -> SharedMotion {
    let shape = block([0.3, 0.2, 0.1], 64, 5);
    let weights = vec![1.0 / 64.0; 64];
    let poses = times().into_iter().map(pose).collect();
    SharedMotion { kind: PoseKind::Rigid, times: times(), poses, shape, weights, residual: 0.0 }
}

/// A body that turns about an axis through a pivot by an angle.
fn turned(axis: DVec3, pivot: DVec3, angle: f64) -> Pose {
    let linear = rotation_by(axis * angle);
    Pose { linear, shift: pivot + linear * DVec3::new(0.4, 0.1, -0.2) }
}

#[test]
fn an_axis_and_a_pivot_are_read_off_the_poses() {
    let (axis, point) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.2, -0.3, 1.0));
    let angle = |t: f64| 9.0 * t * t - 1.0;
    let poses = motion(|t| turned(axis, point, angle(t))).poses;
    let turning = Turning::about_one_axis(&poses).expect("an axis");
    assert!(turning.axis.cross(axis).length() < 1e-9);
    let total = turning.angles[SAMPLES - 1] - turning.angles[0];
    assert!((total.abs() - 9.0 * 0.75 * 0.75).abs() < 1e-6, "{total}");
    let (found, _) = pivot(&poses).expect("a pivot");
    assert!((found - point).cross(axis).length() < 1e-6, "{found}");
}

#[test]
fn the_centre_of_mass_of_a_thrown_body_is_found_where_its_path_is_a_parabola() {
    let offset = DVec3::new(0.05, -0.02, 0.0);
    let thrown = |t: f64| {
        let linear = rotation_by(DVec3::new(0.0, 0.0, 4.0 * t));
        let center = DVec3::new(0.5 * t, 0.0, t - 0.6 * t * t);
        Pose { linear, shift: center - linear * offset }
    };
    let found = center_of_mass(&motion(thrown).poses, &times(), 3).expect("a centre");
    assert!(found.truncate().distance(offset.truncate()) < 1e-6, "{found}");
    let law = find_law(&motion(thrown), (Laws::All, &[]), 0.0, 1).expect("a law").law;
    assert_eq!(law.terms.iter().map(|term| term.kind.name()).collect::<Vec<_>>(), ["uniform-field"]);
    let field = DVec3::from_slice(&law.parameters[law.range(0)]);
    assert!(field.distance(DVec3::new(0.0, 0.0, -1.2)) < 1e-3, "{field}");
}

#[test]
fn a_constant_torque_on_a_hinge_is_a_drive_and_is_left_out_where_only_potentials_are_admitted() {
    let body = motion(|t| turned(DVec3::Z, DVec3::ZERO, 0.4 * t + 3.0 * t * t));
    let terms = |laws: Laws| -> Vec<&str> {
        let law = find_law(&body, (laws, &[]), 0.0, 1).expect("a law").law;
        assert!(matches!(law.coordinates, Coordinates::Hinge(_)), "{law:?}");
        law.terms.iter().map(|term| term.kind.name()).collect()
    };
    assert_eq!(terms(Laws::All), ["constant-drive"]);
    assert!(!terms(Laws::Conservative).contains(&"constant-drive"));
}
