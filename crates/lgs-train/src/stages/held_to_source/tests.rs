use super::*;
use lgs_core::{Camera, Exposure};
use lgs_mechanics::Law;
use lgs_mechanics::bands;
use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
use lgs_model::source::{ImportedFrames, ShadedSource};
use lgs_model::{MotionConfig, Shading, ShadingTimes};

/// A ball that slides by 0.6 in a unit of time.
fn sliding() -> ImportedFrames {
    let ball = GaussianCloud::isotropic(vec![[0.0; 3]], 0.15, [0.1, 0.5, 0.2], 0.9);
    lgs_model::testing::sliding(ball, [0.6, 0.0, 0.0])
}

/// The ball as it slides freely with a velocity.
fn scene(velocity: f64) -> LagrangianScene {
    let cloud = sliding().cloud_at(0.0);
    let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.05).expect("a law");
    let known = bands::Known { verdict: Verdict::Explained, trusted: [-1.0, 3.0], ..bands::Known::default() };
    let start = State { x: vec![0.0; 3], v: vec![velocity, 0.0, 0.0] };
    let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
    LagrangianScene {
        velocities: vec![[velocity as f32, 0.0, 0.0]],
        objects: vec![ObjectModel {
            members: 0..1,
            dynamics: Dynamics::Generalised(dynamics),
            recording: None,
        }],
        dynamic_gaussians: cloud,
        ..LagrangianScene::still(
            GaussianCloud::default(),
            MotionConfig { dt: 0.05, time_window: 1.0 },
            [1.0; 3],
        )
    }
}

fn held(source: &dyn SourceModel, velocity: f64) -> HeldToSource {
    let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, 48, 48);
    let frame = |k: usize| {
        let time = k as f32 / 10.0;
        let drawn = rasterize(&Splats::from(&source.cloud_at(time)), &camera, [1.0; 3]);
        let bytes = |p: &[f32; 3]| [p[0], p[1], p[2], 1.0].map(|v| (255.0 * v).round() as u8);
        let pixels = drawn.image.iter().flat_map(bytes).collect::<Vec<u8>>().into();
        let exposure = Exposure::IDENTITY;
        Frame { name: String::new(), camera_id: 0, camera, time, exposure, pixels }
    };
    let frames: Vec<Frame> = (0..=10).map(frame).collect();
    held_to_source(
        scene(velocity),
        &SourceOfScene { source, rows: vec![0], config: &DistillConfig::default() },
        &frames,
    )
}

#[test]
fn a_law_that_images_contradict_gives_way_to_the_tracks_of_its_source() {
    let right = held(&sliding(), 0.6);
    assert!(right.worse.is_empty() && right.scene.objects[0].recording.is_none());
    let wrong = held(&sliding(), 0.2);
    assert!(
        wrong.worse[0].decibels > 3.0 && wrong.worse[0].outcome == Outcome::GivesWay,
        "{:?}",
        wrong.worse
    );
    let object = &wrong.scene.objects[0];
    let known = &object.dynamics.generalised().expect("a law").known;
    assert_eq!((known.verdict, known.trusted), (Verdict::Outside, [0.0; 2]));
    let mut motion = Motion::new(&wrong.scene, Edit::default(), Reversal::default());
    let mut place = |time: f32| f64::from(motion.state_at(time).q[0][0]);
    assert!((place(0.5) - 0.3).abs() < 1e-3 && (place(1.0) - 0.6).abs() < 1e-3);
    assert!((place(2.0) - 1.2).abs() < 1e-3, "the tracks go on: the law forecasts their end worse");
}

#[test]
fn what_no_motion_changes_is_not_held_against_a_law_but_not_explained_either() {
    let times = ShadingTimes { span: [0.0, 1.0], count: 2 };
    let darkening = ShadedSource::new(Box::new(sliding()), Shading::new(times, vec![0.0, -2.0]));
    let held = held(&darkening, 0.6);
    assert!(held.worse[0].decibels > 3.0 && held.worse[0].outcome == Outcome::Stays, "{:?}", held.worse);
    let object = &held.scene.objects[0];
    let known = &object.dynamics.generalised().expect("a law").known;
    assert_eq!((known.verdict, known.trusted), (Verdict::Described, [-1.0, 3.0]));
    assert!(object.recording.is_none());
}
