//! The D-NeRF ("Blender") layout: every `transforms_<split>.json` of the folder is a split, and its frames
//! name images beside it. A frame needs `file_path` and `transform_matrix`, and a `time` unless no frame of
//! the whole set has one: a still scene, as NeRF's synthetic ones are, whose images are all at time 0.
//! Cameras are taken to be exact, as those of rendered images are, unless `cameras` says otherwise, which
//! `import` writes.

use super::reader::{FormatReader, Label};
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::set::CameraOrigin;
use crate::dataset::transforms::{self, TransformsFile};
use crate::edit::MotionEdit;
use crate::files::FileError;
use serde::Deserialize;
use std::path::{Path, PathBuf};

pub(super) struct Blender;

/// The keys that the file of a split that shows an edit has beside its frames.
#[derive(Deserialize)]
struct EditedSplit {
    edit: MotionEdit,
}

/// The key that says where cameras come from.
#[derive(Deserialize)]
struct WithOrigin {
    #[serde(default)]
    cameras: CameraOrigin,
}

impl Blender {
    /// Whether no frame of any split has a time.
    fn is_still(&self, root: &Path) -> Result<bool, DatasetError> {
        let has_times = |split: &String| {
            Ok(transforms::read::<TransformsFile>(&self.split_file(root, split))?.has_times())
        };
        let found = self.splits(root)?.iter().map(has_times).collect::<Result<Vec<bool>, DatasetError>>()?;
        Ok(!found.contains(&true))
    }
}

impl FormatReader for Blender {
    fn label(&self) -> Label {
        Label { name: "blender", marker: "`transforms_train.json`" }
    }

    fn is_at(&self, root: &Path) -> bool {
        self.splits(root).is_ok_and(|splits| !splits.is_empty())
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let unreadable = |reason| FileError::new("list folder", root, reason);
        let mut names = Vec::new();
        for entry in std::fs::read_dir(root).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            let name = entry.file_name();
            let split = name.to_str().and_then(|n| n.strip_prefix("transforms_")?.strip_suffix(".json"));
            names.extend(split.filter(|_| entry.path().is_file()).map(str::to_owned));
        }
        names.sort();
        Ok(names)
    }

    fn split_file(&self, root: &Path, split: &str) -> PathBuf {
        root.join(format!("transforms_{split}.json"))
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        let path = self.split_file(root, split);
        let mut file = transforms::read::<TransformsFile>(&path)?;
        if !file.has_times() && self.is_still(root)? {
            file.stand_still();
        }
        file.specs(root, &path)
    }

    fn camera_origin(&self, root: &Path) -> Result<CameraOrigin, DatasetError> {
        let path = self.split_file(root, "train");
        if !path.exists() {
            return Ok(CameraOrigin::Exact);
        }
        Ok(transforms::read::<WithOrigin>(&path)?.cameras)
    }

    /// Splits whose names begin with `edit-` have to say which edit they show.
    fn edit(&self, root: &Path, split: &str) -> Result<Option<MotionEdit>, DatasetError> {
        if !split.starts_with("edit-") {
            return Ok(None);
        }
        let path = self.split_file(root, split);
        let file: EditedSplit = transforms::read(&path)?;
        file.edit.check().map_err(|reason| DatasetError::new(&path, Problem::Edit(reason)))?;
        Ok(Some(file.edit))
    }
}
