//! The search for displacements of bodies at the times of the frames: rounds of observation of all times
//! at once and, where these do not come to it, from one time to the next.

use lgs_core::{GaussianCloud, psnr_of_mse};
use lgs_data::dataset::Frame;
use rayon::prelude::*;

use super::displacement::Pose;
use super::image_displacement::Found;
use super::image_poses::{ImagePoses, Part};
use super::observation::{Changes, Normal, Observation, observe};
use super::thresholds::{CORRELATED_VALUES, FEWEST_ROUNDS, LOST_POSES, MOST_ROUNDS, PROGRESS};

/// Displacements of some bodies from the motion of a scene, by body and time. Where that is too far off for
/// the images to correct it, they start from the displacements of the time before.
pub(super) fn displacements(poses: &ImagePoses<'_>, bodies: &[Part], frames: &[&Frame]) -> Vec<Vec<Found>> {
    let time_of = frames.iter().map(|frame| poses.time_of(frame)).collect();
    let search = Search { poses, bodies, frames, time_of, clouds: poses.clouds() };
    let mut found = vec![vec![Found::STILL; search.clouds.len()]; bodies.len()];
    let errors = search.refine(&mut found);
    if search.follow(&mut found, errors) {
        search.refine(&mut found);
    }
    found
}

/// What a search looks at.
struct Search<'a> {
    poses: &'a ImagePoses<'a>,
    bodies: &'a [Part],
    frames: &'a [&'a Frame],
    /// Index of each frame's time.
    time_of: Vec<usize>,
    /// The Gaussians by the scene's motion, by time.
    clouds: Vec<GaussianCloud>,
}

/// The frames of a time, or of all, with the bodies where they are supposed to be.
struct Observed {
    /// Index of a frame and what it shows.
    frames: Vec<(usize, Observation)>,
    /// Mean squared error of all values of the images.
    mse: f64,
}

