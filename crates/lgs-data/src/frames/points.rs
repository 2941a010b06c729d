//! Gaussians for points that come without any.

use std::path::Path;

use lgs_core::{GaussianCloud, mean_squared_neighbor_distance, median};

use super::error::FramesError;
use super::sequence::{FrameSequence, nearest_to_start};
use crate::thresholds::{POINT_OPACITY, POINT_SIZE};
use crate::tracks::read_tracks;

/// Colour of points that have none: a light grey that shows on white and on black.
const GREY: [f32; 3] = [0.6; 3];

/// Round grey Gaussians of one size, a quarter of the median distance between neighbours; one of a lone point
/// has a hundredth of a unit.
pub(super) fn gaussians_of(points: Vec<[f32; 3]>) -> GaussianCloud {
    let squares = mean_squared_neighbor_distance(&points, 1);
    let distance = median(squares.into_iter().map(|square| f64::from(square).sqrt())).unwrap_or(0.0) as f32;
    let lone = 0.01 / POINT_SIZE;
    let size = POINT_SIZE * if distance > 0.0 { distance } else { lone };
    GaussianCloud::isotropic(points, size, GREY, POINT_OPACITY)
}

/// Reads point tracks as frames.
pub(super) fn read(path: &Path) -> Result<FrameSequence, FramesError> {
    let tracks = read_tracks(path)?;
    let whole = tracks.whole().map_err(|problem| FramesError::new(path, problem.into()))?;
    let times: Vec<f32> = whole.times.iter().map(|&time| time as f32).collect();
    let gaussians = gaussians_of(whole.positions[nearest_to_start(&times)].clone());
    Ok(FrameSequence {
        rotations: vec![gaussians.rotations.clone()],
        gaussians,
        times,
        positions: whole.positions,
    })
}
