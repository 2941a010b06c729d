//! Cameras of the synthetic scenes, and the rays through their pixels.
//!
//! Object scenes are watched from rings on an upper hemisphere: elevations alternate between three values and
//! azimuths are spread evenly, held-out cameras stand between training ones. The room is watched from an arc
//! along its near wall, inside, so that every pixel is covered.

use super::shape::Ray;
use glam::DVec3;
use lgs_core::stream;
use rand::RngExt;
use std::f64::consts::TAU;

/// Elevations of training cameras over the horizon, radians, by turns.
const TRAINING_ELEVATIONS: [f64; 3] = [0.20, 0.90, 0.50];
/// Elevations of held-out cameras.
const HELD_OUT_ELEVATIONS: [f64; 3] = [0.35, 0.70, 0.45];
/// Held-out cameras of every scene.
pub(super) const HELD_OUT: usize = 3;

/// A square pinhole camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) eye: DVec3,
    right: DVec3,
    down: DVec3,
    forward: DVec3,
    /// Width and height, pixels.
    pub(super) size: usize,
    /// Horizontal field of view, radians.
    pub(super) fov: f64,
    /// Focal length, pixels.
    pub(super) focal: f64,
}

/// The placement of the cameras of a scene.
#[derive(Clone, Copy, Debug)]
pub(super) enum Rig {
    /// Cameras on rings around a target.
    Hemisphere { target: DVec3, distance: f64, fov: f64 },
    /// Cameras on an arc of half-width `reach` at `y`, between two heights.
    Arc { target: DVec3, y: f64, reach: f64, heights: [f64; 2], fov: f64 },
}

impl View {
    pub(super) fn look_at(eye: DVec3, target: DVec3, fov: f64, size: usize) -> Self {
        let forward = (target - eye).normalize();
        let right = forward.cross(DVec3::Z).normalize();
        let focal = 0.5 * size as f64 / (0.5 * fov).tan();
        Self { eye, right, down: forward.cross(right), forward, size, fov, focal }
    }

    /// The ray through a pixel position; its direction has unit depth.
    pub(super) fn ray(&self, x: f64, y: f64) -> Ray {
        let (focal, half) = (self.focal, 0.5 * self.size as f64);
        Ray {
            origin: self.eye,
            direction: self.forward + self.right * ((x - half) / focal) + self.down * ((y - half) / focal),
        }
    }

    /// Whether a point lies inside the image.
    #[cfg(test)]
    pub(super) fn sees(&self, point: DVec3) -> bool {
        let p = point - self.eye;
        let (depth, limit) = (p.dot(self.forward), (0.5 * self.fov).tan());
        depth > 0.0 && p.dot(self.right).abs() <= limit * depth && p.dot(self.down).abs() <= limit * depth
    }

    /// Camera-to-world with OpenGL axes, row by row, as `transforms_*.json` wants it.
    pub(super) fn opengl_pose(&self) -> [[f64; 4]; 4] {
        let row = |i: usize| [self.right[i], -self.down[i], -self.forward[i], self.eye[i]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }
}

impl Rig {
    /// Training views followed by [`HELD_OUT`] held-out ones. The seed turns the rings.
    pub(super) fn views(&self, training: usize, size: usize, seed: u64) -> Vec<View> {
        let turn: f64 = stream(seed, "synthetic cameras", 0).random_range(0.0..1.0);
        (0..training + HELD_OUT).map(|i| self.view(i, training, size, turn)).collect()
    }

    fn view(&self, index: usize, training: usize, size: usize, turn: f64) -> View {
        let held_out = index.checked_sub(training);
        // Position along the ring or arc, in [0, 1): held-out views fall midway between two training ones.
        let along = match held_out {
            None => (index as f64 + 0.25 + 0.5 * turn) / training as f64,
            Some(i) => ((i * training / HELD_OUT) as f64 + 0.75 + 0.5 * turn) / training as f64,
        };
        match *self {
            Self::Hemisphere { target, distance, fov } => {
                let elevation =
                    held_out.map_or(TRAINING_ELEVATIONS[index % 3], |i| HELD_OUT_ELEVATIONS[i % 3]);
                let azimuth = TAU * along;
                let outward = DVec3::new(
                    elevation.cos() * azimuth.cos(),
                    elevation.cos() * azimuth.sin(),
                    elevation.sin(),
                );
                View::look_at(target + distance * outward, target, fov, size)
            }
            Self::Arc { target, y, reach, heights, fov } => {
                let side = 2.0 * along.min(1.0) - 1.0;
                let height = held_out.map_or([0.15, 0.9, 0.5][index % 3], |i| [0.35, 0.7, 0.5][i % 3]);
                let eye = DVec3::new(
                    reach * side,
                    y * (1.0 - 0.25 * side * side),
                    heights[0] + height * (heights[1] - heights[0]),
                );
                View::look_at(eye, target, fov, size)
            }
        }
    }
}
