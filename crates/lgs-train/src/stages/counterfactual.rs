//! By how much training images would be worse if some of a source's Gaussians moved otherwise than they do.

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, fit_rotation, narrow, nearest_rotation, outer, wide};
use lgs_core::linear::quat_mul;
use lgs_core::{GaussianCloud, Image};
use lgs_data::dataset::Frame;
use lgs_model::source::SourceModel;
use lgs_render::{Splats, mse, rasterize};
use rayon::prelude::*;

use super::initial_pose::mean;
use super::spread::spread_over_time;
use super::thresholds::{OBSERVED_FRAMES, PARTS_OF_FRAMES};

/// Training frames, spread evenly over the window, that tell what is seen to move.
pub(super) struct ComparedFrames<'a> {
    frames: Vec<&'a Frame>,
    /// Colour behind the Gaussians.
    background: [f32; 3],
}

/// A rotation and a shift of points since t = 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidMotion {
    rotation: DQuat,
    shift: DVec3,
}

/// Gaussians that move by rigid motions from where they are at t = 0.
pub(super) struct RigidlyMoved {
    pub(super) members: Vec<usize>,
    /// By frame.
    pub(super) motions: Vec<RigidMotion>,
}

impl RigidMotion {
    /// No motion at all.
    pub(super) const REST: Self = Self { rotation: DQuat::IDENTITY, shift: DVec3::ZERO };

    /// The motion that explains the places of some points now best, given those at t = 0.
    pub(super) fn between(start: &[[f32; 3]], now: &[[f32; 3]]) -> Self {
        let (from, to) = (wide(mean(start)), wide(mean(now)));
        let moment: DMat3 = start.iter().zip(now).map(|(&a, &b)| outer(wide(b) - to, wide(a) - from)).sum();
        let rotation = fit_rotation(&moment).rotation;
        Self { rotation, shift: to - rotation * from }
    }

    /// The motion of a rigid body from one of its poses, rotation and shift of its points, to another one.
    pub(super) fn between_poses(start: &(DMat3, DVec3), now: &(DMat3, DVec3)) -> Self {
        let rotation = DQuat::from_mat3(&nearest_rotation(&(now.0 * start.0.transpose())));
        Self { rotation, shift: now.1 - rotation * start.1 }
    }

    /// Where a point that is at a place at t = 0 is now.
    pub(super) fn applied_to(&self, place: DVec3) -> DVec3 {
        self.rotation * place + self.shift
    }
}

impl<'a> ComparedFrames<'a> {
    pub(super) fn new(frames: &'a [Frame], background: [f32; 3]) -> Self {
        Self { frames: spread_over_time(frames, OBSERVED_FRAMES, [1, 2]), background }
    }

    pub(super) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Times of the frames.
    pub(super) fn times(&self) -> impl Iterator<Item = f32> {
        self.frames.iter().map(|frame| frame.time)
    }

    /// The fractions by which the error of the images rises, each if some Gaussians move otherwise: in that
    /// part of the window where it rises most.
    pub(super) fn rises(&self, source: &dyn SourceModel, otherwise: &[RigidlyMoved]) -> Vec<f64> {
        let start = source.cloud_at(0.0);
        let errors = |(index, frame): (usize, &&Frame)| -> Vec<f64> {
            let (truth, cloud) = (self.truth(frame), source.cloud_at(frame.time));
            let error = |cloud: &GaussianCloud| self.error(frame, &truth, cloud);
            let moved = otherwise.iter().map(|other| error(&other.applied(index, &cloud, &start)));
            std::iter::once(error(&cloud)).chain(moved).collect()
        };
        let errors: Vec<Vec<f64>> = self.frames.par_iter().enumerate().map(errors).collect();
        (1..=otherwise.len()).map(|column| largest_rise(&errors, column)).collect()
    }

    /// The image of a frame, without what its mask leaves out.
    fn truth(&self, frame: &Frame) -> Image {
        let mut truth = frame.composited(self.background);
        frame.leave_out(&mut truth.pixels, self.background);
        truth
    }

    /// Mean squared error of Gaussians in a frame.
    fn error(&self, frame: &Frame, truth: &Image, cloud: &GaussianCloud) -> f64 {
        let drawn = rasterize(&Splats::from(cloud), &frame.camera, self.background);
        let mut own = drawn.to_image();
        frame.exposure.expose(&mut own.pixels, &drawn.transmittance, self.background);
        frame.leave_out(&mut own.pixels, self.background);
        mse(&own, truth)
    }
}

/// The largest of the fractions by which a column exceeds the first one in parts of the rows, which are in
/// order of time: what moves late, or for a moment, is seen to. Where the first column is below its mean over
/// all rows, the excess is a fraction of that.
fn largest_rise(errors: &[Vec<f64>], column: usize) -> f64 {
    let mean = |frames: &[Vec<f64>], column: usize| {
        frames.iter().map(|row| row[column]).sum::<f64>() / frames.len().max(1) as f64
    };
    let usual = mean(errors, 0).max(f64::MIN_POSITIVE);
    let rise = |part: &[Vec<f64>]| (mean(part, column) - mean(part, 0)) / mean(part, 0).max(usual);
    let parts = errors.chunks(errors.len().div_ceil(PARTS_OF_FRAMES).max(1));
    parts.map(rise).reduce(f64::max).unwrap_or(0.0)
}

impl RigidlyMoved {
    /// The Gaussians at the time of a frame, given those of the source then and at t = 0.
    fn applied(&self, index: usize, cloud: &GaussianCloud, start: &GaussianCloud) -> GaussianCloud {
        let mut moved = cloud.clone();
        let motion = self.motions[index];
        let turn = components(motion.rotation).map(|c| c as f32);
        for &i in &self.members {
            moved.means[i] = narrow(motion.applied_to(wide(start.means[i])));
            moved.rotations[i] = quat_mul(turn, start.rotations[i]);
            moved.log_scales[i] = start.log_scales[i];
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_in_a_part_of_the_frames_is_seen_to() {
        let row = |k: usize| vec![1.0, 1.1, if k < 20 { 1.0 } else { 3.0 }, if k == 3 { 2.0 } else { 1.0 }];
        let errors: Vec<Vec<f64>> = (0..24).map(row).collect();
        let rises = [1, 2, 3].map(|column| largest_rise(&errors, column));
        let near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-12;
        assert!(rises.iter().zip([0.1, 4.0 / 3.0, 1.0 / 6.0]).all(near), "{rises:?}");
        // A part that is drawn far better than the others is no reason to call a little more much.
        let errors: Vec<Vec<f64>> = (0..24).map(|k| vec![if k < 6 { 0.01 } else { 1.0 }; 2]).collect();
        let more: Vec<Vec<f64>> = errors.iter().map(|row| vec![row[0], row[1] + 0.01]).collect();
        assert!(largest_rise(&more, 1) < 0.02);
    }
}
