//! A folder of splat files.

use std::path::Path;

use super::error::{FramesError, FramesProblem};
use super::sequence::{FrameSequence, nearest_to_start};
use super::times;
use crate::files::FileError;
use crate::ply::read_ply;

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
        let mut cloud = read_ply(&path)?;
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

/// Names of the splat files in a folder, numbers in them counted as numbers.
fn names(folder: &Path) -> Result<Vec<String>, FramesError> {
    let failed = |e| FileError::new("read folder", folder, e);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.')
            && Path::new(&name).extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"))
        {
            names.push(name);
        }
    }
    names.sort_by_cached_key(|name| natural_key(name));
    Ok(names)
}

/// Text and numbers of a name in turn, so that `frame2` comes before `frame10`.
fn natural_key(name: &str) -> Vec<(String, u64)> {
    let mut key = vec![(String::new(), 0_u64)];
    let mut in_number = false;
    for letter in name.chars() {
        let digit = letter.to_digit(10);
        if in_number && digit.is_none() {
            key.push((String::new(), 0));
        }
        in_number = digit.is_some();
        if let Some((text, number)) = key.last_mut() {
            match digit {
                Some(digit) => *number = number.saturating_mul(10).saturating_add(u64::from(digit)),
                None => text.push(letter),
            }
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = vec!["f10.ply", "f9.ply", "f2b.ply", "f2a.ply", "e100.ply"];
        names.sort_by_cached_key(|name| natural_key(name));
        assert_eq!(names, ["e100.ply", "f2a.ply", "f2b.ply", "f9.ply", "f10.ply"]);
    }
}
