//! A recording of a block of Gaussians in free fall.

use std::path::Path;

use lgs_core::{Camera, GaussianCloud, Image};
use lgs_dynamics::testing::quadratic;
use lgs_dynamics::{Edit, Reversal, VelocityPolicy};
use lgs_model::{Dynamics, LagrangianScene, Motion, MotionConfig, ObjectModel, ParticleDynamics};
use lgs_rerun::{Moment, Moving, ObjectNote, Picture, Playback};
use re_sdk_types::archetypes::{
    EncodedImage, GaussianSplats3D, LineStrips3D, Pinhole, Points3D, Scalars, TextDocument,
};
use re_sdk_types::components::{Blob, LineStrip3D, Position3D, Resolution, Scalar, Scale3D, Text};

use crate::reader::Contents;

const TIMES: [f32; 3] = [0.5, -0.5, 0.0];
const NANOSECONDS: [i64; 3] = [-500_000_000, 0, 500_000_000];

fn scene() -> LagrangianScene {
    let means: Vec<[f32; 3]> = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|c| 0.1 * c as f32)).collect();
    let particles = ParticleDynamics {
        system: quadratic([0.0, 0.0, 2.0], [0.0; 6]),
        supports: None,
        velocity_policy: VelocityPolicy::Keep,
    };
    LagrangianScene {
        velocities: vec![[0.0; 3]; means.len()],
        dynamic_gaussians: GaussianCloud::isotropic(means, 0.05, [0.9, 0.3, 0.1], 0.9),
        objects: vec![ObjectModel {
            members: 0..27,
            recording: None,
            dynamics: Dynamics::Particles(particles),
        }],
        ..LagrangianScene::still(
            GaussianCloud::isotropic(vec![[0.0, 0.0, -1.0]; 3], 0.1, [0.2, 0.5, 0.2], 0.9),
            MotionConfig { dt: 0.01, time_window: 0.75 },
            [1.0; 3],
        )
    }
}

/// Writes a recording of the scene; returns the middle of the block at each time.
fn record(path: &Path) -> Vec<[f32; 3]> {
    let scene = scene();
    let mut motion = Motion::new(&scene, Edit::default(), Reversal::default());
    let mut playback = Playback::begin(path, ("block", b"test"), &scene).expect("begun");
    let camera = Camera::look_at([0.0, -3.0, 0.0], [0.0; 3], 0.6, 8, 6);
    playback.cameras(&[("train/r_0.png".to_owned(), camera)]).expect("cameras");
    let note = ObjectNote { color: [1.0, 0.0, 0.0], text: "a law".to_owned() };
    playback.objects(vec![note]).expect("objects");
    let picture = Picture::of(&Image::filled(8, 6, [0.5; 3]));
    let mut middles = Vec::new();
    for time in TIMES {
        let state = motion.state_at(time);
        middles.push(state.q[13]);
        let moving = Moving::Scene(&state, &[[f64::from(time), 1.0]]);
        let moment = Moment { time, moving, camera: &camera, picture: &picture, trusted: &[time <= 0.0] };
        playback.moment(&moment).expect("a moment");
    }
    let size = playback.finish().expect("finished");
    assert_eq!(size, std::fs::metadata(path).expect("a file").len());
    middles
}

#[test]
fn a_playback_has_the_motion_of_the_scene_on_the_timeline_time() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.rrd");
    let middles = record(&path);
    let contents = Contents::read(&path);
    assert_eq!(contents.timelines().into_iter().collect::<Vec<_>>(), ["time"]);
    let object = |part: &str| format!("/world/objects/0/{part}");
    let mut expected = vec![
        "/objects/0/kinetic_energy".to_owned(),
        "/objects/0/law".to_owned(),
        "/objects/0/potential_energy".to_owned(),
        "/objects/0/trusted".to_owned(),
        "/world/cameras/train/r_0.png".to_owned(),
        "/world/static".to_owned(),
        "/world/view".to_owned(),
    ];
    expected.extend(["center", "gaussians", "paths", "velocity"].map(object));
    expected.sort();
    assert_eq!(contents.entities(), expected);
    let centers = contents.values::<Position3D>(&object("center"), &Points3D::descriptor_positions());
    assert_eq!(centers.iter().map(|(time, _)| *time).collect::<Vec<_>>(), NANOSECONDS);
    for ((_, found), middle) in centers.iter().zip([middles[1], middles[2], middles[0]]) {
        let [found] = found.as_slice() else { panic!("{found:?}") };
        let off = found.0.0.iter().zip(middle).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{found:?} {middle:?}");
    }
    assert!(
        (middles[0][2] - 0.1 + 0.25).abs() < 0.01,
        "half a unit of time under a gravity of 2: {middles:?}"
    );
}

#[test]
fn gaussians_are_whole_and_curves_have_their_numbers() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.rrd");
    record(&path);
    let contents = Contents::read(&path);
    let entity = "/world/objects/0/gaussians";
    let places = contents.values::<Position3D>(entity, &GaussianSplats3D::descriptor_centers());
    assert_eq!(places.iter().map(|(_, all)| all.len()).collect::<Vec<_>>(), [27; 3]);
    let scales = contents.values::<Scale3D>(entity, &GaussianSplats3D::descriptor_scales());
    assert_eq!((scales.len(), scales[0].0, scales[0].1.len()), (1, i64::MIN, 27));
    assert!((scales[0].1[0].0.0[0] - 0.05).abs() < 1e-6);
    let numbers = |entity: &str| -> Vec<(i64, f64)> {
        let rows = contents.values::<Scalar>(entity, &Scalars::descriptor_scalars());
        rows.iter().map(|(time, values)| (*time, values[0].0.0)).collect()
    };
    let curve = |values: [f64; 3]| NANOSECONDS.into_iter().zip(values).collect::<Vec<_>>();
    assert_eq!(numbers("/objects/0/potential_energy"), curve([-0.5, 0.0, 0.5]));
    assert_eq!(numbers("/objects/0/trusted"), curve([1.0, 1.0, 0.0]));
    let law = contents.values::<Text>("/objects/0/law", &TextDocument::descriptor_text());
    assert_eq!(law[0].1[0].as_str(), "a law");
    let paths = contents.values::<LineStrip3D>("/world/objects/0/paths", &LineStrips3D::descriptor_strips());
    assert_eq!((paths[0].1.len(), paths[0].1[0].0.len()), (7, 3));
    let sizes = contents.values::<Resolution>("/world/view", &Pinhole::descriptor_resolution());
    assert_eq!((sizes.len(), sizes[0].1[0].0.0), (3, [8.0, 6.0]));
    let pictures = contents.values::<Blob>("/world/view", &EncodedImage::descriptor_blob());
    assert!(pictures.len() == 3 && pictures[0].1[0].0.starts_with(b"\x89PNG"));
}

#[test]
fn the_same_calls_record_the_same() {
    let dir = tempfile::tempdir().expect("a folder");
    let contents = |folder: &str| {
        let path = dir.path().join(folder).join("a.rrd");
        record(&path);
        Contents::read(&path)
    };
    contents("one").assert_same(&contents("two"));
}
