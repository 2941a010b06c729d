//! The layouts in which image sets come, one file per format.
//!
//! A format is a [`FormatReader`]: it lists the splits of a folder, reads the frames of one split without
//! decoding any image, and reads the points that a set ships. Everything that is the same for all formats is
//! done by [`Dataset::load`](super::Dataset::load): decoding, resizing, numbers of cameras, fingerprint.
//! To add a format, write its file here and give it a variant in [`DatasetFormat`] and an arm in
//! `DatasetFormat::reader`.

mod blender;
mod colmap;
mod csv_times;
mod hold_out;
mod hypernerf;
mod nerfstudio;
mod neu3d;
mod panoptic;
mod reader;
mod rig;
mod views;

use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::set::CameraOrigin;
use crate::edit::MotionEdit;
use crate::ply::Points;
use reader::FormatReader;
use std::path::{Path, PathBuf};

/// A layout of image sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum DatasetFormat {
    /// D-NeRF and Blender sets: `transforms_<split>.json` beside the images.
    Blender,
    /// nerfstudio sets: one `transforms.json`, perspective or fisheye cameras.
    Nerfstudio,
    /// Dynamic 3D Gaussians' layout of captures such as CMU Panoptic's: `train_meta.json`.
    Panoptic,
    /// Nerfies, HyperNeRF and DyCheck: `dataset.json`, `metadata.json`, `camera/`.
    HyperNerf,
    /// Neural 3D Video: `poses_bounds.npy`, `cam00`, `cam01`, …
    Neu3d,
    /// COLMAP's sparse models, text or binary.
    Colmap,
    /// A calibration beside a folder of images or a video for each camera.
    Rig,
}

impl DatasetFormat {
    /// All formats, in the order in which they are looked for.
    pub const ALL: &[Self] = &[
        Self::Blender,
        Self::Nerfstudio,
        Self::Panoptic,
        Self::HyperNerf,
        Self::Neu3d,
        Self::Colmap,
        Self::Rig,
    ];

    fn reader(self) -> &'static dyn FormatReader {
        match self {
            Self::Blender => &blender::Blender,
            Self::Nerfstudio => &nerfstudio::Nerfstudio,
            Self::Panoptic => &panoptic::Panoptic,
            Self::HyperNerf => &hypernerf::HyperNerf,
            Self::Neu3d => &neu3d::Neu3d,
            Self::Colmap => &colmap::Colmap,
            Self::Rig => &rig::Rig,
        }
    }

    /// The format's name on the command line and in configurations.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.reader().label().name
    }

    /// The format of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|format| format.name() == name)
    }

    /// The format of the set in a folder; nothing if the folder holds no set in a known format.
    #[must_use]
    pub fn detect(root: &Path) -> Option<Self> {
        Self::ALL.iter().copied().find(|format| format.reader().is_at(root))
    }

    /// Whether the set in a folder has a split of that name.
    #[must_use]
    pub fn has_split(self, root: &Path, split: &str) -> bool {
        self.reader().splits(root).is_ok_and(|splits| splits.iter().any(|name| name == split))
    }

    /// The format that a folder is read in: the one asked for, or the one detected.
    pub(super) fn of(root: &Path, asked: Option<Self>) -> Result<Self, DatasetError> {
        if !root.is_dir() {
            return Err(DatasetError::new(root, Problem::NoFolder));
        }
        let markers = || Self::ALL.iter().map(|f| format!("{} ({})", f.reader().label().marker, f.name()));
        let unknown =
            || DatasetError::new(root, Problem::NoFormat(markers().collect::<Vec<_>>().join(" or ")));
        asked.or_else(|| Self::detect(root)).ok_or_else(unknown)
    }

    /// The splits to load, `train` first, then by name. Without a wish these are all splits of the folder,
    /// `train` included.
    pub(super) fn splits(self, root: &Path, wanted: Option<&[String]>) -> Result<Vec<String>, DatasetError> {
        let found = self.reader().splits(root)?;
        let mut names = wanted.map_or_else(|| found.clone(), <[String]>::to_vec);
        if wanted.is_none() {
            names.push("train".into());
        }
        names.sort_by_key(|name| (name != "train", name.clone()));
        names.dedup();
        match names.iter().find(|name| !found.contains(name)) {
            Some(absent) => {
                let path = self.split_file(root, absent);
                Err(DatasetError::new(&path, Problem::NoSplit(absent.clone())))
            }
            None => Ok(names),
        }
    }

    /// Every split of the folder, `train` first.
    pub(super) fn all_splits(self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let found = self.reader().splits(root)?;
        self.splits(root, Some(&found))
    }

    pub(super) fn split_file(self, root: &Path, split: &str) -> PathBuf {
        self.reader().split_file(root, split)
    }

    /// All files that say something of a split.
    pub(super) fn sources(self, root: &Path, split: &str) -> Vec<PathBuf> {
        self.reader().sources(root, split)
    }

    pub(super) fn frames(self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        self.reader().frames(root, split)
    }

    /// The edit that a split shows.
    pub(super) fn edit(self, root: &Path, split: &str) -> Result<Option<MotionEdit>, DatasetError> {
        self.reader().edit(root, split)
    }

    /// Where the cameras of the set come from.
    pub(super) fn camera_origin(self, root: &Path) -> Result<CameraOrigin, DatasetError> {
        self.reader().camera_origin(root)
    }

    /// What a user should know of the set although it can be read.
    pub(super) fn remarks(self, root: &Path) -> Result<Vec<String>, DatasetError> {
        self.reader().remarks(root)
    }

    /// The points that the set ships.
    pub(super) fn points(self, root: &Path) -> Result<Option<Points>, DatasetError> {
        self.reader().points(root)
    }
}

/// A format in a configuration: its name, or `auto` where the folder's contents decide.
pub mod format_or_auto {
    use super::DatasetFormat;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    /// Writes the format's name or `auto`.
    ///
    /// # Errors
    /// If the serializer fails.
    pub fn serialize<S: Serializer>(format: &Option<DatasetFormat>, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(format.map_or("auto", DatasetFormat::name))
    }

    /// Reads the format's name or `auto`.
    ///
    /// # Errors
    /// If the value is no string, or names no format.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<DatasetFormat>, D::Error> {
        let name = String::deserialize(from)?;
        match DatasetFormat::named(&name) {
            None if name != "auto" => Err(D::Error::custom(format!("there is no dataset format `{name}`"))),
            found => Ok(found),
        }
    }
}
