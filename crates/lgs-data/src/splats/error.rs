//! Defects of splat files.

use lgs_core::CloudError;

use crate::ReadError;

/// A splat file that cannot be read or written.
pub type SplatError = ReadError<SplatProblem>;

/// A defect of a `.splat` or `.spz` file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SplatProblem {
    /// Of no known format.
    #[error("expected a splat file: .ply, .compressed.ply, .splat or .spz")]
    Format,
    /// A `.splat` file that does not consist of whole Gaussians.
    #[error("expected 32 bytes for each Gaussian, found {0} bytes")]
    Length(usize),
    /// The header promises more or fewer bytes than there are.
    #[error("expected {expected} bytes for {count} Gaussians, found {found}")]
    Count {
        /// Gaussians announced.
        count: u64,
        /// Bytes that they take.
        expected: u64,
        /// Bytes present; a lower bound where there are too many.
        found: u64,
    },
    /// The file ends before its contents do.
    #[error("expected {expected} bytes, found {found}")]
    Ends {
        /// Bytes that the contents take.
        expected: u64,
        /// Bytes present.
        found: u64,
    },
    /// A field of the header has a value that is not read.
    #[error("`{field}`: expected {expected}, found {found}")]
    Header {
        /// The field.
        field: &'static str,
        /// The expectation.
        expected: &'static str,
        /// The value.
        found: String,
    },
    /// A value of a Gaussian is impossible.
    #[error("`{field}` of Gaussian {index}: expected {expected}, found {found}")]
    Value {
        /// The field.
        field: &'static str,
        /// The Gaussian.
        index: usize,
        /// The expectation.
        expected: &'static str,
        /// The value.
        found: f32,
    },
    /// The compressed data are damaged.
    #[error("can't decompress: {0}")]
    Damaged(String),
    /// The cloud to be written is invalid.
    #[error("the Gaussians can't be written: {0}")]
    Cloud(#[from] CloudError),
}
