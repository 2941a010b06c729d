//! The rasterizer and the photometric loss on a device of Vulkan, Metal or DX12 (feature `gpu`): against the
//! conformance vectors and against the kernels of the processor.
#![cfg(feature = "gpu")]

mod common;
#[path = "common/random_scene.rs"]
mod random_scene;

use burn::tensor::{Device, Tensor, TensorData};
use common::tensors::{MAX_ABS, RELATIVE_L2, check_tensors, constant, tracked, values};
use common::vectors;
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_core::{Camera, GaussianCloud, PixelFilter, stream};
use lgs_render::tensor::{SplatTensors, ViewSpec, photometric_loss, rasterize, settle};
use lgs_render::{photometric, photometric_vjp};
use lgs_tensor::cube::device_for_tests;
use rand::RngExt;
use random_scene::{BACKGROUND, camera, cotangents, draw, gradients, random_cloud};

fn autodiff() -> Option<Device> {
    device_for_tests().map(Device::autodiff)
}

fn leaf<const D: usize>(values: &[f32], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device).require_grad()
}

/// Image, transmittance, radii and the gradients of all inputs, by name.
type Drawn = Vec<(&'static str, Vec<f32>)>;

/// Draws on a device, and pulls fixed cotangents back.
fn drawn_on(device: &Device, cloud: &GaussianCloud, camera: &Camera) -> Drawn {
    drawn_moved(device, cloud, camera, [0.0; 6])
}

/// The same of a scene that appears moved.
fn drawn_moved(device: &Device, cloud: &GaussianCloud, camera: &Camera, motion: [f32; 6]) -> Drawn {
    let n = cloud.means.len();
    let coefficients = (cloud.sh_degree + 1).pow(2);
    let splats = SplatTensors {
        means: leaf(cloud.means.as_flattened(), [n, 3], device),
        rotations: leaf(cloud.rotations.as_flattened(), [n, 4], device),
        log_scales: leaf(cloud.log_scales.as_flattened(), [n, 3], device),
        raw_opacities: leaf(&cloud.raw_opacities, [n], device),
        sh: leaf(&cloud.sh, [n, coefficients, 3], device),
        means2d_probe: leaf(&vec![0.0; 2 * n], [n, 2], device),
        pose: leaf(&motion, [6], device),
    };
    let drawn = rasterize(
        &splats,
        ViewSpec { camera: *camera, background: BACKGROUND, active_degree: cloud.sh_degree },
    );
    let (v_image, v_transmittance) = cotangents(camera);
    let (height, width) = (camera.height as usize, camera.width as usize);
    let v_image = TensorData::new(v_image.into_flattened(), [height, width, 3]);
    let v_transmittance = TensorData::new(v_transmittance, [height, width]);
    let loss = (drawn.image.clone() * Tensor::from_data(v_image, device)).sum()
        + (drawn.transmittance.clone() * Tensor::from_data(v_transmittance, device)).sum();
    let grads = loss.backward();
    let radii = drawn.radii.float();
    vec![
        ("image", values(drawn.image)),
        ("transmittance", values(drawn.transmittance)),
        ("radii", values(radii)),
        ("means", values(splats.means.grad(&grads).expect("means"))),
        ("rotations", values(splats.rotations.grad(&grads).expect("rotations"))),
        ("log_scales", values(splats.log_scales.grad(&grads).expect("log_scales"))),
        ("raw_opacities", values(splats.raw_opacities.grad(&grads).expect("raw_opacities"))),
        ("sh", values(splats.sh.grad(&grads).expect("sh"))),
        ("means2d", values(splats.means2d_probe.grad(&grads).expect("means2d"))),
        ("pose", values(splats.pose.grad(&grads).expect("pose"))),
    ]
}

/// The same on slices.
fn drawn_on_slices(cloud: &GaussianCloud, camera: &Camera) -> Drawn {
    let drawn = draw(cloud, camera);
    let v = gradients(cloud, camera, &drawn);
    vec![
        ("image", drawn.image.as_flattened().to_vec()),
        ("transmittance", drawn.transmittance.clone()),
        ("radii", drawn.radii.iter().map(|&radius| radius as f32).collect()),
        ("means", v.means.into_flattened()),
        ("rotations", v.rotations.into_flattened()),
        ("log_scales", v.log_scales.into_flattened()),
        ("raw_opacities", v.raw_opacities),
        ("sh", v.sh),
        ("means2d", v.means2d.into_flattened()),
        ("pose", v.pose.to_vec()),
    ]
}

fn compare(device: &Device, what: &str, cloud: &GaussianCloud, camera: &Camera) {
    assert_close(what, &drawn_on(device, cloud, camera), &drawn_on_slices(cloud, camera));
}

fn assert_close(what: &str, found: &Drawn, expected: &Drawn) {
    for ((name, found), (_, expected)) in found.iter().zip(expected) {
        let label = format!("{what}: {name}");
        match *name {
            "image" | "transmittance" => {
                assert_values_close(&label, found, expected, MAX_ABS, RELATIVE_L2);
            }
            // A radius just above a whole number may be rounded up or not.
            "radii" => assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1.0), "{label}"),
            // Round Gaussians have no gradient by their rotations but rounding.
            _ if found.iter().chain(expected).all(|v| v.abs() < 1e-8) => {}
            _ => assert_gradient_close(&label, found, expected),
        }
    }
}

