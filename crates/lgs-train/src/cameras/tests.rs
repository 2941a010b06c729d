//! Disturbed cameras of known Gaussians find back to where they belong.

use burn::tensor::Tensor;
use lgs_core::{Camera, Exposure, Gauge, GaussianCloud};
use lgs_data::dataset::{CameraOrigin, Dataset, Frame};
use lgs_model::TensorFile;
use lgs_render::{Splats, rasterize};

use super::*;
use crate::cloud_tensors::CloudTensors;
use crate::device::DeviceName;
use crate::view::View;

const SIZE: u32 = 40;
const ITERATIONS: usize = 600;

fn cloud() -> GaussianCloud {
    let place = |i: usize| [(i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32].map(|v| 0.5 * (v - 1.0));
    let mut cloud = GaussianCloud::isotropic((0..27).map(place).collect(), 0.14, [0.5; 3], 0.9);
    cloud.sh.iter_mut().enumerate().for_each(|(i, color)| *color = ((i * 37) % 11) as f32 / 6.0 - 0.9);
    cloud
}

fn true_camera(i: usize) -> Camera {
    let angle = 1.1 * i as f32;
    let height = [0.6, 2.2, 1.3][i % 3];
    Camera::look_at([4.0 * angle.cos(), 4.0 * angle.sin(), height], [0.0; 3], 0.6, SIZE, SIZE)
}

/// What was done to a camera: a motion of about a pixel, without one of the world, and a change of exposure
/// of which the mean is none.
fn disturbance(i: usize) -> ([f32; 6], f32) {
    let pixel = f64::from(true_camera(0).fx).recip();
    let draw = |n: usize| ((n / 6 * 29 + n % 6 * 17) % 13) as f64 / 6.0 - 1.0;
    let unit = |n: usize| pixel * if n % 6 < 3 { 1.0 } else { 4.0 };
    let mut motions: Vec<f64> = (0..36).map(|n| unit(n) * draw(n)).collect();
    let cameras: Vec<Camera> = (0..6).map(true_camera).collect();
    Gauge::of(&cameras, [0.0; 3]).remove(&mut motions);
    (std::array::from_fn(|k| motions[6 * i + k] as f32), 0.04 * (i as f32 - 2.5))
}

/// Images of the true cameras, given as those of disturbed ones.
fn disturbed() -> Dataset {
    let frame = |i: usize| {
        let (by, change) = disturbance(i);
        let drawn = rasterize(&Splats::from(&cloud()), &true_camera(i), [1.0; 3]);
        let mut image = drawn.image;
        let exposure = Exposure { gain: [1.0 + change; 3], offset: [0.0; 3] };
        exposure.expose(&mut image, &drawn.transmittance, [1.0; 3]);
        let bytes = |p: &[f32; 3]| [p[0], p[1], p[2], 1.0].map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8);
        let pixels = image.iter().flat_map(bytes).collect::<Vec<u8>>().into();
        let (name, camera) = (i.to_string(), true_camera(i).seeing_moved(by));
        Frame { name, camera_id: i, camera, time: 0.0, exposure: Exposure::IDENTITY, pixels }
    };
    let mut dataset = Dataset::none([1.0; 3]);
    dataset.splits.insert("train".to_owned(), (0..6).map(frame).collect());
    dataset
}

fn config() -> CamerasConfig {
    let asked = Refine::On;
    CamerasConfig { refine_exposure: asked, refine_poses: asked, pose_after: 0.0, ..CamerasConfig::default() }
}

/// Steps of the refinement with the Gaussians as they are.
fn train(refinement: &mut CameraRefinement, dataset: &Dataset, steps: std::ops::Range<usize>) {
    let device = DeviceName::Cpu.device().autodiff();
    let tensors = CloudTensors::new(&cloud(), &DeviceName::Cpu.device());
    for step in steps {
        let frame = &dataset.split("train")[step * 5 % 6];
        let sensor = refinement.sensor(frame, step);
        let view = View {
            frame,
            sensor: &sensor,
            background: [1.0; 3],
            ssim_weight: 0.2,
            sh_degree: 0,
            device: &device,
        };
        let probe = Tensor::zeros([27, 2], &device);
        let compared = view.compare(tensors.clone().autodiff().splats(probe));
        let mut gradients = compared.loss.backward();
        refinement.step(frame, &sensor, step, &mut gradients);
    }
}

