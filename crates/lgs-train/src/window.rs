//! What the times of the training images allow: whether there is motion to learn, and in which window.

use lgs_data::dataset::Dataset;
use lgs_distill::FEWEST_SAMPLES;
use lgs_model::source::SourceModel;

use crate::config::TrainConfig;
use crate::error::TrainError;

/// Whether the source is trained from the images of a still scene, which show no motion.
#[must_use]
pub fn learns_no_motion(dataset: &Dataset, config: &TrainConfig) -> bool {
    dataset.is_still() && config.source.import.is_empty()
}

/// Checks that the times of the training images span enough for stage 1, which can be known before anything
/// is trained.
///
/// # Errors
/// If the images end too early; not for a still scene, nor without images.
pub fn check_window(dataset: &Dataset, config: &TrainConfig) -> Result<(), TrainError> {
    let times = dataset.split("train").iter().map(|frame| frame.time);
    let Some(last) = times.reduce(f32::max).filter(|_| !learns_no_motion(dataset, config)) else {
        return Ok(());
    };
    let (dt, least) = (config.motion.dt, (FEWEST_SAMPLES - 1) as f32 * config.motion.dt);
    // Half a step less still rounds to that many samples.
    if last > least - 0.5 * dt {
        return Ok(());
    }
    Err(TrainError::ShortWindow { path: dataset.root.clone(), last, least })
}

/// End of the captured window: the last training time, or the end of what the source knows if that is
/// earlier; at least a step of `dt`.
pub(crate) fn end_of_window(dataset: &Dataset, source: &dyn SourceModel, dt: f32) -> f32 {
    let images = dataset.split("train").iter().map(|f| f.time).reduce(f32::max);
    let known = source.time_range().map(|[_, last]| last);
    let window = images.into_iter().chain(known).fold(f32::INFINITY, f32::min);
    if window.is_finite() { window.max(dt) } else { dt }
}
