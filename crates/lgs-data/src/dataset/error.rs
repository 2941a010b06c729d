//! What can be wrong with an image set.

use crate::files::FileError;
use crate::ply::PlyError;
use std::path::{Path, PathBuf};

/// An image set that can't be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// A file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// `points3d.ply` is wrong.
    #[error(transparent)]
    Points(#[from] PlyError),
    /// The contents of a file are wrong.
    #[error("{problem}: {}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong with it.
        problem: Problem,
    },
}

impl DatasetError {
    pub(super) fn new(path: &Path, problem: Problem) -> Self {
        Self::Content { path: path.to_path_buf(), problem }
    }
}

/// What is wrong with the contents of an image set. Frames are counted from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// There is no folder.
    #[error("expected a dataset folder, found no folder")]
    NoFolder,
    /// The folder holds no set in a known format.
    #[error("expected a dataset, found none of {0}")]
    NoFormat(String),
    /// The folder lacks a split.
    #[error("the dataset has no split `{0}`: found no file")]
    NoSplit(String),
    /// Not JSON.
    #[error("malformed JSON: {0}")]
    Json(serde_json::Error),
    /// The file lists no frames.
    #[error("the split is empty: `frames` has no entries")]
    Empty,
    /// A field is missing.
    #[error("frame {frame}: missing field `{field}`")]
    Missing {
        /// Which frame.
        frame: usize,
        /// The key.
        field: &'static str,
    },
    /// A field has a value that can't be.
    #[error("frame {frame}: `{field}` should be {expected}, found {found}")]
    Value {
        /// Which frame.
        frame: usize,
        /// The key.
        field: &'static str,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// An image does not decode.
    #[error("can't decode the image: {0}")]
    Image(image::ImageError),
    /// An image has another size than the intrinsics say.
    #[error("frame {frame}: the intrinsics (`w`, `h`) say {expected}, the image is {found} pixels")]
    Size {
        /// Which frame.
        frame: usize,
        /// Width × height of the intrinsics.
        expected: String,
        /// Width × height of the image.
        found: String,
    },
    /// A frame has a mask, which training and evaluation would not heed.
    #[error("frame {frame}: `mask_path` should be absent, because masked pixels cannot be left out yet")]
    Mask {
        /// Which frame.
        frame: usize,
    },
    /// No frame is early enough.
    #[error("the split has no frame with a time below {limit}: its first is at {first}")]
    NothingBefore {
        /// The limit asked for.
        limit: f32,
        /// The earliest time.
        first: f32,
    },
    /// A resolution of zero was asked for.
    #[error("the resolution should be a width of at least 1 pixel, found 0")]
    Resolution,
}
