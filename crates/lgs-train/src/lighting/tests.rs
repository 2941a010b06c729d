use super::*;
use glam::DQuat;
use lgs_core::GaussianCloud;
use lgs_core::linear::norm;
use lgs_mechanics::coordinates::{Bodies, Coordinates, Hinge, State};
use lgs_mechanics::{Law, bands};
use lgs_model::{Dynamics, GeneralisedDynamics, MotionConfig, ObjectModel, ShadingTimes};

const TIMES: ShadingTimes = ShadingTimes { span: [0.0, 0.75], count: 16 };
const SUN: DVec3 = DVec3::new(0.8, 0.0, 0.6);

/// A ball of flat Gaussians that turns about an axis, and their logarithms of brightness by their normals and
/// the times.
fn turning(rate: f64, log_gain: impl Fn(DVec3, f32) -> f64) -> LagrangianScene {
    let normals: Vec<DVec3> = directions(300).collect();
    let means = normals.iter().map(|&normal| narrow(0.5 * normal)).collect();
    let mut cloud = GaussianCloud::isotropic(means, 0.05, [0.3, 0.5, 0.4], 0.9);
    for (row, &normal) in normals.iter().enumerate() {
        let turn = DQuat::from_rotation_arc(DVec3::Z, normal);
        cloud.rotations[row] = [turn.w, turn.x, turn.y, turn.z].map(|c| c as f32);
        cloud.log_scales[row][2] -= 2.0;
    }
    let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] });
    let law = Law::new(hinge, Vec::new(), Vec::new(), 0.01).expect("a law");
    let start = State { x: vec![0.0], v: vec![rate] };
    let known = bands::Known::default();
    let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
    let of_row = |normal: &DVec3| {
        let at = |time: f32| log_gain(DQuat::from_rotation_z(rate * f64::from(time)) * *normal, time) as f32;
        TIMES.all().map(at).collect::<Vec<f32>>()
    };
    LagrangianScene {
        velocities: vec![[0.0; 3]; cloud.len()],
        objects: vec![ObjectModel {
            members: 0..cloud.len(),
            dynamics: Dynamics::Generalised(dynamics),
            recording: None,
        }],
        shading: Some(Shading::new(TIMES, normals.iter().flat_map(of_row).collect())),
        dynamic_gaussians: cloud,
        ..LagrangianScene::still(
            GaussianCloud::default(),
            MotionConfig { dt: 0.01, time_window: 0.75 },
            [1.0; 3],
        )
    }
}

/// Brightness under a sun and a sky.
fn sunlit(normal: DVec3) -> f64 {
    0.45 + 0.55 * normal.dot(SUN).max(0.0)
}

/// Root mean square difference of the Gaussians' brightness at a time from what is expected of their normals.
fn off(scene: &LagrangianScene, time: f32, expected: impl Fn(DVec3) -> f64) -> f64 {
    let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
    let state = motion.state_at(time);
    let cloud = scene.cloud_at(&state, time);
    let plain = LagrangianScene { shading: None, light: None, ..scene.clone() }.cloud_at(&state, time);
    let stride = cloud.sh_stride();
    let color = |cloud: &GaussianCloud, row: usize| 0.5 + lgs_core::SH_C0 * cloud.sh[row * stride];
    let square = |row: usize| {
        let gain = f64::from(color(&cloud, row) / color(&plain, row));
        let normal = wide(state.q[row]) / f64::from(norm(state.q[row]));
        (gain - expected(normal)).powi(2)
    };
    ((0..cloud.len()).map(square).sum::<f64>() / cloud.len() as f64).sqrt()
}

#[test]
fn a_light_goes_on_where_bodies_turn_in_it() {
    let scene = turning(3.0, |normal, _| sunlit(normal).ln());
    let lit = with_light(scene.clone());
    assert!(lit.light.is_some());
    assert!(off(&lit, 0.25, sunlit) < 1e-3, "as it was in the window: {}", off(&lit, 0.25, sunlit));
    for time in [-0.5, 1.0, 1.7] {
        let (before, now) = (off(&scene, time, sunlit), off(&lit, time, sunlit));
        assert!(now < 0.06 && now < 0.4 * before, "{now} where it was {before} at {time}");
    }
}

#[test]
fn brightness_of_what_does_not_turn_or_is_of_no_light_stays_as_it_is() {
    let still = turning(0.0, |normal, time| sunlit(normal).ln() + f64::from(0.3 * time));
    assert!(with_light(still).light.is_none());
    let painted = turning(3.0, |normal, time| (40.0 * normal.x + 9.0 * f64::from(time)).sin());
    assert!(with_light(painted).light.is_none());
}
