//! Polygon files: Gaussian clouds in the INRIA property order and plain coloured point clouds.
//!
//! A Gaussian file has one `vertex` element of 32-bit floats in this order: `x y z nx ny nz f_dc_0..2
//! f_rest_* opacity scale_0..2 rot_0..3`, all raw (method §1). `f_rest` is channel-major: every
//! coefficient of red above the zeroth, then green, then blue, where [`GaussianCloud::sh`] interleaves the
//! channels. The writer produces exactly that; the reader also takes any property order, further properties,
//! doubles, ASCII and big-endian files.

mod error;
mod header;
mod table;

pub use error::{PlyError, PlyProblem};
pub(crate) use header::Scalar;
pub(crate) use table::Table;

use crate::files::{self, destination_of};
use lgs_core::{GaussianCloud, sh_coefficients};
use std::path::Path;

/// Coloured points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Positions, world units.
    pub positions: Vec<[f32; 3]>,
    /// Colours in [0, 1], one per position.
    pub colors: Vec<[f32; 3]>,
}

/// Reads Gaussians of degree 0 to 3.
///
/// # Errors
/// If the file can't be read or its contents are not those of a valid cloud.
pub fn read_ply(path: &Path) -> Result<GaussianCloud, PlyError> {
    let bytes = files::read_bytes(path)?;
    parse_cloud(&bytes).map_err(|problem| PlyError::Content { path: path.to_path_buf(), problem })
}

/// Writes Gaussians in the INRIA layout, binary little endian, whole or not at all.
///
/// # Errors
/// If the cloud is invalid or the file can't be written.
pub fn write_ply(path: &Path, cloud: &GaussianCloud) -> Result<(), PlyError> {
    cloud.validate().map_err(|e| PlyError::Content { path: destination_of(path), problem: e.into() })?;
    let names = gaussian_properties(cloud.sh_degree);
    files::write_atomically(path, |w| {
        write!(w, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", cloud.len())?;
        for name in &names {
            writeln!(w, "property float {name}")?;
        }
        writeln!(w, "end_header")?;
        let mut row = Vec::with_capacity(4 * names.len());
        for index in 0..cloud.len() {
            row.clear();
            push_row(&mut row, cloud, index);
            w.write_all(&row)?;
        }
        Ok(())
    })?;
    Ok(())
}

/// Reads `points3d.ply`: `x y z` and `red green blue` as bytes; anything else is ignored.
///
/// # Errors
/// If the file can't be read or its contents are not such points.
pub fn read_points(path: &Path) -> Result<Points, PlyError> {
    let bytes = files::read_bytes(path)?;
    parse_points(&bytes).map_err(|problem| PlyError::Content { path: path.to_path_buf(), problem })
}

/// Writes coloured points as [`read_points`] reads them, colours rounded to bytes.
///
/// # Errors
/// If the file can't be written.
pub fn write_points(path: &Path, points: &Points) -> Result<(), PlyError> {
    files::write_atomically(path, |w| {
        write!(w, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", points.positions.len())?;
        w.write_all(b"property float x\nproperty float y\nproperty float z\n")?;
        w.write_all(b"property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n")?;
        for (position, color) in points.positions.iter().zip(&points.colors) {
            position.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
            w.write_all(&color.map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8))?;
        }
        Ok(())
    })?;
    Ok(())
}

/// Whether a file's header, as far as it is given, announces packed Gaussians ([`crate::splats`]).
pub(crate) fn is_packed(head: &[u8]) -> bool {
    let holds = |vertex: &header::Element| vertex.properties.iter().any(|p| p.name == "packed_position");
    header::Header::parse(head).is_ok_and(|h| h.elements.iter().any(|e| e.name == "vertex" && holds(e)))
}

/// Property names of a Gaussian file, in file order.
fn gaussian_properties(sh_degree: usize) -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "z", "nx", "ny", "nz"].map(String::from).to_vec();
    names.extend((0..3).map(|i| format!("f_dc_{i}")));
    names.extend((0..3 * (sh_coefficients(sh_degree) - 1)).map(|i| format!("f_rest_{i}")));
    names.push("opacity".into());
    names.extend((0..3).map(|i| format!("scale_{i}")));
    names.extend((0..4).map(|i| format!("rot_{i}")));
    names
}

fn push_row(row: &mut Vec<u8>, cloud: &GaussianCloud, index: usize) {
    let mut push = |v: f32| row.extend_from_slice(&v.to_le_bytes());
    cloud.means[index].into_iter().for_each(&mut push);
    [0.0; 3].into_iter().for_each(&mut push);
    let sh = &cloud.sh[index * cloud.sh_stride()..][..cloud.sh_stride()];
    sh[..3].iter().copied().for_each(&mut push);
    for channel in 0..3 {
        sh[3..].iter().skip(channel).step_by(3).copied().for_each(&mut push);
    }
    push(cloud.raw_opacities[index]);
    cloud.log_scales[index].into_iter().for_each(&mut push);
    cloud.rotations[index].into_iter().for_each(&mut push);
}

fn parse_cloud(bytes: &[u8]) -> Result<GaussianCloud, PlyProblem> {
    let table = Table::of(bytes, "vertex")?;
    let rest = table.names().filter(|name| name.starts_with("f_rest_")).count();
    let sh_degree = match rest {
        0 => 0,
        9 => 1,
        24 => 2,
        45 => 3,
        other => return Err(PlyProblem::Harmonics(other)),
    };
    let higher = sh_coefficients(sh_degree) - 1;
    let mut sh_names: Vec<String> = (0..3).map(|c| format!("f_dc_{c}")).collect();
    sh_names.extend((0..higher).flat_map(|k| (0..3).map(move |c| format!("f_rest_{}", c * higher + k))));
    let sh_names: Vec<&str> = sh_names.iter().map(String::as_str).collect();
    Ok(GaussianCloud {
        means: table.floats(["x", "y", "z"])?,
        rotations: table.floats(["rot_0", "rot_1", "rot_2", "rot_3"])?,
        log_scales: finite_scales(table.floats(["scale_0", "scale_1", "scale_2"])?)?,
        raw_opacities: table.float_rows(&["opacity"])?,
        sh: table.float_rows(&sh_names)?,
        sh_degree,
    })
}

/// Logarithms whose scales are finite.
pub(crate) fn finite_scales(log_scales: Vec<[f32; 3]>) -> Result<Vec<[f32; 3]>, PlyProblem> {
    let values = log_scales.as_flattened();
    match values.iter().position(|value| !value.exp().is_finite()) {
        None => Ok(log_scales),
        Some(at) => {
            let (property, found) = (format!("scale_{}", at % 3), values[at]);
            Err(PlyProblem::Scale { property, index: at / 3, found })
        }
    }
}

fn parse_points(bytes: &[u8]) -> Result<Points, PlyProblem> {
    let table = Table::of(bytes, "vertex")?;
    Ok(Points { positions: table.floats(["x", "y", "z"])?, colors: table.colors(["red", "green", "blue"])? })
}

#[cfg(test)]
mod tests;
