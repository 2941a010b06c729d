//! Defects of polygon files.

use crate::files::FileError;
use lgs_core::CloudError;
use std::path::{Path, PathBuf};

/// A polygon file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlyError {
    /// The file can't be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The contents are not what they should be.
    #[error("{problem}: {}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The defect.
        problem: PlyProblem,
    },
}

impl PlyError {
    /// The file that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::File(error) => error.path(),
            Self::Content { path, .. } => path,
        }
    }
}

/// A defect of a polygon file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlyProblem {
    /// The header breaks the format.
    #[error("ply header, line {line}: expected {expected}, found `{found}`")]
    Header {
        /// Line, from 1.
        line: usize,
        /// The expectation.
        expected: &'static str,
        /// The text in the file.
        found: String,
    },
    /// There is no element of a name.
    #[error("the ply header has no element `{0}`")]
    NoElement(&'static str),
    /// A property is missing.
    #[error("the ply element `{element}` has no property `{property}`")]
    Missing {
        /// The element.
        element: &'static str,
        /// The property.
        property: String,
    },
    /// A property is stored as another type.
    #[error("ply property `{property}`: expected {expected}, found {found}")]
    Type {
        /// The property.
        property: String,
        /// Types that would do.
        expected: &'static str,
        /// The type in the file.
        found: String,
    },
    /// The number of `f_rest` properties fits no degree.
    #[error("ply properties `f_rest_*`: expected 0, 9, 24 or 45 of them, found {0}")]
    Harmonics(usize),
    /// The header promises more or fewer rows than the file holds.
    #[error("ply element `{element}`: expected {expected} {unit} for {count} rows, found {found}")]
    Count {
        /// The element.
        element: &'static str,
        /// Rows announced.
        count: u64,
        /// Bytes or values that they take.
        expected: u64,
        /// Bytes or values present.
        found: u64,
        /// `bytes` or `values`.
        unit: &'static str,
    },
    /// Elements whose numbers of rows do not fit together.
    #[error("ply element `{element}`: expected {expected} rows, found {found}")]
    Rows {
        /// The element.
        element: &'static str,
        /// Rows that fit the vertices.
        expected: usize,
        /// Rows announced.
        found: usize,
    },
    /// A value of an ASCII file that is no number.
    #[error("ply property `{property}` of {element} {index}: expected a number, found `{found}`")]
    Number {
        /// The element.
        element: &'static str,
        /// The property.
        property: String,
        /// The row.
        index: usize,
        /// The text.
        found: String,
    },
    /// A NaN or an infinity.
    #[error("ply property `{property}` of {element} {index} is not finite: found {found}")]
    NonFinite {
        /// The element.
        element: &'static str,
        /// The property.
        property: String,
        /// The row.
        index: usize,
        /// The value.
        found: f32,
    },
    /// A logarithm of a scale that is no logarithm of a finite number.
    #[error(
        "ply property `{property}` of vertex {index}: expected the logarithm of a finite scale, found {found}"
    )]
    Scale {
        /// The property.
        property: String,
        /// The row.
        index: usize,
        /// The value.
        found: f32,
    },
    /// The cloud to be written is invalid.
    #[error("the Gaussians can't be written: {0}")]
    Cloud(#[from] CloudError),
}
