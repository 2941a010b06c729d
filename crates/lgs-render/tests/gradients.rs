//! Finite differences of the whole rasterizer and of the photometric loss.

use lgs_core::{Camera, GaussianCloud, PixelFilter, stream};
use lgs_render::{ImageCotangents, Splats, photometric, photometric_vjp, rasterize, rasterize_vjp};
use rand::RngExt;

const BACKGROUND: [f32; 3] = [0.9, 0.5, 0.1];

/// Large soft Gaussians: no pixel is near the 1/255 cut-off or the stop, where the image is not smooth.
fn soft_cloud() -> GaussianCloud {
    let mut rng = stream(11, "soft", 0);
    let mut uniform = |low: f32, high: f32| rng.random_range(low..high);
    let mut cloud = GaussianCloud { sh_degree: 3, ..GaussianCloud::default() };
    for _ in 0..6 {
        cloud.means.push(std::array::from_fn(|_| uniform(-0.5, 0.5)));
        cloud.rotations.push(std::array::from_fn(|_| uniform(-1.0, 1.0)));
        cloud.log_scales.push(std::array::from_fn(|_| uniform(0.0, 0.7)));
        cloud.raw_opacities.push(uniform(-1.0, 0.5));
        cloud.sh.extend((0..48).map(|_| uniform(-0.15, 0.15)));
    }
    cloud
}

struct Probe {
    camera: Camera,
    v_image: Vec<[f32; 3]>,
    v_transmittance: Vec<f32>,
}

impl Probe {
    fn new(camera: Camera) -> Self {
        let mut rng = stream(12, "weights", 0);
        let v_image =
            (0..camera.pixels()).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        let v_transmittance = (0..camera.pixels()).map(|_| rng.random_range(-1.0..1.0)).collect();
        Self { camera, v_image, v_transmittance }
    }

    fn loss(&self, cloud: &GaussianCloud) -> f64 {
        self.loss_from(&self.camera, cloud)
    }

    fn loss_from(&self, camera: &Camera, cloud: &GaussianCloud) -> f64 {
        let drawn = rasterize(&Splats::from(cloud), camera, BACKGROUND);
        let weighted =
            |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
        weighted(drawn.image.as_flattened(), self.v_image.as_flattened())
            + weighted(&drawn.transmittance, &self.v_transmittance)
    }
}

fn check(
    probe: &Probe,
    (name, found): (&str, &[f32]),
    step: f32,
    values: impl Fn(&mut GaussianCloud) -> &mut [f32],
) {
    let cloud = soft_cloud();
    let scale = found.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    assert!(scale > 0.0, "{name} has no gradient");
    for (i, &found) in found.iter().enumerate() {
        let moved = |d: f32| {
            let mut other = cloud.clone();
            values(&mut other)[i] += d;
            probe.loss(&other)
        };
        let slope = ((moved(step) - moved(-step)) / (2.0 * f64::from(step))) as f32;
        assert!(
            (slope - found).abs() < 0.01 * scale,
            "{name}[{i}]: difference quotient {slope}, gradient {found}"
        );
    }
}

#[test]
fn gradients_match_difference_quotients() {
    check_all(Camera::look_at([0.3, -3.2, 0.8], [0.0; 3], 0.5, 21, 18));
}

#[test]
fn gradients_of_the_mip_filter_match_difference_quotients() {
    // Pixels are about as wide as the Gaussians, whose energy the filter then changes.
    let coarse = Camera::look_at([0.3, -3.2, 0.8], [0.0; 3], 1.0, 3, 2);
    check_all(Camera { filter: PixelFilter::Mip, ..coarse });
}

fn check_all(camera: Camera) {
    let (probe, cloud) = (Probe::new(camera), soft_cloud());
    let splats = Splats::from(&cloud);
    let drawn = rasterize(&splats, &probe.camera, BACKGROUND);
    let v = ImageCotangents { image: &probe.v_image, transmittance: &probe.v_transmittance };
    let v = rasterize_vjp(&splats, &probe.camera, &drawn, v);
    check(&probe, ("means", v.means.as_flattened()), 1e-2, |c| c.means.as_flattened_mut());
    check(&probe, ("rotations", v.rotations.as_flattened()), 1e-2, |c| c.rotations.as_flattened_mut());
    check(&probe, ("log_scales", v.log_scales.as_flattened()), 1e-2, |c| c.log_scales.as_flattened_mut());
    check(&probe, ("raw_opacities", &v.raw_opacities), 1e-2, |c| &mut c.raw_opacities);
    check(&probe, ("sh", &v.sh), 1e-2, |c| &mut c.sh);
    check_pose(&probe, &cloud, v.pose);
}

fn check_pose(probe: &Probe, cloud: &GaussianCloud, found: [f32; 6]) {
    let scale = found.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    for (i, found) in found.into_iter().enumerate() {
        let moved = |d: f32| {
            let mut by = [0.0; 6];
            by[i] = d;
            probe.loss_from(&probe.camera.seeing_moved(by), cloud)
        };
        let slope = ((moved(3e-3) - moved(-3e-3)) / 6e-3) as f32;
        assert!((slope - found).abs() < 0.01 * scale, "pose[{i}]: quotient {slope}, gradient {found}");
    }
}

#[test]
fn the_gradient_of_the_photometric_loss_matches_difference_quotients() {
    let (width, height) = (13, 9);
    let mut rng = stream(13, "images", 0);
    let mut image = || -> Vec<[f32; 3]> {
        (0..width * height).map(|_| std::array::from_fn(|_| rng.random_range(0.0..1.0))).collect()
    };
    let (a, b) = (image(), image());
    let (loss, v) = photometric_vjp(&a, &b, [width, height], 0.2);
    assert_eq!(loss, photometric(&a, &b, [width, height], 0.2));
    for i in (0..a.len() * 3).step_by(7) {
        let moved = |d: f32| {
            let mut other = a.clone();
            other.as_flattened_mut()[i] += d;
            f64::from(photometric(&other, &b, [width, height], 0.2))
        };
        let slope = ((moved(2e-3) - moved(-2e-3)) / 4e-3) as f32;
        assert!((slope - v.as_flattened()[i]).abs() < 1e-4, "value {i}: {slope} {}", v.as_flattened()[i]);
    }
}
