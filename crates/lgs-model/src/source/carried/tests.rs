use std::f32::consts::FRAC_PI_2;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::GaussianCloud;
use lgs_core::linear::{norm, sub};

use super::{CarriedMotion, CarryingPath};
use crate::source::config::{DELTAS, DeformationConfig};
use crate::source::input::InputFrame;
use crate::source::kind::SourceKind;
use crate::source::load_source;
use crate::source::motion::{Canonical, Captured, Learned, Moment, MotionConfig, SourceMotion};

fn path() -> CarryingPath {
    let places = vec![(0.0, [0.0; 3]), (0.1, [1.0, 0.0, 0.0]), (0.2, [1.0, 2.0, 0.0])];
    CarryingPath { places, flights: vec![[0.0, 0.1]], reach: 0.3, spin: [0.0; 3] }
}

/// The same path, and one about the third Gaussian that turns a quarter about z in 0.15.
fn paths() -> Vec<CarryingPath> {
    let places = vec![(0.0, [0.8, 2.0, 0.5]), (0.2, [0.8, 2.0, 2.5])];
    let spin = [0.0, 0.0, FRAC_PI_2 / 0.15];
    vec![path(), CarryingPath { places, flights: vec![[0.0, 0.2]], reach: 0.6, spin }]
}

/// Two Gaussians in the ball of the first path, one in that of the second and one elsewhere, at constant
/// velocities.
fn motion() -> (CarriedMotion, Learned) {
    let deformation = DeformationConfig::quick();
    let config = MotionConfig { deformation: &deformation, velocity: None, advection: None, nodes: None };
    let captured = Captured { frame: InputFrame::IDENTITY, time_window: 0.4, seed: 1 };
    let moved = SourceKind::Linear.motion(&config, captured).expect("a kind that is trained");
    let means = vec![[0.1, 0.0, 0.0], [0.0, -0.1, 0.2], [1.0, 2.0, 0.0], [5.0, 0.0, 0.0]];
    let cloud = GaussianCloud::isotropic(means, 0.1, [0.5; 3], 0.9);
    let parameters = (0..12).map(|i| 0.1 * i as f32).collect();
    (CarriedMotion::new(moved, paths()), Learned { cloud, features: Vec::new(), parameters })
}

#[test]
fn a_path_is_followed_evenly_and_left_at_its_end() {
    let carries = |path: CarryingPath, time: f32, to: [f32; 3]| {
        norm(sub(path.carried(time).center([0.0; 3], [0.0; 3]), to)) < 1e-5
    };
    assert!(carries(path(), 0.05, [0.5, 0.0, 0.0]) && carries(path(), 0.15, [1.0, 1.0, 0.0]));
    assert!(carries(path(), 0.0, [0.0; 3]) && carries(path(), 0.9, [1.0, 2.0, 0.0]));
    assert!(carries(CarryingPath { places: Vec::new(), ..path() }, 0.3, [0.0; 3]));
}

#[test]
fn training_and_model_carry_the_same_gaussians_and_no_others() {
    let ((motion, learned), device) = (motion(), Device::flex());
    let rows = |values: &[f32], width: usize| {
        Tensor::<2>::from_data(TensorData::new(values.to_vec(), [values.len() / width, width]), &device)
    };
    let canonical = Canonical {
        means: rows(learned.cloud.means.as_flattened(), 3),
        rotations: rows(learned.cloud.rotations.as_flattened(), 4),
        features: None,
    };
    let network = Tensor::<1>::from_floats(&*learned.parameters, &device);
    let at = Moment { time: 0.15, iteration: 0, window_end: 0.4 };
    let poses = motion.poses(network, canonical, at).into_data().try_to_vec::<f32>().expect("f32");
    let model = motion.model(learned.clone());
    let alone = motion.moved().model(learned);
    let (carried, own) = (model.positions_at(0.15), alone.positions_at(0.15));
    let cloud = model.cloud_at(0.15);
    for (i, pose) in poses.chunks_exact(DELTAS).enumerate() {
        assert!((0..3).all(|c| (pose[c] - carried[i][c]).abs() < 1e-5), "{i}");
        assert!((0..4).all(|c| (pose[3 + c] - cloud.rotations[i][c]).abs() < 1e-5), "{i}");
        let [x, y, z] = own[i];
        let expected = match i {
            0 | 1 => [x + 1.0, y + 1.0, z],
            // Its canonical centre is 0.2 beside the axis.
            2 => [x - 0.2, y + 0.2, z + 1.5],
            _ => own[i],
        };
        assert!((0..3).all(|c| (carried[i][c] - expected[c]).abs() < 1e-5), "{i}");
    }
    let [w, x, y, z] = cloud.rotations[2];
    assert!([w - z, x, y].iter().all(|off| off.abs() < 1e-5) && w > 0.7, "a quarter turn about z");
    assert_eq!(model.carried(), [1, 1, 0, 0], "what turns evenly is found as an object like any other");
    assert_eq!(cloud.means, carried);
}

#[test]
fn files_round_trip_and_defects_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let ((motion, learned), path) = (motion(), folder.path().join("source.safetensors"));
    let model = motion.model(learned);
    model.save(&path).expect("save");
    let read = load_source(&path).expect("load");
    assert_eq!(read.cloud_at(0.13), model.cloud_at(0.13));
    assert_eq!(read.carried(), model.carried());
    assert_eq!((read.free_flights(1), read.free_flights(0)), ([[0.0, 0.1]].as_slice(), [].as_slice()));
    let refused = |change: &dyn Fn(&mut crate::TensorFile)| {
        let mut file = model.to_tensors();
        change(&mut file);
        file.save(&path).expect("save");
        load_source(&path).err().expect("a defect").to_string()
    };
    let text = refused(&|file| file.insert_indices("carried.owners", &[4], &[0, 3, 0, 0]));
    assert!(text.contains("`carried.owners`") && text.contains("source.safetensors"), "{text}");
    let text = refused(&|file| file.insert_indices("carried.paths", &[5], &[0, 2, 2, 2, 2]));
    assert!(text.contains("`carried.paths`"), "{text}");
    let text = refused(&|file| file.insert("carried.flights", &[1, 3], &[2.0, 0.0, 0.1]));
    assert!(text.contains("`carried.flights`"), "{text}");
    let text = refused(&|file| file.insert("carried.times", &[5], &[0.0, 0.2, 0.1, 0.0, 0.2]));
    assert!(text.contains("`carried.times`"), "{text}");
    let text = refused(&|file| file.insert("carried.spins", &[1, 4], &[2.0, 0.0, 0.0, 1.0]));
    assert!(text.contains("`carried.spins`"), "{text}");
    let text = refused(&|file| file.insert("carried.canonical", &[1, 3], &[0.0; 3]));
    assert!(text.contains("`carried.canonical`"), "{text}");
    let text = refused(&|file| file.insert("carried.times", &[2], &[0.0, 0.1]));
    assert!(text.contains("`carried.places`"), "{text}");
}
