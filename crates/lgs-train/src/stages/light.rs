//! Colours of a scene's Gaussians at the times of frames, which the stages take as the source has learned
//! them.

use lgs_model::LagrangianScene;

use crate::cloud_tensors::{CloudTensors, vector};

/// Gaussians of a scene, given with their rows in it, in the colours of a time.
pub(super) fn lit_at(
    cloud: CloudTensors,
    rows: impl Iterator<Item = usize>,
    (scene, time): (&LagrangianScene, f32),
) -> CloudTensors {
    let Some(shading) = &scene.shading else { return cloud };
    let gains: Vec<f32> = shading.gains(time).collect();
    let gains: Vec<f32> = rows.map(|row| gains[row]).collect();
    let gains = vector(&gains, &cloud.means.device());
    cloud.lit(gains)
}
