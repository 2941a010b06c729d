//! Models that the authors' DefGS program wrote (method §3.1), read into [`DefGs`].
//!
//! Its output folder holds `point_cloud/iteration_N/point_cloud.ply`, the canonical Gaussians, and
//! `deform/iteration_N/deform.pth`, the deformation network's state dictionary: `timenet.{0,2}` (absent for
//! real scenes), `linear.{0..7}`, and the heads `gaussian_warp`, `gaussian_rotation` and `gaussian_scaling`,
//! which are one layer of ours. Sizes are read from the shapes. `cfg_args` says how it was trained.

mod settings;

pub use settings::OfficialSettings;

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_data::ply::read_ply;
use lgs_data::pth::{PthError, StateDict};
use lgs_nn::encoding::encoded_width;
use lgs_nn::{NamedLayers, ParamRange};

use super::config::{DELTAS, DeformationConfig, HeadInit, MotionHead, ScaleMode};
use super::defgs::DefGs;
use super::error::SourceError;
use super::input::InputFrame;
use super::network::Deformation;

/// A folder's latest model.
#[derive(Clone, Debug)]
pub struct OfficialDefGs {
    /// Gaussians and network.
    pub model: DefGs,
    /// The iteration at which they were written.
    pub iteration: usize,
    /// How the model was trained, if `cfg_args` is there.
    pub settings: Option<OfficialSettings>,
}

/// Parts of an output folder, with what each holds.
const PARTS: [(&str, &str); 2] = [
    ("point_cloud", "the Gaussians, `point_cloud/iteration_N/point_cloud.ply`"),
    ("deform", "the deformation network, `deform/iteration_N/deform.pth`"),
];

/// Heads in the order of a pose row, with their outputs.
const HEADS: [(&str, usize); 3] = [("gaussian_warp", 3), ("gaussian_rotation", 4), ("gaussian_scaling", 3)];

/// Frequencies of the encodings of time and position as published, where there is no time network (method
/// §3.1): the sum of both widths alone does not tell them apart.
const REAL_FREQUENCIES: usize = 10;

/// Whether a folder looks like the output of the DefGS program, whole or not.
#[must_use]
pub fn is_official_defgs(folder: &Path) -> bool {
    PARTS.iter().any(|(part, _)| folder.join(part).is_dir()) || folder.join(settings::FILE).is_file()
}

/// Reads the latest iteration for which there are both Gaussians and network.
///
/// # Errors
/// If there is none, a part or file is absent or can't be read, the network has the six-degrees-of-freedom
/// head, or a tensor is absent or does not fit.
pub fn read_official_defgs(folder: &Path) -> Result<OfficialDefGs, SourceError> {
    for (part, holds) in PARTS {
        if !folder.join(part).is_dir() {
            return Err(SourceError::NoPart { path: folder.to_owned(), part, holds });
        }
    }
    let iteration = latest_iteration(folder)?;
    let file = |part: &str, name: &str| folder.join(part).join(format!("iteration_{iteration}")).join(name);
    let deformation = deformation(&StateDict::open(&file("deform", "deform.pth"))?)?;
    let canonical = read_ply(&file("point_cloud", "point_cloud.ply"))?;
    let settings = OfficialSettings::read(folder)?;
    Ok(OfficialDefGs { model: DefGs { canonical, deformation }, iteration, settings })
}

fn latest_iteration(folder: &Path) -> Result<usize, SourceError> {
    let (gaussians, networks) =
        (iterations(&folder.join("point_cloud"))?, iterations(&folder.join("deform"))?);
    let both = gaussians.iter().filter(|iteration| networks.contains(iteration));
    both.max().copied().ok_or_else(|| SourceError::NoIteration {
        path: folder.to_owned(),
        gaussians: listed(&gaussians),
        networks: listed(&networks),
    })
}

fn listed(iterations: &[usize]) -> String {
    let names: Vec<String> = iterations.iter().map(ToString::to_string).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Numbers N of the folders `iteration_N`.
fn iterations(folder: &PathBuf) -> Result<Vec<usize>, FileError> {
    let failed = |e| FileError::new("read folder", folder, e);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name();
        found.extend(name.to_str().and_then(|name| name.strip_prefix("iteration_")?.parse::<usize>().ok()));
    }
    found.sort_unstable();
    Ok(found)
}

