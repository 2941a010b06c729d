//! An image set in memory.

use super::pixels;
use crate::edit::MotionEdit;
use crate::ply::Points;
use image::RgbaImage;
use lgs_core::{Camera, Image};
use std::collections::BTreeMap;
use std::path::PathBuf;

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
    /// Colour behind transparent pixels.
    pub background: [f32; 3],
    /// The points that the set ships, such as `points3d.ply`.
    pub init_points: Option<Points>,
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
    /// Pixels `[h, w, 4]`, straight alpha.
    pub rgba: Vec<u8>,
}

impl Dataset {
    /// A dataset without images, for work that needs none: it holds only the colour behind the Gaussians.
    #[must_use]
    pub fn none(background: [f32; 3]) -> Self {
        Self {
            root: PathBuf::new(),
            splits: BTreeMap::new(),
            edits: BTreeMap::new(),
            background,
            init_points: None,
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
    /// The image over a background, floats in [0, 1].
    #[must_use]
    pub fn composited(&self, background: [f32; 3]) -> Image {
        let over = |p: &[u8; 4]| {
            let alpha = f32::from(p[3]) / 255.0;
            std::array::from_fn(|c| f32::from(p[c]) / 255.0 * alpha + background[c] * (1.0 - alpha))
        };
        let pixels = self.rgba.as_chunks().0.iter().map(over).collect();
        Image { width: self.camera.width, height: self.camera.height, pixels }
    }

    /// The same at another width, pixels, with its aspect kept.
    #[must_use]
    pub fn resized(&self, width: u32) -> Self {
        let Camera { width: own_width, height: own_height, .. } = self.camera;
        let height = (f64::from(own_height) * f64::from(width) / f64::from(own_width)).round().max(1.0);
        let camera = self.camera.resized(width, height as u32);
        let image = RgbaImage::from_raw(own_width, own_height, self.rgba.clone()).unwrap_or_default();
        let rgba = pixels::resized(&image, width, height as u32).into_raw();
        Self { name: self.name.clone(), camera_id: self.camera_id, camera, time: self.time, rgba }
    }

    /// Opacity of every pixel, in [0, 1].
    #[must_use]
    pub fn alpha(&self) -> Vec<f32> {
        self.rgba.as_chunks::<4>().0.iter().map(|p| f32::from(p[3]) / 255.0).collect()
    }

    /// Whether any pixel is not fully opaque.
    #[must_use]
    pub fn has_alpha(&self) -> bool {
        self.rgba.as_chunks::<4>().0.iter().any(|p| p[3] < 255)
    }
}
