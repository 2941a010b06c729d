//! An image set in memory.

use super::pixels::Masked;
use super::store::{Picture, Pixels};
use crate::edit::MotionEdit;
use crate::ply::Points;
use lgs_core::{Camera, Exposure, Image};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Where the cameras of a set come from, which says how far they can be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CameraOrigin {
    /// Images were rendered: poses are exact, and all cameras are exposed alike.
    #[default]
    Exact,
    /// A rig that was calibrated by itself: its cameras see light each in its own way.
    Calibrated,
    /// Poses were found from the images themselves, to about a pixel.
    Estimated,
}

/// Cameras, times and images of a scene.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// The folder.
    pub root: PathBuf,
    /// Frames by split, in file order; `train` is always among them unless [`super::LoadOptions::splits`]
    /// says otherwise.
    pub splits: BTreeMap<String, Vec<Frame>>,
    /// The edits that some splits show: the same start under other physics. Such splits are not of the motion
    /// that the others show.
    pub edits: BTreeMap<String, MotionEdit>,
    /// Where poses and intrinsics come from.
    pub camera_origin: CameraOrigin,
    /// Colour behind transparent pixels.
    pub background: [f32; 3],
    /// The points that the set ships, such as `points3d.ply`.
    pub init_points: Option<Points>,
    /// Images that the set lists and that are absent, left out of `splits`.
    pub absent: Vec<PathBuf>,
    /// What a user should know of the set although it could be read, one sentence each.
    pub remarks: Vec<String>,
    /// A hash of the whole set, independent of the options it is loaded with: 16 hexadecimal digits.
    pub fingerprint: String,
}

/// An image with its camera and time.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The image's path in the set, without `./`.
    pub name: String,
    /// Frames of the same pose and intrinsics share this number; training cameras come first.
    pub camera_id: usize,
    /// Pose and intrinsics, at the loaded resolution.
    pub camera: Camera,
    /// Time, as in the file; the captured sequence spans [0, 1).
    pub time: f32,
    /// What the camera makes of the scene's colours; nothing, unless it was found by training.
    pub exposure: Exposure,
    /// The image, in memory or on the disk.
    pub pixels: Pixels,
}

impl Dataset {
    /// A dataset without images, for work that needs none: it holds only the colour behind the Gaussians.
    #[must_use]
    pub fn none(background: [f32; 3]) -> Self {
        Self {
            root: PathBuf::new(),
            splits: BTreeMap::new(),
            edits: BTreeMap::new(),
            camera_origin: CameraOrigin::default(),
            background,
            init_points: None,
            absent: Vec::new(),
            remarks: Vec::new(),
            fingerprint: "none".to_owned(),
        }
    }

    /// The frames of a split; empty if the set has no such split.
    #[must_use]
    pub fn split(&self, name: &str) -> &[Frame] {
        self.splits.get(name).map_or(&[], Vec::as_slice)
    }

    /// Whether all training images show the scene at one time, so that they tell of no motion; not without
    /// images.
    #[must_use]
    pub fn is_still(&self) -> bool {
        let frames = self.split("train");
        !frames.is_empty() && frames.iter().all(|frame| frame.time == frames[0].time)
    }

    /// One frame of every camera of a split, in order of first appearance.
    #[must_use]
    pub fn cameras(&self, split: &str) -> Vec<&Frame> {
        let mut found: Vec<&Frame> = Vec::new();
        for frame in self.split(split) {
            if !found.iter().any(|other| other.camera_id == frame.camera_id) {
                found.push(frame);
            }
        }
        found
    }
}

impl Frame {
    /// The decoded image and its mask.
    #[must_use]
    pub fn picture(&self) -> Arc<Picture> {
        self.pixels.picture()
    }

    /// The image over a background, floats in [0, 1].
    #[must_use]
    pub fn composited(&self, background: [f32; 3]) -> Image {
        let over = |p: &[u8; 4]| {
            let alpha = f32::from(p[3]) / 255.0;
            std::array::from_fn(|c| f32::from(p[c]) / 255.0 * alpha + background[c] * (1.0 - alpha))
        };
        let pixels = self.picture().rgba.as_chunks().0.iter().map(over).collect();
        Image { width: self.camera.width, height: self.camera.height, pixels }
    }

    /// The same at another width, pixels, with its aspect kept.
    #[must_use]
    pub fn resized(&self, width: u32) -> Self {
        let Camera { width: own_width, height: own_height, .. } = self.camera;
        let height = (f64::from(own_height) * f64::from(width) / f64::from(own_width)).round().max(1.0);
        let camera = self.camera.resized(width, height as u32);
        let picture = Masked::of(&self.picture(), own_width, own_height).resized(width, height as u32);
        let (name, pixels) = (self.name.clone(), Pixels::of(picture.into_picture()));
        let Self { camera_id, time, exposure, .. } = *self;
        Self { name, camera_id, camera, time, exposure, pixels }
    }

    /// Opacity of every pixel, in [0, 1].
    #[must_use]
    pub fn alpha(&self) -> Vec<f32> {
        self.picture().rgba.as_chunks::<4>().0.iter().map(|p| f32::from(p[3]) / 255.0).collect()
    }

    /// Whether any pixel is not fully opaque.
    #[must_use]
    pub fn has_alpha(&self) -> bool {
        self.pixels.has_alpha()
    }

    /// The weight of every pixel in losses and scores: 1, or 0 where a mask leaves it out. Nothing without a
    /// mask: every pixel counts.
    #[must_use]
    pub fn weights(&self) -> Option<Vec<f32>> {
        let weight = |&m: &u8| f32::from(u8::from(m > 0));
        self.pixels.has_mask().then(|| self.picture().mask.iter().flatten().map(weight).collect())
    }

    /// Paints an image's pixels `[h · w]` in one colour where a mask leaves them out, so that the image and
    /// another one painted likewise do not differ there.
    pub fn leave_out(&self, pixels: &mut [[f32; 3]], colour: [f32; 3]) {
        if self.pixels.has_mask() {
            let picture = self.picture();
            let masked = pixels.iter_mut().zip(picture.mask.iter().flatten()).filter(|(_, m)| **m == 0);
            masked.for_each(|(pixel, _)| *pixel = colour);
        }
    }
}
