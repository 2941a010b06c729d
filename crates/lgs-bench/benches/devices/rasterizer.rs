//! The rasterizer with the photometric loss, on a scene as training leaves it.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::{Camera, GaussianCloud};
use lgs_render::tensor::{SplatTensors, ViewSpec, photometric_loss, rasterize};
use lgs_render::{Splats, rasterize as rasterize_slices};

use crate::Sizes;
use crate::rates::Rates;
use crate::rows::{last_of, least, row, share, wait_for};
use crate::trained_scene::trained_scene;

const BACKGROUND: [f32; 3] = [1.0; 3];
/// Calls that are timed together, so that a wait for the device is a small part of them.
const CALLS: usize = 10;

/// A scene on a device.
struct Scene {
    splats: SplatTensors,
    target: Tensor<3>,
    view: ViewSpec,
}

/// A tensor that carries gradients.
pub(crate) fn leaf<const D: usize>(values: &[f32], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device).require_grad()
}

impl Scene {
    fn new(cloud: &GaussianCloud, camera: Camera, device: &Device) -> Self {
        let (n, size) = (cloud.means.len(), [camera.height as usize, camera.width as usize, 3]);
        let splats = SplatTensors {
            means: leaf(cloud.means.as_flattened(), [n, 3], device),
            rotations: leaf(cloud.rotations.as_flattened(), [n, 4], device),
            log_scales: leaf(cloud.log_scales.as_flattened(), [n, 3], device),
            raw_opacities: leaf(&cloud.raw_opacities, [n], device),
            sh: leaf(&cloud.sh, [n, cloud.sh.len() / (3 * n), 3], device),
            means2d_probe: Tensor::zeros([n, 2], device),
            pose: Tensor::zeros([6], device),
        };
        let view = ViewSpec { camera, background: BACKGROUND, active_degree: cloud.sh_degree };
        Self { splats, target: Tensor::zeros(size, device), view }
    }

    /// Draws so many times; waits for the last.
    fn forward(&self) {
        let image = last_of(CALLS, || rasterize(&self.splats, self.view).image);
        wait_for(image.inner().sum());
    }

    /// Draws, compares and pulls back so many times; waits for the last.
    fn both(&self) {
        let gradient = last_of(CALLS, || {
            let image = rasterize(&self.splats, self.view).image;
            let gradients = photometric_loss(image, self.target.clone(), 0.2).backward();
            self.splats.means.grad(&gradients).expect("a gradient")
        });
        wait_for(gradient.sum());
    }
}

/// Measures and prints.
pub(crate) fn run(sizes: &Sizes, devices: &[Device; 2], rates: &Rates) {
    let camera = Camera::look_at([0.9, -3.0, 1.5], [0.0, 0.0, -0.1], 0.75, sizes.pixels, sizes.pixels);
    let cloud = trained_scene(sizes.gaussians);
    let pairs = rasterize_slices(&Splats::from(&cloud), &camera, BACKGROUND).listed_pairs() as f64;
    let scenes = devices.each_ref().map(|device| Scene::new(&cloud, camera, &device.clone().autodiff()));
    let [one, other] = &scenes;
    // What has to be read and written at the least: parameters and image, and on the way back also the target
    // and gradients by all of them.
    let least_bytes = 4.0 * (sizes.gaussians * (11 + 48) + 4 * camera.pixels()) as f64;
    let of = format!("{} Gaussians, {1} × {1}", sizes.gaussians, sizes.pixels);
    let secs = least([&mut || one.forward(), &mut || other.forward()]);
    print(&format!("rasterizer, forward ({of})"), secs, [pairs, least_bytes], rates);
    let secs = least([&mut || one.both(), &mut || other.both()]);
    print("the same with loss and backward", secs, [pairs, 3.0 * least_bytes], rates);
}

/// Prints the rate of calls with so many pairs and bytes each.
fn print(name: &str, secs: [f64; 2], [pairs, bytes]: [f64; 2], rates: &Rates) {
    let per_second = |work: f64| secs.map(|secs| CALLS as f64 * work / secs);
    row(&format!("{name}, G pairs/s"), per_second(pairs).map(|rate| rate * 1e-9));
    share("the pair rate", per_second(pairs), rates.pairs);
    share("the memory rate, of the bytes that must move", per_second(bytes), rates.memory);
}
