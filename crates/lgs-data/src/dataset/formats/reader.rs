//! The interface of a format.

use crate::dataset::error::DatasetError;
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::set::CameraOrigin;
use crate::edit::MotionEdit;
use crate::ply::{self, Points};
use std::path::{Path, PathBuf};

/// What users read of a format.
pub(in crate::dataset) struct Label {
    /// Name on the command line and in configurations, lower case.
    pub(in crate::dataset) name: &'static str,
    /// The file by which the format is known, for messages.
    pub(in crate::dataset) marker: &'static str,
}

/// The reader of one format. All paths are those of files in the folder `root`.
pub(in crate::dataset) trait FormatReader: Sync {
    /// The format's name, and the file by which it is known.
    fn label(&self) -> Label;

    /// Whether the folder holds a set in this format.
    fn is_at(&self, root: &Path) -> bool;

    /// Names of all splits in the folder; `train` need not be among them.
    ///
    /// # Errors
    /// If what lists the splits cannot be read.
    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError>;

    /// The file that describes a split, or that would describe it if the split existed. Errors
    /// name it.
    fn split_file(&self, root: &Path, split: &str) -> PathBuf;

    /// The frames of a split in file order: images, times, cameras, masks. Several frames may share a time.
    ///
    /// # Errors
    /// If a file is unreadable or malformed, or a frame lacks a value or has one that cannot be; an empty
    /// split is an error too.
    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError>;

    /// The edit that a split shows, where its images are of the same start under other physics. Default:
    /// no split shows one.
    ///
    /// # Errors
    /// If what says so is unreadable or malformed.
    fn edit(&self, root: &Path, split: &str) -> Result<Option<MotionEdit>, DatasetError> {
        let _ = (root, split);
        Ok(None)
    }

    /// All files that say something of a split: the set's fingerprint covers them. Default: the split's file.
    fn sources(&self, root: &Path, split: &str) -> Vec<PathBuf> {
        vec![self.split_file(root, split)]
    }

    /// What a user should know of the set although it can be read, such as images without a camera, one
    /// sentence each. Default: nothing.
    ///
    /// # Errors
    /// If a file is unreadable or malformed.
    fn remarks(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let _ = root;
        Ok(Vec::new())
    }

    /// Where poses and intrinsics come from. Default: from the images themselves, as structure from motion
    /// finds them.
    ///
    /// # Errors
    /// If what says so is unreadable or malformed.
    fn camera_origin(&self, root: &Path) -> Result<CameraOrigin, DatasetError> {
        let _ = root;
        Ok(CameraOrigin::Estimated)
    }

    /// The points that the set ships. Default: those of `points3d.ply`, if there is one.
    ///
    /// # Errors
    /// If the file, or what names it, cannot be read.
    fn points(&self, root: &Path) -> Result<Option<Points>, DatasetError> {
        points_of(Some(root.join("points3d.ply")).filter(|path| path.exists()))
    }
}

/// The points of a polygon file, if there is one.
pub(super) fn points_of(path: Option<PathBuf>) -> Result<Option<Points>, DatasetError> {
    Ok(path.map(|path| ply::read_points(&path)).transpose()?)
}
