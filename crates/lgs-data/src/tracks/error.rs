//! Defects of files of point tracks.

use crate::ReadError;

/// Point tracks that cannot be read.
pub type TracksError = ReadError<TracksProblem>;

/// A defect of a file of point tracks. Lines and columns are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TracksProblem {
    /// A field of a C3D file, or of the head of a table, is not as it should be.
    #[error("`{field}`: expected {expected}, found {found}")]
    Field {
        /// Name of the field.
        field: String,
        /// The expectation.
        expected: &'static str,
        /// The value in the file.
        found: String,
    },
    /// A C3D file ends before its contents do.
    #[error("C3D {part}: expected {expected} bytes, found {found}")]
    Ends {
        /// What is cut off.
        part: String,
        /// Bytes that it takes.
        expected: u64,
        /// Bytes present.
        found: u64,
    },
    /// A table of no known layout.
    #[error(
        "expected a table of points with a first column `time`, then x, y and z of each point, or an export \
         of Qualisys Track Manager, Vicon Nexus or OptiTrack Motive; found {0}"
    )]
    Layout(String),
    /// A row of a table with too few cells.
    #[error("line {line}: expected {expected} cells, found {found}")]
    Row {
        /// The line.
        line: usize,
        /// Cells of a whole row.
        expected: usize,
        /// Cells of this one.
        found: usize,
    },
    /// A cell of a table that is no number.
    #[error("line {line}, column {column}: expected a finite number, found `{found}`")]
    Cell {
        /// The line.
        line: usize,
        /// The column.
        column: usize,
        /// The text of the cell.
        found: String,
    },
    /// There are no points or no times.
    #[error("expected {0}, found none")]
    Empty(&'static str),
    /// Times that do not ascend.
    #[error("times: expected strictly ascending numbers, found {before} before {after}")]
    NotAscending {
        /// A time.
        before: f64,
        /// The next one.
        after: f64,
    },
    /// No point is left once those with long gaps are left out.
    #[error(
        "expected a point that is seen from t = 0 to t = {end} without a gap of more than {longest}, found \
         none of {points}"
    )]
    NoWholeTrack {
        /// Last time at which any point is seen.
        end: f64,
        /// Longest gap that is filled, units of time.
        longest: f64,
        /// Points in the file.
        points: usize,
    },
}