/// Root mean square distance of the images of cameras from where they belong, pixels.
fn misplaced(cameras: impl Iterator<Item = Camera>) -> f64 {
    let squares: Vec<f64> =
        cameras.enumerate().map(|(i, camera)| true_camera(i).displacement(&camera, 4.0).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn disturbed_cameras_find_back() {
    let (dataset, device) = (disturbed(), DeviceName::Cpu.device());
    let mut refinement = CameraRefinement::new(&dataset, &config(), ITERATIONS, &device);
    train(&mut refinement, &dataset, 0..ITERATIONS);
    let refined = refinement.refined().expect("refined cameras");
    let corrected = refined.applied_to(&dataset);
    let of = |dataset: &Dataset| misplaced(dataset.split("train").iter().map(|frame| frame.camera));
    let (before, after) = (of(&dataset), of(&corrected));
    assert!(before > 0.5 && after < 0.5 * before, "{before} {after}");
    for (i, camera) in refined.cameras.iter().enumerate() {
        let gain = camera.exposure.gain[0] + camera.exposure.offset[0] / 0.5 - 1.0;
        assert!((gain - disturbance(i).1).abs() < 0.02, "{i}: {gain} for {}", disturbance(i).1);
    }
    let mean: f32 = refined.cameras.iter().map(|camera| camera.exposure.gain[1] - 1.0).sum();
    assert!(mean.abs() < 1e-4, "{mean}");
}

#[test]
fn a_stop_and_a_file_change_nothing() {
    let (dataset, device) = (disturbed(), DeviceName::Cpu.device());
    let fresh = || CameraRefinement::new(&dataset, &config(), ITERATIONS, &device);
    let (mut whole, mut first, mut second) = (fresh(), fresh(), fresh());
    train(&mut whole, &dataset, 0..20);
    train(&mut first, &dataset, 0..9);
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("state");
    let mut file = TensorFile::new("test/1");
    first.insert_into(&mut file);
    file.save(&path).expect("save");
    second.restore(&TensorFile::load(&path, "test/1").expect("load"), &device).expect("restore");
    train(&mut second, &dataset, 9..20);
    assert_eq!(second.refined(), whole.refined());
}

#[test]
fn auto_keeps_poses_of_any_origin_and_refines_exposures_of_captures() {
    let (mut dataset, device) = (disturbed(), DeviceName::Cpu.device());
    for origin in [CameraOrigin::Exact, CameraOrigin::Calibrated, CameraOrigin::Estimated] {
        dataset.camera_origin = origin;
        let config = CamerasConfig { pose_after: 0.0, ..CamerasConfig::default() }.resolved(origin);
        let mut refinement = CameraRefinement::new(&dataset, &config, ITERATIONS, &device);
        assert_eq!(refinement.refined().is_none(), origin == CameraOrigin::Exact, "{origin:?}");
        if origin == CameraOrigin::Exact {
            continue;
        }
        train(&mut refinement, &dataset, 0..12);
        let refined = refinement.refined().expect("exposures");
        assert!(refined.cameras.iter().all(|camera| camera.motion == [0.0; 6]));
        assert!(refined.cameras.iter().all(|camera| camera.exposure != Exposure::IDENTITY));
        let corrected = refined.applied_to(&dataset);
        let pairs = corrected.split("train").iter().zip(dataset.split("train"));
        pairs.for_each(|(corrected, given)| assert_eq!(corrected.camera, given.camera));
    }
}

#[test]
fn cameras_that_are_taken_as_they_are_cost_nothing() {
    let (dataset, device) = (disturbed(), DeviceName::Cpu.device());
    let refinement = CameraRefinement::new(&dataset, &CamerasConfig::off(), ITERATIONS, &device);
    let sensor = refinement.sensor(&dataset.split("train")[1], 5);
    assert!(refinement.refined().is_none() && sensor.pose.is_none() && sensor.exposure.is_none());
}
