//! Defects of an image set.

use crate::ReadError;

/// An image set that cannot be loaded.
pub type DatasetError = ReadError<Problem>;

/// A defect of an image set. Frames are counted from 0.
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
    /// The file is not JSON.
    #[error("malformed JSON: {0}")]
    Json(serde_json::Error),
    /// The file lists no frames.
    #[error("the split is empty: `frames` has no entries")]
    Empty,
    /// A field is missing.
    #[error("frame {frame}: missing field `{field}`")]
    Missing {
        /// Number of the frame.
        frame: usize,
        /// The key.
        field: &'static str,
    },
    /// A field has a value that can't be.
    #[error("frame {frame}: `{field}` should be {expected}, found {found}")]
    Value {
        /// Number of the frame.
        frame: usize,
        /// The key.
        field: &'static str,
        /// The expectation.
        expected: &'static str,
        /// The value in the file.
        found: String,
    },
    /// The edit that a split shows is none.
    #[error("`edit`: {0}")]
    Edit(String),
    /// An image does not decode.
    #[error("can't decode the image: {0}")]
    Image(image::ImageError),
    /// The frames of a video do not decode.
    #[error("{0}")]
    Video(lgs_video::read::DecodeError),
    /// An image has another size than the intrinsics say.
    #[error("frame {frame}: the intrinsics (`w`, `h`) say {expected}, the image is {found} pixels")]
    Size {
        /// Number of the frame.
        frame: usize,
        /// Width × height that the intrinsics state.
        expected: String,
        /// Width × height of the image.
        found: String,
    },
    /// A mask has another size than its image.
    #[error("the mask should have the size of its image, {expected}, found {found}")]
    MaskSize {
        /// Width × height of the image.
        expected: String,
        /// Width × height of the mask.
        found: String,
    },
    /// Images are listed that are not there.
    #[error("{absent} of {listed} images that are listed are absent, such as {such_as}")]
    Absent {
        /// Number of absent images.
        absent: usize,
        /// Number of all.
        listed: usize,
        /// The first of them.
        such_as: String,
    },
    /// A file of another kind than JSON is malformed.
    #[error("{0}")]
    Malformed(String),
    /// A named part of a file has a value that can't be.
    #[error("{part}: `{field}` should be {expected}, found {found}")]
    Part {
        /// The camera, image or row.
        part: String,
        /// The field.
        field: &'static str,
        /// The expectation.
        expected: String,
        /// The value in the file.
        found: String,
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