impl Search<'_> {
    /// Refines displacements, by body and time, in rounds of all times. Returns the mean squared error of the
    /// images of each time, as the last round has seen them.
    fn refine(&self, found: &mut [Vec<Found>]) -> Vec<f64> {
        let times = 0..self.clouds.len();
        let (all, mut latest, mut errors) = (Vec::from_iter(0..self.frames.len()), f64::INFINITY, Vec::new());
        for round in 0..MOST_ROUNDS {
            let poses: Vec<Vec<Pose>> = times.clone().map(|at| self.poses_at(found, at)).collect();
            let observed = self.observed(&all, &poses, found);
            tracing::debug!(psnr = psnr_of_mse(observed.mse), "poses from images");
            errors = times.clone().map(|at| self.error_at(&observed, at)).collect();
            if round >= FEWEST_ROUNDS && observed.mse > (1.0 - PROGRESS) * latest {
                break;
            }
            latest = observed.mse;
            for at in times.clone() {
                self.step(found, &observed, (&poses[at], at), observed.mse);
            }
        }
        errors
    }

    /// Goes from one time to the next, given the mean squared errors of the images by time: where that is
    /// much larger than at the time before, the displacements of that are taken over, refined, and kept if
    /// the images become better. Returns whether any were.
    fn follow(&self, found: &mut [Vec<Found>], mut errors: Vec<f64>) -> bool {
        let mut has_followed = false;
        for at in 1..errors.len() {
            let before = errors[at - 1];
            if errors[at] <= LOST_POSES * before || !errors[at].is_finite() || !before.is_finite() {
                continue;
            }
            let mut tried = found.to_vec();
            tried.iter_mut().for_each(|times| times[at] = times[at - 1]);
            let own: Vec<usize> = (0..self.frames.len()).filter(|&i| self.time_of[i] == at).collect();
            let (error, better) = self.refined_at(tried, (&own, at), before);
            tracing::debug!(at, lost = errors[at], error, "poses from those of the time before");
            if error < errors[at] {
                errors[at] = error;
                found.iter_mut().zip(better).for_each(|(times, better)| times[at] = better[at]);
                has_followed = true;
            }
        }
        has_followed
    }

    /// The best of displacements that are refined at one time, given its frames, and their mean squared
    /// error; `noise` is that which is left of images of right poses.
    fn refined_at(
        &self,
        mut found: Vec<Vec<Found>>,
        (own, at): (&[usize], usize),
        noise: f64,
    ) -> (f64, Vec<Vec<Found>>) {
        let mut best = (f64::INFINITY, found.clone());
        for _ in 0..MOST_ROUNDS {
            let of_time = |time| if time == at { self.poses_at(&found, at) } else { Vec::new() };
            let poses: Vec<Vec<Pose>> = (0..self.clouds.len()).map(of_time).collect();
            let observed = self.observed(own, &poses, &found);
            let is_progress = observed.mse < (1.0 - PROGRESS) * best.0;
            if observed.mse < best.0 {
                best = (observed.mse, found.clone());
            }
            if !is_progress {
                break;
            }
            self.step(&mut found, &observed, (&poses[at], at), noise);
        }
        best
    }

    /// What some frames show of bodies at given poses, by time.
    fn observed(&self, frames: &[usize], poses: &[Vec<Pose>], found: &[Vec<Found>]) -> Observed {
        let mut moved: Vec<Option<GaussianCloud>> = vec![None; self.clouds.len()];
        for &frame in frames {
            let at = self.time_of[frame];
            moved[at].get_or_insert_with(|| self.poses.moved(&self.clouds[at], self.bodies, (found, at)));
        }
        let observed = |&index: &usize| {
            let at = self.time_of[index];
            let cloud = moved[at].as_ref()?;
            let background = self.poses.background();
            let seen = observe(self.frames[index], cloud, &poses[at], background, Changes::Derivatives);
            Some((index, seen))
        };
        let observed: Vec<(usize, Observation)> = frames.par_iter().filter_map(observed).collect();
        let mse = self.mean_error(observed.iter());
        Observed { frames: observed, mse }
    }

    /// Mean squared error of all values of some observed frames.
    fn mean_error<'o>(&self, observed: impl Iterator<Item = &'o (usize, Observation)>) -> f64 {
        let (squared, values) = observed.fold((0.0, 0.0), |(squared, values), (index, seen)| {
            (squared + seen.squared_error, values + 3.0 * self.frames[*index].pixels.counted() as f64)
        });
        squared / values
    }

    fn error_at(&self, observed: &Observed, at: usize) -> f64 {
        self.mean_error(observed.frames.iter().filter(|(index, _)| self.time_of[*index] == at))
    }

    /// One step of the displacements at a time, from bodies at given poses.
    fn step(&self, found: &mut [Vec<Found>], observed: &Observed, (poses, at): (&[Pose], usize), mse: f64) {
        for (body, found) in found.iter_mut().enumerate() {
            let own = observed.frames.iter().filter(|(index, _)| self.time_of[*index] == at);
            let normals: Vec<&Normal> = own.map(|(_, seen)| &seen.normals[body]).collect();
            found[at].refine(&normals, &poses[body], 1.0 / (CORRELATED_VALUES * mse));
        }
    }

    fn poses_at(&self, found: &[Vec<Found>], at: usize) -> Vec<Pose> {
        self.poses.poses(self.bodies, &self.clouds[at], (found, at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use lgs_core::geometry::{narrow, rotation_by, wide};
    use lgs_core::{Camera, Exposure};
    use lgs_data::dataset::Pixels;
    use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
    use lgs_mechanics::{Law, bands};
    use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, MotionConfig, ObjectModel, Recording};
    use lgs_render::{Splats, rasterize};

    const BACKGROUND: [f32; 3] = [1.0; 3];
    /// Angle by which the body turns from one time to the next, radians.
    const TURN: f64 = 0.12;

    /// Gaussians of many colours in a flat box about the origin.
    fn body() -> GaussianCloud {
        let place = |i: usize| {
            [0.2 * (i % 3) as f32 - 0.2, 0.15 * (i / 9) as f32 - 0.08, 0.2 * (i / 3 % 3) as f32 - 0.2]
        };
        let mut cloud = GaussianCloud::isotropic((0..18).map(place).collect(), 0.08, [0.5; 3], 0.9);
        cloud.sh.iter_mut().enumerate().for_each(|(i, color)| *color = ((i * 37) % 11) as f32 / 5.0 - 1.0);
        cloud
    }

    /// A scene that takes the body to be at rest.
    fn at_rest(cloud: GaussianCloud) -> LagrangianScene {
        let (means, turns) = (cloud.means.clone(), vec![[1.0, 0.0, 0.0, 0.0]; cloud.len()]);
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.05).expect("a law");
        let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
        let known = bands::Known::default();
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
        let recording =
            Recording::new(vec![0.0, 1.0], vec![means.clone(), means], vec![turns.clone(), turns]);
        let motion = MotionConfig { dt: 0.05, time_window: 1.0 };
        LagrangianScene {
            velocities: vec![[0.0; 3]; cloud.len()],
            objects: vec![ObjectModel {
                members: 0..cloud.len(),
                dynamics: Dynamics::Generalised(dynamics),
                recording,
            }],
            dynamic_gaussians: cloud,
            ..LagrangianScene::still(GaussianCloud::default(), motion, BACKGROUND)
        }
    }

    fn turned(cloud: &GaussianCloud, by: &DMat3) -> GaussianCloud {
        let means = cloud.means.iter().map(|&mean| narrow(*by * wide(mean))).collect();
        GaussianCloud { means, ..cloud.clone() }
    }

    #[test]
    fn a_body_is_followed_from_time_to_time_where_the_motion_is_far_off() {
        let (cloud, times) = (body(), Vec::from_iter((0..14_u8).map(|i| f32::from(i) / 14.0)));
        let rotation = |at: usize| rotation_by(DVec3::Z * TURN * at as f64);
        let seen = |(at, eye): (usize, [f32; 3])| {
            let camera = Camera::look_at(eye, [0.0; 3], 0.5, 48, 48);
            let drawn =
                rasterize(&Splats::from(&turned(&cloud, &rotation(at))), &camera, BACKGROUND).to_image();
            let byte = |v: f32| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
            let rgba: Vec<u8> =
                drawn.pixels.iter().flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
            let (name, exposure) = (String::new(), Exposure::IDENTITY);
            Frame { name, camera_id: 0, camera, time: times[at], exposure, pixels: Pixels::from(rgba) }
        };
        let eyes = [[0.3, -0.4, 2.5], [2.0, 0.3, 1.2]];
        let frames = (0..times.len()).flat_map(|at| eyes.map(|eye| seen((at, eye))));
        let frames: Vec<Frame> = frames.collect();
        let scene = at_rest(cloud.clone());
        let poses = ImagePoses::new(&scene, &times);
        let part = Part { rows: 0..cloud.len(), deforms: false };
        let found = displacements(&poses, &[part], &Vec::from_iter(&frames));
        for (at, found) in found[0].iter().enumerate() {
            let off = (found.linear - rotation(at)).abs_diff_eq(DMat3::ZERO, 0.02);
            assert!(off && found.shift.length() < 0.01, "{at}: {} {}", found.linear, found.shift);
        }
    }
}
