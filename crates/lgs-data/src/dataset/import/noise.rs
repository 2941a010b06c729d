//! Noise of cameras and exposures, put on a set whose own are good, to see what training makes of it.
//!
//! Only the training split is disturbed: what is held out keeps its cameras and images, so that figures
//! before and after can be compared. The mean change of exposure over cameras is none, since images do not
//! tell a scene that is brighter from cameras that all expose more.

use crate::dataset::error::Problem;
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::pixels::Masked;
use crate::dataset::points::point_nearest_to_axes;
use glam::Vec3;
use lgs_core::{Camera, stream};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;

/// Step of the numbers of a motion by which its effect on the image is measured, in pixels.
const PROBE: f32 = 0.01;

/// How much the training cameras are disturbed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CaptureNoise {
    /// Root mean square, over the image, cameras and draws, of the displacement of the scene, pixels: normal
    /// rotations about the camera's centre and translations, each by as many pixels.
    pub camera: f32,
    /// Largest change of exposure, as a fraction of display-referred values: uniform draws, one per camera,
    /// less their mean.
    pub exposure: f32,
    /// Draws both.
    pub seed: u64,
}

/// The disturbances of all training cameras.
pub(super) struct Disturbances {
    noise: CaptureNoise,
    /// The point that cameras look at.
    center: [f32; 3],
    /// By pose: normal draws of a motion, and the gain of the exposure.
    cameras: BTreeMap<[u32; 16], ([f32; 6], f32)>,
}

fn key(spec: &FrameSpec) -> [u32; 16] {
    spec.camera_from_world.to_cols_array().map(f32::to_bits)
}

impl Disturbances {
    /// Draws those of the cameras of the training frames, in order of appearance.
    pub(super) fn of(frames: &[FrameSpec], noise: CaptureNoise) -> Result<Self, Problem> {
        for (value, most, field) in [(noise.camera, f32::MAX, "camera"), (noise.exposure, 0.9, "exposure")] {
            if !(0.0..=most).contains(&value) {
                let found = format!("noise of `{field}` should be from 0 to {most}, found {value}");
                return Err(Problem::Malformed(found));
            }
        }
        let mut cameras = BTreeMap::new();
        let mut views = Vec::new();
        for spec in frames {
            let index = cameras.len() as u64;
            cameras.entry(key(spec)).or_insert_with(|| {
                let eye = spec.camera_from_world.inverse().w_axis.truncate();
                views.push((eye, spec.camera_from_world.row(2).truncate().normalize_or(Vec3::Z), 0.0));
                let mut random = stream(noise.seed, "capture noise", index);
                let motion = std::array::from_fn(|_| StandardNormal.sample(&mut random));
                (motion, noise.exposure * random.random_range(-1.0_f32..1.0))
            });
        }
        let mean = cameras.values().map(|(_, change)| change).sum::<f32>() / cameras.len().max(1) as f32;
        cameras.values_mut().for_each(|(_, change)| *change = 1.0 + *change - mean);
        Ok(Self { noise, center: point_nearest_to_axes(&views).into(), cameras })
    }

    /// A training frame's camera and image with its disturbance.
    pub(super) fn applied(
        &self,
        spec: &FrameSpec,
        (camera, mut masked): (Camera, Masked),
    ) -> (Camera, Masked) {
        let Some((motion, gain)) = self.cameras.get(&key(spec)) else { return (camera, masked) };
        for pixel in masked.image.pixels_mut() {
            for value in &mut pixel.0[..3] {
                *value = (f32::from(*value) * gain).round().clamp(0.0, 255.0) as u8;
            }
        }
        (self.moved(&camera, motion), masked)
    }

    fn moved(&self, camera: &Camera, draws: &[f32; 6]) -> Camera {
        if self.noise.camera == 0.0 {
            return *camera;
        }
        let (_, depth) = camera.pixel_from_world(self.center);
        let depth = depth.abs().max(f32::MIN_POSITIVE);
        let unit = |i: usize| if i < 3 { 1.0 / camera.fx } else { depth / camera.fx };
        let seen = |i: usize| {
            let by = std::array::from_fn(|k| if k == i { PROBE * unit(i) } else { 0.0 });
            (camera.displacement(&camera.seeing_moved(by), depth) / f64::from(PROBE)).powi(2)
        };
        let factor = self.noise.camera / (0..6).map(seen).sum::<f64>().sqrt() as f32;
        camera.seeing_moved(std::array::from_fn(|i| factor * unit(i) * draws[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn specs() -> Vec<FrameSpec> {
        let pose = |i: usize| {
            let angle = 0.11 * (i % 40) as f32;
            let eye = [4.0 * angle.cos(), 4.0 * angle.sin(), 1.0];
            Camera::look_at(eye, [0.0; 3], 0.8, 160, 120).camera_from_world
        };
        (0..80).map(|i| FrameSpec { camera_from_world: pose(i), ..FrameSpec::default() }).collect()
    }

    #[test]
    fn cameras_are_off_by_as_many_pixels_and_exposures_change_around_none() {
        let (specs, noise) = (specs(), CaptureNoise { camera: 1.0, exposure: 0.1, seed: 3 });
        let disturbed = Disturbances::of(&specs, noise).unwrap();
        let gains: Vec<f32> = disturbed.cameras.values().map(|(_, gain)| gain - 1.0).collect();
        assert_eq!(gains.len(), 40, "one per camera");
        assert!(gains.iter().sum::<f32>().abs() < 1e-4 && gains.iter().all(|g| g.abs() < 0.15));
        let squares = specs.iter().map(|spec| {
            let camera = Camera::look_at([4.0, 0.0, 1.0], [0.0; 3], 0.8, 160, 120);
            let camera = Camera { camera_from_world: spec.camera_from_world, ..camera };
            let image = image::RgbaImage::from_pixel(1, 1, image::Rgba([100, 100, 100, 255]));
            let (moved, seen) = disturbed.applied(spec, (camera, Masked { image, mask: None }));
            let gain = disturbed.cameras[&key(spec)].1;
            assert_eq!(seen.image.pixels().next().unwrap().0[0], (100.0 * gain).round() as u8);
            camera.displacement(&moved, 4.1).powi(2)
        });
        let root = (squares.sum::<f64>() / specs.len() as f64).sqrt();
        assert!((0.8..1.2).contains(&root), "{root}");
    }

    #[test]
    fn noise_out_of_range_is_refused() {
        for noise in [
            CaptureNoise { camera: -1.0, ..CaptureNoise::default() },
            CaptureNoise { exposure: 1.0, ..CaptureNoise::default() },
            CaptureNoise { camera: f32::NAN, ..CaptureNoise::default() },
        ] {
            assert!(Disturbances::of(&specs(), noise).is_err(), "{noise:?}");
        }
    }
}
