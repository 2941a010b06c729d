//! Noise of cameras and exposures, put on a set whose own are good, to see what training makes of it.
//!
//! Only the training split is disturbed: what is held out keeps its cameras and images, so that figures
//! before and after can be compared. What no image shows of a disturbance is left out of it: the mean change
//! of exposure over cameras, since the scene may as well be brighter, and a motion of the world ([`Gauge`]).

use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::pixels::Masked;
use crate::dataset::points::point_nearest_to_axes;
use crate::thresholds::MOST_NOISE;
use glam::Vec3;
use lgs_core::{Camera, Gauge, stream};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;

/// How much the training cameras are disturbed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CaptureNoise {
    /// Root mean square over images and cameras of the displacement of the scene, pixels: normal rotations
    /// about the camera's centre and translations, each by as many pixels.
    pub camera: f32,
    /// Largest change of exposure, as a fraction of display-referred values: uniform draws, one per camera,
    /// less their mean.
    pub exposure: f32,
    /// Draws both.
    pub seed: u64,
}

/// The disturbances of all training cameras.
#[derive(Default)]
pub(super) struct Disturbances {
    /// By pose: the motion ([`Camera::seeing_moved`]), and the gain of the exposure.
    cameras: BTreeMap<[u32; 16], ([f32; 6], f32)>,
}

fn key(spec: &FrameSpec) -> [u32; 16] {
    spec.camera_from_world.to_cols_array().map(f32::to_bits)
}

impl CaptureNoise {
    /// What is wrong with the values, if anything is.
    fn check(&self) -> Result<(), Problem> {
        for (value, most, field) in
            [(self.camera, f32::MAX, "camera"), (self.exposure, MOST_NOISE, "exposure")]
        {
            if !(0.0..=most).contains(&value) {
                let found = format!("noise of `{field}` should be from 0 to {most}, found {value}");
                return Err(Problem::Malformed(found));
            }
        }
        Ok(())
    }
}

impl Disturbances {
    /// Draws those of the cameras of the training frames, in order of appearance.
    pub(super) fn of(
        frames: &[FrameSpec],
        noise: CaptureNoise,
        camera: impl Fn(&FrameSpec) -> Result<Camera, DatasetError>,
    ) -> Result<Self, DatasetError> {
        let place = frames.first().map(|spec| spec.described_in.clone()).unwrap_or_default();
        noise.check().map_err(|problem| DatasetError::new(&place, problem))?;
        if noise.camera == 0.0 && noise.exposure == 0.0 {
            return Ok(Self::default());
        }
        let (mut keys, mut cameras) = (Vec::new(), Vec::new());
        for spec in frames {
            if !keys.contains(&key(spec)) {
                keys.push(key(spec));
                cameras.push(camera(spec)?);
            }
        }
        let motions = motions(&cameras, noise);
        let change = |i: usize| {
            let mut random = stream(noise.seed, "exposure noise", i as u64);
            noise.exposure * random.random_range(-1.0_f32..1.0)
        };
        let changes: Vec<f32> = (0..keys.len()).map(change).collect();
        let mean = changes.iter().sum::<f32>() / changes.len().max(1) as f32;
        let each = keys.into_iter().zip(motions.into_iter().zip(changes));
        Ok(Self { cameras: each.map(|(key, (by, change))| (key, (by, 1.0 + change - mean))).collect() })
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
        let is_moved = *motion != [0.0; 6];
        (if is_moved { camera.seeing_moved(*motion) } else { camera }, masked)
    }
}

/// Motions of cameras without one of the world, of which the displacements have the root mean square asked
/// for.
fn motions(cameras: &[Camera], noise: CaptureNoise) -> Vec<[f32; 6]> {
    let axes: Vec<(Vec3, Vec3, f32)> = cameras
        .iter()
        .map(|camera| {
            let axis = camera.camera_from_world.row(2).truncate().normalize_or(Vec3::Z);
            (Vec3::from(camera.center_in_world()), axis, 0.0)
        })
        .collect();
    let center: [f32; 3] = point_nearest_to_axes(&axes).into();
    let depth = |camera: &Camera| camera.pixel_from_world(center).1.abs().max(f32::MIN_POSITIVE);
    let draws = cameras.iter().enumerate().flat_map(|(i, camera)| {
        let mut random = stream(noise.seed, "camera noise", i as u64);
        let (turn, shift) = (1.0 / camera.fx, depth(camera) / camera.fx);
        [turn, turn, turn, shift, shift, shift].map(|unit| {
            let draw: f64 = StandardNormal.sample(&mut random);
            f64::from(unit) * draw
        })
    });
    let mut motions: Vec<f64> = draws.collect();
    Gauge::of(cameras, center).remove(&mut motions);
    let by = |i: usize, factor: f64| std::array::from_fn(|k| (factor * motions[6 * i + k]) as f32);
    let square =
        |i: usize| cameras[i].displacement(&cameras[i].seeing_moved(by(i, 1.0)), depth(&cameras[i])).powi(2);
    let mean = (0..cameras.len()).map(square).sum::<f64>() / cameras.len().max(1) as f64;
    let factor = f64::from(noise.camera) / mean.sqrt().max(f64::MIN_POSITIVE);
    (0..cameras.len()).map(|i| by(i, factor)).collect()
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

    fn camera(spec: &FrameSpec) -> Result<Camera, DatasetError> {
        let camera = Camera::look_at([4.0, 0.0, 1.0], [0.0; 3], 0.8, 160, 120);
        Ok(Camera { camera_from_world: spec.camera_from_world, ..camera })
    }

    #[test]
    fn cameras_are_off_by_as_many_pixels_and_exposures_change_around_none() {
        let (specs, noise) = (specs(), CaptureNoise { camera: 1.0, exposure: 0.1, seed: 3 });
        let disturbed = Disturbances::of(&specs, noise, camera).unwrap();
        let gains: Vec<f32> = disturbed.cameras.values().map(|(_, gain)| gain - 1.0).collect();
        assert_eq!(gains.len(), 40, "one per camera");
        assert!(gains.iter().sum::<f32>().abs() < 1e-4 && gains.iter().all(|g| g.abs() < 0.15));
        let squares = specs.iter().map(|spec| {
            let camera = camera(spec).unwrap();
            let image = image::RgbaImage::from_pixel(1, 1, image::Rgba([100, 100, 100, 255]));
            let (moved, seen) = disturbed.applied(spec, (camera, Masked { image, mask: None }));
            let gain = disturbed.cameras[&key(spec)].1;
            assert_eq!(seen.image.pixels().next().unwrap().0[0], (100.0 * gain).round() as u8);
            camera.displacement(&moved, 4.1).powi(2)
        });
        let root = (squares.sum::<f64>() / specs.len() as f64).sqrt();
        assert!((root - 1.0).abs() < 0.05, "{root}");
    }

    #[test]
    fn noise_out_of_range_is_refused() {
        for noise in [
            CaptureNoise { camera: -1.0, ..CaptureNoise::default() },
            CaptureNoise { exposure: 1.0, ..CaptureNoise::default() },
            CaptureNoise { camera: f32::NAN, ..CaptureNoise::default() },
        ] {
            assert!(Disturbances::of(&specs(), noise, camera).is_err(), "{noise:?}");
        }
    }
}
