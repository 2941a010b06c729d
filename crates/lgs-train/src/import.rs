//! A source model from elsewhere in the place of a trained one.

use std::path::Path;

use lgs_data::dataset::Dataset;
use lgs_model::source::{SourceModel, import_source};

use crate::config::TrainConfig;
use crate::error::TrainError;
use crate::thresholds::FEWEST_TIMES;

/// Reads the source model that the configuration names, and checks that stage 1 can work on it with or
/// without training images to go on with.
///
/// # Errors
/// If it cannot be read, is of another kind than configured, does not cover t = 0, or neither it nor a
/// dataset says where the captured window ends, or has too few times to tell an acceleration from noise.
pub fn imported_source(config: &TrainConfig, dataset: &Dataset) -> Result<Box<dyn SourceModel>, TrainError> {
    let path = Path::new(&config.source.import);
    let source = import_source(path)?;
    let limit = config.data.train_before;
    let source = if limit > 0.0 { source.before(limit).unwrap_or(source) } else { source };
    let unfit = |expected: &str, found: String| {
        Err(TrainError::Import { path: path.to_owned(), expected: expected.to_owned(), found })
    };
    let (kind, dt) = (config.source.kind, config.motion.dt);
    if let Some(times) = source.known_times().filter(|times| times.len() < FEWEST_TIMES) {
        return unfit(&format!("at least {FEWEST_TIMES} times"), format!("{} times", times.len()));
    }
    if source.kind() != kind {
        return unfit(&format!("a source `{}`", kind.name()), format!("one of `{}`", source.kind().name()));
    }
    match source.time_range() {
        Some([first, _]) if first > 0.5 * dt => {
            unfit("frames from t = 0 on", format!("the first at t = {first}"))
        }
        Some([_, last]) if last < dt => unfit("frames after t = 0", format!("the last at t = {last}")),
        None if dataset.split("train").is_empty() => {
            unfit("a dataset to say where the captured window ends", "neither images nor frames".to_owned())
        }
        _ => Ok(source),
    }
}
