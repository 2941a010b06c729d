//! A folder of splat files.

use std::path::Path;

use super::error::{FramesError, FramesProblem};
use super::sequence::{FrameSequence, nearest_to_start};
use super::times;
use crate::files::FileError;
use crate::names::natural_key;
use crate::splats::{SplatFormat, read_splats};

/// Reads all frames of a folder in the order of their times.
pub(super) fn read(folder: &Path) -> Result<FrameSequence, FramesError> {
    let mut frames = times::of_folder(folder, names(folder)?)?;
    frames.sort_by(|a, b| a.1.total_cmp(&b.1));
    let times: Vec<f32> = frames.iter().map(|(_, time)| *time).collect();
    let start = nearest_to_start(&times);
    let mut gaussians = None;
    let (mut positions, mut rotations): (Vec<Vec<[f32; 3]>>, Vec<_>) = (Vec::new(), Vec::new());
    for (index, (name, _)) in frames.iter().enumerate() {
        let path = folder.join(name);
        let mut cloud = read_splats(&path)?;
        if let Some(expected) = positions.first().map(Vec::len).filter(|&expected| expected != cloud.len()) {
            return Err(FramesError::new(&path, FramesProblem::Count { expected, found: cloud.len() }));
        }
        if index == start {
            gaussians = Some(cloud.clone());
        }
        positions.push(std::mem::take(&mut cloud.means));
        rotations.push(std::mem::take(&mut cloud.rotations));
    }
    let gaussians = gaussians.ok_or_else(|| FramesError::new(folder, FramesProblem::NoFrames))?;
    Ok(FrameSequence { gaussians, times, positions, rotations })
}

/// Names of the splat files in a folder, numbers in them counted as numbers, all of one format.
pub(super) fn names(folder: &Path) -> Result<Vec<String>, FramesError> {
    let failed = |e| FileError::new("read folder", folder, e);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.') && SplatFormat::of_name(Path::new(&name)).is_some() {
            names.push(name);
        }
    }
    names.sort_by_cached_key(|name| natural_key(name));
    let format = |name: &String| SplatFormat::of_name(Path::new(name));
    match names.iter().find(|name| format(name) != format(&names[0])) {
        None => Ok(names),
        Some(other) => {
            let problem = FramesProblem::Formats(names[0].clone(), other.clone());
            Err(FramesError::new(folder, problem))
        }
    }
}
