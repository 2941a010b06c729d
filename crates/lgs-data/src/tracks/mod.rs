//! Points followed over time, as motion capture exports them.
//!
//! [`read_tracks`] takes C3D files of any processor, and tables as text: those of Qualisys Track Manager
//! (TSV), Vicon Nexus and OptiTrack Motive (CSV), and a plain `time,x1,y1,z1,x2,…` with or without a line of
//! names. A point that is not seen at a time is a gap there; [`PointTracks::whole`] fills short gaps and
//! leaves points with long ones out.

mod c3d;
mod error;
mod gaps;
mod recording;
mod table;

pub use error::{TracksError, TracksProblem};
pub use gaps::WholeTracks;
pub use recording::{LengthUnit, PointTracks};

use std::path::Path;

use crate::files::read_bytes;

/// Whether a file is one of point tracks, by the end of its name.
#[must_use]
pub fn is_track_file(path: &Path) -> bool {
    ["c3d", "csv", "tsv"].iter().any(|end| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(end)))
}

/// Reads all points of a file of motion capture, gaps included; times begin at 0.
///
/// # Errors
/// If the file can't be read, is of no known layout, ends early, has a cell that is no number, or its times
/// do not ascend. The error names the file, and the line or field.
pub fn read_tracks(path: &Path) -> Result<PointTracks, TracksError> {
    let bytes = read_bytes(path)?;
    let is_c3d = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("c3d"));
    let read = if is_c3d { c3d::parse(&bytes) } else { table::parse(&bytes) };
    read.and_then(PointTracks::checked).map_err(|problem| TracksError::new(path, problem))
}

#[cfg(test)]
mod tests;
