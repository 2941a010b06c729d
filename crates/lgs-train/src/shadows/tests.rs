use lgs_core::GaussianCloud;
use lgs_mechanics::Law;
use lgs_mechanics::bands::{Known, Verdict};
use lgs_mechanics::coordinates::{Bodies, Coordinates, Port, State};
use lgs_mechanics::terms::Term;
use lgs_model::{Dynamics, GeneralisedDynamics, MotionConfig, Recording};

use super::*;

/// A thrown ball above the plane z = 0, and a flat disc in it whose middle is where `place` has it at a time,
/// given the ball's centre then.
fn scene(place: impl Fn(f64, DVec3) -> DVec3) -> LagrangianScene {
    let (from, velocity, gravity) = (DVec3::new(-0.4, 0.3, 1.2), DVec3::new(0.8, -0.3, 1.5), 4.0);
    let at = |time: f64| from + time * velocity - 0.5 * gravity * time * time * DVec3::Z;
    let corners = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let field = vec![Term::named("uniform-field", Port::Whole).expect("a term")];
    let law = Law::new(Coordinates::Point, field, vec![0.0, 0.0, -gravity], 0.01).expect("a law");
    let start = State { x: from.to_array().to_vec(), v: velocity.to_array().to_vec() };
    let known = Known { verdict: Verdict::Explained, ..Known::default() };
    let ball = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
    let still = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("a law");
    let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
    let disc = GeneralisedDynamics { law: still, bodies: Bodies::default(), start, known: Known::default() };
    let narrow = |p: DVec3| p.as_vec3().to_array();
    let times: Vec<f32> = (0..=40).map(|i| i as f32 / 40.0).collect();
    let shape = |time: &f32| {
        let middle = place(f64::from(*time), at(f64::from(*time)));
        corners[..4].iter().map(|&corner| narrow(middle + 0.3 * corner)).collect::<Vec<_>>()
    };
    let positions: Vec<Vec<[f32; 3]>> = times.iter().map(shape).collect();
    let turns = vec![vec![[1.0, 0.0, 0.0, 0.0]; 4]; times.len()];
    let mut means: Vec<[f32; 3]> = corners.iter().map(|&corner| narrow(from + 0.3 * corner)).collect();
    means.extend(&positions[0]);
    let object = |members, dynamics, recording| ObjectModel {
        members,
        dynamics: Dynamics::Generalised(dynamics),
        recording,
    };
    LagrangianScene {
        velocities: vec![[0.0; 3]; means.len()],
        dynamic_gaussians: GaussianCloud::isotropic(means, 0.05, [0.5; 3], 0.9),
        objects: vec![object(0..6, ball, None), object(6..10, disc, Recording::new(times, positions, turns))],
        ..LagrangianScene::still(
            GaussianCloud::default(),
            MotionConfig { dt: 0.02, time_window: 1.0 },
            [1.0; 3],
        )
    }
}

/// The shadow of a point on z = 0 in the light of a lamp.
fn lit_by(lamp: DVec3, point: DVec3) -> DVec3 {
    point + (point - lamp) * point.z / (lamp.z - point.z)
}

fn middle(scene: &LagrangianScene, time: f32) -> DVec3 {
    let state = Motion::new(scene, Edit::default(), Reversal::default()).state_at(time);
    state.q[6..].iter().map(|&q| wide(q)).sum::<DVec3>() / 4.0
}

#[test]
fn the_shadows_of_a_sun_and_of_a_lamp_go_on_with_what_casts_them() {
    let sun = DVec3::new(0.4, 0.2, 0.0);
    let of_sun = |_, ball: DVec3| DVec3::new(ball.x, ball.y, 0.0) + ball.z * sun;
    let lamp = DVec3::new(-1.0, 1.5, 5.0);
    let of_lamp = move |_, ball| lit_by(lamp, ball);
    for (name, place) in [("sun", &of_sun as &dyn Fn(f64, DVec3) -> DVec3), ("lamp", &of_lamp)] {
        let scene = with_shadows(scene(place));
        assert_eq!(scene.shadows.len(), 1, "{name}");
        for time in [-0.5_f32, 0.5, 1.1] {
            let t = f64::from(time);
            let ball = DVec3::new(-0.4 + 0.8 * t, 0.3 - 0.3 * t, 1.2 + 1.5 * t - 2.0 * t * t);
            let off = middle(&scene, time).distance(place(t, ball));
            assert!(off < 0.02, "{name}, {time}: {off}");
        }
    }
}

/// The scene with a floor, z = 0.
fn with_floor(scene: LagrangianScene) -> LagrangianScene {
    let tiles = (0..400).map(|i| [0.2 * (i % 20) as f32 - 2.0, 0.2 * (i / 20) as f32 - 2.0, 0.0]);
    let floor = GaussianCloud::isotropic(tiles.collect(), 0.1, [0.5; 3], 0.9);
    LagrangianScene { static_gaussians: floor, ..scene }
}

#[test]
fn faint_gaussians_of_a_caster_do_not_move_its_shadow() {
    let cast = |_, ball: DVec3| DVec3::new(ball.x + 0.4 * ball.z, ball.y, 0.0);
    let mut scene = scene(cast);
    scene.dynamic_gaussians.raw_opacities[0] = -3.0;
    scene.dynamic_gaussians.means[0] = [2.0, 2.0, 2.0];
    let scene = with_shadows(scene);
    let jump = middle(&scene, 1.001).distance(middle(&scene, 1.0));
    assert!(scene.shadows.len() == 1 && jump < 0.01, "{jump}");
}

#[test]
fn what_is_thick_is_a_shadow_only_along_a_surface() {
    // Gaussians of a shadow that reach below the floor, where nobody sees them.
    let thick = |place: &dyn Fn(f64, DVec3) -> DVec3| {
        let mut scene = with_floor(scene(place));
        let recording = scene.objects[1].recording.take().expect("a recording");
        let mut positions = recording.positions().to_vec();
        positions.iter_mut().for_each(|at| at[0][2] -= 0.3);
        let turns = recording.rotations().to_vec();
        scene.objects[1].recording = Recording::new(recording.times().to_vec(), positions, turns);
        scene
    };
    let cast = |_, ball: DVec3| DVec3::new(ball.x + 0.4 * ball.z, ball.y, 0.0);
    assert_eq!(with_shadows(thick(&cast)).shadows.len(), 1);
    let falls = |time: f64, _| DVec3::new(0.5 * time - 1.0, 0.2 * time, 1.0 - 2.0 * time * time);
    assert!(with_shadows(thick(&falls)).shadows.is_empty(), "a second body that falls as fast");
}

#[test]
fn what_moves_otherwise_is_no_shadow() {
    let even = |time: f64, _| DVec3::new(0.5 * time, 0.2 * time, 0.0);
    assert!(with_shadows(scene(even)).shadows.is_empty(), "a disc that slides by itself");
    let braked = |time: f64, _| DVec3::new(1.5 * time - 0.7 * time * time, 0.2 * time, 0.0);
    assert!(with_shadows(scene(braked)).shadows.is_empty(), "one that friction slows");
    let rising = |_, ball: DVec3| ball + DVec3::X;
    assert!(with_shadows(scene(rising)).shadows.is_empty(), "what does not stay in a plane");
}
