//! Moving Gaussians of a `.splatv` file.

use std::path::Path;

use super::error::{FramesError, FramesProblem};
use super::sequence::FrameSequence;
use crate::splats::splatv::read_splat_video;

/// Steps in which [0, 1] is sampled. The cubics of such a file are followed between samples but for the third
/// power, whose error is below a ten-thousandth of what it does over the whole.
const STEPS: u16 = 60;

/// Samples a file's Gaussians over its time from 0 to 1.
pub(super) fn read(path: &Path) -> Result<FrameSequence, FramesError> {
    let video = read_splat_video(path)?;
    if video.is_empty() {
        return Err(FramesError::new(path, FramesProblem::ComeAndGo(video.left_out)));
    }
    let times: Vec<f32> = (0..=STEPS).map(|step| f32::from(step) / f32::from(STEPS)).collect();
    let clouds = times.iter().map(|&time| video.cloud_at(time));
    let (positions, rotations) = clouds.map(|cloud| (cloud.means, cloud.rotations)).unzip();
    Ok(FrameSequence { gaussians: video.cloud_at(0.0), times, positions, rotations })
}