#[test]
fn rasterize_conformance_on_the_device() {
    let Some(device) = autodiff() else { return };
    for vector in vectors("rasterize") {
        check_tensors(&vector, &device, |splats, view| {
            let drawn = rasterize(splats, view);
            (drawn.image, drawn.transmittance)
        });
    }
}

#[test]
fn ssim_conformance_on_the_device() {
    let Some(device) = autodiff() else { return };
    for vector in vectors("ssim") {
        let a: Tensor<3> = tracked(&vector, "a", &device);
        let b: Tensor<3> = constant(&vector, "b", &device);
        let value = photometric_loss(a.clone(), b, 1.0).neg().add_scalar(1.0);
        let grads = value.clone().backward();
        assert_values_close(&vector.name, &values(value), &vector.get("ssim"), MAX_ABS, RELATIVE_L2);
        let gradient = values(a.grad(&grads).expect("a gradient"));
        assert_gradient_close(&vector.name, &gradient, &vector.get("grad_a"));
    }
}

#[test]
fn images_and_gradients_are_those_of_the_processor() {
    let Some(device) = autodiff() else { return };
    compare(&device, "45×37", &random_cloud(300, 1), &camera(45, 37));
    compare(&device, "64×64", &random_cloud(1, 2), &camera(64, 64));
    compare(&device, "3×50", &random_cloud(40, 3), &camera(3, 50));
    let mip = Camera { filter: PixelFilter::Mip, ..camera(33, 20) };
    compare(&device, "Mip", &random_cloud(120, 4), &mip);
}

#[test]
fn a_scene_that_appears_moved_is_drawn_as_by_the_moved_camera() {
    let Some(device) = autodiff() else { return };
    let (cloud, camera) = (random_cloud(300, 6), camera(45, 37));
    for motion in [[0.1, -0.05, 0.2, 0.03, 0.1, -0.2], [1e-3, 0.0, -2e-3, 0.0, 0.0, 0.0]] {
        let expected = drawn_on_slices(&cloud, &camera.seeing_moved(motion));
        assert_close("moved", &drawn_moved(&device, &cloud, &camera, motion), &expected);
        let processor = drawn_moved(&Device::flex().autodiff(), &cloud, &camera, motion);
        assert_close("moved, on the processor", &processor, &expected);
    }
}

#[test]
fn long_lists_large_gaussians_and_empty_images_are_drawn() {
    let Some(device) = autodiff() else { return };
    let near = |count: usize, scale: f32, opacity: f32| {
        let means = (0..count).map(|i| [(i as f32 * 0.7).sin() * 0.05, i as f32 * 1e-4, 0.0]).collect();
        GaussianCloud::isotropic(means, scale, [0.7, 0.2, 0.5], opacity)
    };
    compare(&device, "a tile of 3000", &near(3000, 0.05, 0.02), &camera(16, 16));
    compare(&device, "pixels that stop", &near(200, 0.3, 0.9), &camera(20, 20));
    compare(&device, "all tiles", &near(1, 20.0, 0.5), &camera(70, 50));
    let behind = GaussianCloud::isotropic(vec![[0.0, -40.0, 0.0]], 0.1, [1.0; 3], 0.9);
    compare(&device, "nothing visible", &behind, &camera(20, 20));
    let few = GaussianCloud { sh_degree: 1, ..GaussianCloud::default() };
    let drawn = drawn_on(&device, &few, &camera(4, 4));
    assert!(drawn[0].1.as_chunks::<3>().0.iter().all(|pixel| *pixel == BACKGROUND));
}