/// The network of a state dictionary.
fn deformation(dict: &StateDict) -> Result<Deformation, PthError> {
    if dict.shape("branch_w.weight").is_some() {
        let found = "`branch_w`, the six-degrees-of-freedom head, which is not read".to_owned();
        return Err(dict.error("gaussian_warp.weight", "the displacement head".to_owned(), found));
    }
    let config = sizes(dict)?;
    config.validate().map_err(|(field, reason)| dict.error(field, "a size in range".to_owned(), reason))?;
    let layout = config.layout();
    let mut params = Vec::with_capacity(layout.len);
    for param in layout.params() {
        params.extend(values(dict, &param)?);
    }
    Ok(Deformation { config, frame: InputFrame::IDENTITY, params })
}

/// Sizes by the shapes of the weights.
fn sizes(dict: &StateDict) -> Result<DeformationConfig, PthError> {
    let [width, inputs] = matrix(dict, "linear.0.weight")?;
    let depth = (0..).take_while(|i| dict.shape(&format!("linear.{i}.weight")).is_some()).count();
    let frequencies = |name: &str, numbers: usize, dimensions: usize| {
        let expected = || format!("inputs for encoded {dimensions}-vectors");
        let found = || dict.error(name, expected(), format!("{numbers} numbers"));
        frequencies_of(numbers, dimensions).ok_or_else(found)
    };
    let (position_frequencies, time_frequencies, time_hidden, time_features) =
        match dict.shape("timenet.0.weight") {
            Some(_) => {
                let [hidden, encoded] = matrix(dict, "timenet.0.weight")?;
                let features = matrix(dict, "timenet.2.weight")?[0];
                let position = frequencies("linear.0.weight", inputs.saturating_sub(features), 3)?;
                (position, frequencies("timenet.0.weight", encoded, 1)?, hidden, features)
            }
            None => {
                let (position, time) = frequencies_of_both(inputs).ok_or_else(|| {
                    let expected = "inputs for an encoded position and time".to_owned();
                    dict.error("linear.0.weight", expected, format!("{inputs} numbers"))
                })?;
                (position, time, DeformationConfig::paper().time_hidden, 0)
            }
        };
    Ok(DeformationConfig {
        depth,
        width,
        skip_layer: depth / 2,
        position_frequencies,
        time_frequencies,
        time_hidden,
        time_features,
        motion_head: MotionHead::Displacement,
        scale_mode: ScaleMode::Additive,
        head_init: HeadInit::Uniform,
        ..DeformationConfig::paper()
    })
}

/// Outputs and inputs of a layer.
fn matrix(dict: &StateDict, name: &str) -> Result<[usize; 2], PthError> {
    let expected = || "a weight [out, in]".to_owned();
    match dict.shape(name) {
        Some(&[outputs, inputs]) => Ok([outputs, inputs]),
        Some(found) => Err(dict.error(name, expected(), format!("shape {found:?}"))),
        None => Err(dict.absent(name, expected())),
    }
}

/// Frequencies of the encoding of vectors that takes so many numbers.
fn frequencies_of(numbers: usize, dimensions: usize) -> Option<usize> {
    let frequencies = (numbers / dimensions).checked_sub(1)? / 2;
    (encoded_width(dimensions, frequencies) == numbers).then_some(frequencies)
}

/// Frequencies of position and time whose encodings together take so many numbers, one of them as published.
fn frequencies_of_both(numbers: usize) -> Option<(usize, usize)> {
    let rest = |dimensions| numbers.checked_sub(encoded_width(dimensions, REAL_FREQUENCIES));
    let with_time = || Some((frequencies_of(rest(1)?, 3)?, REAL_FREQUENCIES));
    let with_position = || Some((REAL_FREQUENCIES, frequencies_of(rest(3)?, 1)?));
    with_time().or_else(with_position)
}

/// The values of one of our parameters; inputs are in the same order: position, time, then the layer before.
fn values(dict: &StateDict, param: &ParamRange) -> Result<Vec<f32>, PthError> {
    let (layer, part) = param.name.rsplit_once('.').unwrap_or((&param.name, ""));
    if layer == "head" {
        debug_assert_eq!(HEADS.iter().map(|(_, outputs)| outputs).sum::<usize>(), DELTAS);
        let head = |&(name, outputs): &(&str, usize)| {
            dict.values(&format!("{name}.{part}"), &[&[outputs], &param.shape[1..]].concat())
        };
        return Ok(HEADS.iter().map(head).collect::<Result<Vec<_>, _>>()?.concat());
    }
    let theirs = match layer {
        // A ReLU without parameters stands between the two.
        "time.0" => "timenet.0".to_owned(),
        "time.1" => "timenet.2".to_owned(),
        other => other.replace("layer.", "linear."),
    };
    dict.values(&format!("{theirs}.{part}"), &param.shape)
}

#[cfg(test)]
mod tests;
