//! A file of tensors.

use std::path::Path;

use lgs_core::{GaussianCloud, sh_coefficients};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError, SafeTensors};

use super::error::{FramesError, FramesProblem};
use super::points::gaussians_of;
use super::sequence::{FrameSequence, nearest_to_start};
use crate::files::{FileError, read_bytes, write_atomically};

/// Reads frames from a safetensors file.
pub(super) fn read(path: &Path) -> Result<FrameSequence, FramesError> {
    let bytes = read_bytes(path)?;
    parse(&bytes).map_err(|problem| FramesError::new(path, problem))
}

/// Writes frames as [`read`] wants them.
pub(super) fn write(frames: &FrameSequence, path: &Path) -> Result<(), FileError> {
    let (count, n, cloud) = (frames.times.len(), frames.gaussians.len(), &frames.gaussians);
    let turns = if frames.rotations.len() == 1 { vec![n, 4] } else { vec![count, n, 4] };
    let flat = |rows: &[[f32; 3]]| rows.as_flattened().to_vec();
    let tensors: [(&str, Vec<usize>, Vec<f32>); 6] = [
        ("times", vec![count], frames.times.clone()),
        ("positions", vec![count, n, 3], frames.positions.iter().flat_map(|row| flat(row)).collect()),
        ("rotations", turns, frames.rotations.iter().flatten().flatten().copied().collect()),
        ("log_scales", vec![n, 3], flat(&cloud.log_scales)),
        ("raw_opacities", vec![n], cloud.raw_opacities.clone()),
        ("sh", vec![n, sh_coefficients(cloud.sh_degree), 3], cloud.sh.clone()),
    ];
    let bytes = tensors.map(|(name, shape, values)| {
        (name, shape, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    });
    let views = bytes
        .iter()
        .map(|(name, shape, data)| Ok((*name, TensorView::new(Dtype::F32, shape.clone(), data)?)));
    let unwritable = |e: SafeTensorError| FileError::new("write", path, std::io::Error::other(e));
    let views: Vec<_> = views.collect::<Result<_, _>>().map_err(unwritable)?;
    let file = safetensors::serialize(views, None).map_err(unwritable)?;
    write_atomically(path, |w| w.write_all(&file))
}

fn parse(bytes: &[u8]) -> Result<FrameSequence, FramesProblem> {
    let file = SafeTensors::deserialize(bytes).map_err(|e| FramesProblem::Tensors(e.to_string()))?;
    let file = Tensors { file };
    let (shape, times) = file.values("times", "shape [T]", |shape| shape.len() == 1)?;
    let count = shape[0];
    let (shape, positions) = file.values("positions", &format!("shape [{count}, n, 3]"), |s| {
        s.len() == 3 && s[0] == count && s[2] == 3
    })?;
    let n = shape[1];
    let rows = |values: &[f32]| values.as_chunks::<3>().0.to_vec();
    let positions: Vec<Vec<[f32; 3]>> =
        (0..count).map(|t| rows(&positions[3 * n * t..3 * n * (t + 1)])).collect();
    let start = nearest_to_start(&times);
    let means = positions.get(start).cloned().unwrap_or_default();
    let bare = gaussians_of(means);
    let rotations = match file.is_there("rotations") {
        true => file.rotations(count, n)?,
        false => vec![bare.rotations.clone()],
    };
    let splats = ["log_scales", "raw_opacities", "sh"];
    let mut gaussians = match splats.iter().any(|name| file.is_there(name)) {
        true => file.splats(bare)?,
        false => bare,
    };
    gaussians.rotations = rotations.get(start).or(rotations.first()).cloned().unwrap_or_default();
    Ok(FrameSequence { gaussians, times, positions, rotations })
}

struct Tensors<'a> {
    file: SafeTensors<'a>,
}

impl Tensors<'_> {
    fn is_there(&self, name: &str) -> bool {
        self.file.tensor(name).is_ok()
    }

    /// Rotations of `n` Gaussians at `count` times, or once for all.
    fn rotations(&self, count: usize, n: usize) -> Result<Vec<Vec<[f32; 4]>>, FramesProblem> {
        let fits = |s: &[usize]| s == [n, 4] || s == [count, n, 4];
        let (shape, rotations) =
            self.values("rotations", &format!("shape [{count}, {n}, 4] or [{n}, 4]"), fits)?;
        let turns = rotations.as_chunks::<4>().0;
        Ok(match shape.len() {
            2 => vec![turns.to_vec()],
            _ => turns.chunks_exact(n.max(1)).map(<[_]>::to_vec).collect(),
        })
    }

    /// Gaussians of given places with the scales, opacities and colours of the file.
    fn splats(&self, places: GaussianCloud) -> Result<GaussianCloud, FramesProblem> {
        let n = places.len();
        let (_, log_scales) = self.values("log_scales", &format!("shape [{n}, 3]"), |s| s == [n, 3])?;
        let (_, raw_opacities) = self.values("raw_opacities", &format!("shape [{n}]"), |s| s == [n])?;
        let degree_of = |s: &[usize]| (0..=3).find(|&degree| s == [n, sh_coefficients(degree), 3]);
        let expected = format!("shape [{n}, K, 3] with K of 1, 4, 9 or 16");
        let (shape, sh) = self.values("sh", &expected, |s| degree_of(s).is_some())?;
        Ok(GaussianCloud {
            log_scales: log_scales.as_chunks().0.to_vec(),
            raw_opacities,
            sh,
            sh_degree: degree_of(&shape).unwrap_or_default(),
            ..places
        })
    }

    /// Shape and values of a tensor of finite 32-bit floats whose shape `fits`.
    fn values(
        &self,
        field: &'static str,
        expected: &str,
        fits: impl Fn(&[usize]) -> bool,
    ) -> Result<(Vec<usize>, Vec<f32>), FramesProblem> {
        let wrong = |found: String| FramesProblem::Tensor {
            field,
            expected: format!("32-bit floats of {expected}"),
            found,
        };
        let view = self.file.tensor(field).map_err(|_| wrong("nothing of that name".to_owned()))?;
        if view.dtype() != Dtype::F32 || !fits(view.shape()) {
            return Err(wrong(format!("{:?} of shape {:?}", view.dtype(), view.shape())));
        }
        let values: Vec<f32> =
            view.data().as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok((view.shape().to_vec(), values)),
            Some(at) => Err(wrong(format!("{} at index {at}", values[at]))),
        }
    }
}