#[test]
fn many_small_gaussians_are_sorted_through_several_blocks() {
    let Some(device) = autodiff() else { return };
    let mut rng = stream(17, "crowd", 0);
    let means = (0..9000).map(|_| [0; 3].map(|_| rng.random_range(-0.8..0.8))).collect();
    compare(&device, "9000", &GaussianCloud::isotropic(means, 0.01, [0.7, 0.2, 0.5], 0.05), &camera(90, 77));
}

#[test]
fn the_same_bytes_come_out_twice() {
    let Some(device) = autodiff() else { return };
    let (cloud, camera) = (random_cloud(500, 5), camera(64, 48));
    assert_eq!(drawn_on(&device, &cloud, &camera), drawn_on(&device, &cloud, &camera));
}

#[test]
fn the_photometric_loss_is_that_of_the_processor_at_any_size() {
    let Some(device) = autodiff() else { return };
    let mut rng = stream(13, "images", 0);
    for (width, height) in [(1, 7), (3, 3), (16, 16), (29, 20), (80, 11), (131, 60)] {
        let mut image = || -> Vec<[f32; 3]> {
            (0..width * height).map(|_| [0; 3].map(|_| rng.random_range(0.0..1.0))).collect()
        };
        let (rendered, target) = (image(), image());
        let a = leaf(rendered.as_flattened(), [height, width, 3], &device);
        let b = leaf(target.as_flattened(), [height, width, 3], &device);
        let found = photometric_loss(a.clone(), b.clone(), 0.2);
        let grads = found.clone().backward();
        let (loss, v) = photometric_vjp(&rendered, &target, [width, height], 0.2);
        let name = format!("{width}×{height}");
        assert_values_close(&name, &values(found), &[loss], 1e-5, RELATIVE_L2);
        assert_gradient_close(&name, &values(a.clone().grad(&grads).expect("a gradient")), v.as_flattened());
        let untracked = photometric_loss(a.detach(), b.detach(), 0.2);
        let expected = photometric(&rendered, &target, [width, height], 0.2);
        assert_values_close(&name, &values(untracked), &[expected], 1e-5, RELATIVE_L2);
    }
}

#[test]
fn an_image_without_room_for_its_lists_teaches_nothing_and_the_next_has_room() {
    let Some(device) = autodiff() else { return };
    // A number of tiles that no other test draws.
    let camera = camera(130, 70);
    let sized = |scale: f32| {
        let means = (0..60).map(|i| [(i as f32 * 0.7).sin(), 0.01 * i as f32, (i as f32 * 1.1).cos()]);
        GaussianCloud::isotropic(means.collect(), scale, [0.7, 0.2, 0.5], 0.3)
    };
    let (small, large) = (sized(0.002), sized(2.0));
    (0..40).for_each(|_| drop(drawn_on(&device, &small, &camera)));
    let crowded = drawn_on(&device, &large, &camera);
    assert!(crowded[3..].iter().all(|(_, gradient)| gradient.iter().all(|v| *v == 0.0)));
    settle(&device);
    let expected = drawn_on_slices(&large, &camera);
    let found = without_ties(drawn_on(&device, &large, &camera), &expected, 0.3);
    assert_close("with room", &found, &expected);
}

/// The transmittance below which no entry leaves a pixel, and by how much of it rounding changes one there:
/// some ten factors of an error of 1e-6 each.
const STOP: f32 = 1e-4;
const ROUNDING: f32 = 1e-4;

/// Makes what was found of ties what is expected, after a check of how far apart they are. At a tie an entry
/// of alpha a would leave a pixel at the stop s but for rounding, so that one image is closed before it, at
/// s / (1 - a), and one behind it, at s: they differ by s a / (1 - a), and their light by that times the
/// difference of the entry's colour and the background, which is less than 1. More entries make no
/// difference, since each of them closes a pixel at the stop.
fn without_ties(mut found: Drawn, expected: &Drawn, largest_alpha: f32) -> Drawn {
    let most = STOP * largest_alpha / (1.0 - largest_alpha) + STOP * ROUNDING;
    for pixel in 0..expected[1].1.len() {
        let (a, b) = (found[1].1[pixel], expected[1].1[pixel]);
        let is_apart = (a - b).abs() > STOP * ROUNDING;
        if is_apart && (a.min(b) - STOP).abs() <= STOP * ROUNDING {
            assert!((a - b).abs() <= most, "a tie at pixel {pixel}: {a} and {b} differ by more than {most}");
            found[1].1[pixel] = b;
            for value in 3 * pixel..3 * pixel + 3 {
                let expected = expected[0].1[value];
                assert!((found[0].1[value] - expected).abs() <= most, "a tie at value {value}");
                found[0].1[value] = expected;
            }
        }
    }
    found
}
