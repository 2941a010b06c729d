//! What settings are resolved from: sizes and numbers of the training images.

use lgs_data::dataset::{CameraOrigin, Dataset, Frame};

/// Sizes and numbers of a dataset's training images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataSummary {
    /// Width and height of the first image, pixels.
    pub size: [u32; 2],
    /// Images.
    pub images: usize,
    /// Distinct cameras.
    pub views: usize,
    /// Distinct times.
    pub times: usize,
    /// Points that the set ships.
    pub points: usize,
    /// Distance of the cameras from what they look at, world units.
    pub viewing_distance: f32,
    /// Where poses come from.
    pub cameras: CameraOrigin,
}

impl DataSummary {
    /// The summary of a dataset; nothing without training images.
    #[must_use]
    pub fn of(dataset: &Dataset) -> Option<Self> {
        let frames = dataset.split("train");
        let camera = frames.first()?.camera;
        Some(Self {
            size: [camera.width, camera.height],
            images: frames.len(),
            views: distinct(frames, |frame| frame.camera_id),
            times: distinct(frames, |frame| frame.time.to_bits() as usize),
            points: dataset.init_points.as_ref().map_or(0, |points| points.positions.len()),
            viewing_distance: dataset.viewing_distance(),
            cameras: dataset.camera_origin,
        })
    }

    /// Pixels of an image.
    #[must_use]
    pub fn pixels(&self) -> f64 {
        f64::from(self.size[0]) * f64::from(self.size[1])
    }

    /// Whether the camera is elsewhere at nearly every image, so that no camera shows what moves before its
    /// surroundings.
    #[must_use]
    pub fn has_jumping_camera(&self) -> bool {
        2 * self.views > self.images
    }
}

#[cfg(test)]
impl DataSummary {
    /// Fifty images, each of a time of its own, by a camera that jumps.
    pub(crate) const JUMPING: Self = Self {
        size: [400, 400],
        images: 50,
        views: 50,
        times: 50,
        points: 0,
        viewing_distance: 4.0,
        cameras: CameraOrigin::Exact,
    };
}

/// Number of different keys.
fn distinct(frames: &[Frame], key: impl Fn(&Frame) -> usize) -> usize {
    frames.iter().map(key).collect::<std::collections::BTreeSet<_>>().len()
}
