//! The split of frames that a set does not split itself.

use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::FrameSpec;
use crate::thresholds::VALIDATION_STEP;
use std::collections::BTreeSet;
use std::path::Path;

/// Whether frame after frame is held out, as `val`. Where cameras have names, every eighth of them is,
/// beginning with the first; otherwise every eighth image is, as is usual for static captures. With fewer
/// than eight nothing is.
fn held_out(specs: &[FrameSpec]) -> Vec<bool> {
    let views: BTreeSet<&str> = specs.iter().filter_map(|spec| spec.view.as_deref()).collect();
    if views.is_empty() {
        let enough = specs.len() >= VALIDATION_STEP;
        return (0..specs.len()).map(|i| enough && i.is_multiple_of(VALIDATION_STEP)).collect();
    }
    let enough = views.len() >= VALIDATION_STEP;
    let chosen: BTreeSet<&str> = views.into_iter().step_by(VALIDATION_STEP).filter(|_| enough).collect();
    specs.iter().map(|spec| spec.view.as_deref().is_some_and(|view| chosen.contains(view))).collect()
}

/// Names of the splits of all frames of a set.
pub(super) fn splits(specs: &[FrameSpec]) -> Vec<String> {
    let held = held_out(specs);
    let names = [("train", false), ("val", true)];
    names.iter().filter(|(_, is)| held.contains(is)).map(|(name, _)| (*name).to_owned()).collect()
}

/// The frames of a split among all of a set.
pub(super) fn of_split(
    specs: Vec<FrameSpec>,
    split: &str,
    path: &Path,
) -> Result<Vec<FrameSpec>, DatasetError> {
    let held = held_out(&specs);
    let wanted = |held: &bool| if *held { split == "val" } else { split == "train" };
    let chosen: Vec<FrameSpec> =
        specs.into_iter().zip(&held).filter(|(_, held)| wanted(held)).map(|(spec, _)| spec).collect();
    if chosen.is_empty() {
        Err(DatasetError::new(path, Problem::NoSplit(split.to_owned())))
    } else {
        Ok(chosen)
    }
}
