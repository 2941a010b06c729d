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
    /// There is no element `vertex`.
    #[error("the ply header has no element `vertex`")]
    NoVertices,
    /// A property is missing.
    #[error("the ply vertices have no property `{0}`")]
    Missing(String),
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
    /// The header promises more or fewer vertices than the file holds.
    #[error("ply element `vertex`: expected {expected} {unit} for {count} vertices, found {found}")]
    Count {
        /// Vertices announced.
        count: u64,
        /// Bytes or values that they take.
        expected: u128,
        /// Bytes or values present.
        found: u64,
        /// `bytes` or `values`.
        unit: &'static str,
    },
    /// A value of an ASCII file that is no number.
    #[error("ply property `{property}` of vertex {index}: expected a number, found `{found}`")]
    Number {
        /// The property.
        property: String,
        /// The vertex.
        index: usize,
        /// The text.
        found: String,
    },
    /// A NaN or an infinity.
    #[error("ply property `{property}` of vertex {index} is not finite: found {found}")]
    NonFinite {
        /// The property.
        property: String,
        /// The vertex.
        index: usize,
        /// The value.
        found: f32,
    },
    /// The cloud to be written is invalid.
    #[error("the Gaussians can't be written: {0}")]
    Cloud(#[from] CloudError),
}
