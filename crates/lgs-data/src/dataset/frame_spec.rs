//! A frame as a format's reader describes it: everything about an image except its pixels.

use super::error::{DatasetError, Problem};
use super::lens::Lens;
use glam::Mat4;
use lgs_core::{Camera, DEFAULT_NEAR, PixelFilter};
use serde::{Deserialize, Deserializer};
use std::path::PathBuf;

/// A number that is given; `null`, which stands for one that is not finite, is no number.
pub(super) fn given<'de, D: Deserializer<'de>>(value: D) -> Result<Option<f64>, D::Error> {
    Ok(Some(Option::deserialize(value)?.unwrap_or(f64::NAN)))
}

/// Intrinsics, each of which a frame or a file may leave out. Lengths are in pixels of the native image.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Intrinsics {
    /// Horizontal field of view, radians.
    #[serde(deserialize_with = "given")]
    pub(super) camera_angle_x: Option<f64>,
    #[serde(deserialize_with = "given")]
    pub(super) fl_x: Option<f64>,
    #[serde(deserialize_with = "given")]
    pub(super) fl_y: Option<f64>,
    #[serde(deserialize_with = "given")]
    pub(super) cx: Option<f64>,
    #[serde(deserialize_with = "given")]
    pub(super) cy: Option<f64>,
    #[serde(deserialize_with = "given")]
    pub(super) w: Option<f64>,
    #[serde(deserialize_with = "given")]
    pub(super) h: Option<f64>,
}

impl Intrinsics {
    /// Focal lengths, principal point and size, pixels.
    pub(super) fn of([fx, fy]: [f64; 2], [cx, cy]: [f64; 2], size: Option<[f64; 2]>) -> Self {
        Self {
            camera_angle_x: None,
            fl_x: Some(fx),
            fl_y: Some(fy),
            cx: Some(cx),
            cy: Some(cy),
            w: size.map(|size| size[0]),
            h: size.map(|size| size[1]),
        }
    }
}

/// What an image of another size than its intrinsics state means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum SizeRule {
    /// A mistake.
    #[default]
    Exact,
    /// The image was made smaller after calibration, and the intrinsics with it.
    Scaled,
}

/// A frame, checked except for what needs the image.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameSpec {
    /// The file that describes the frame, for errors.
    pub(super) described_in: PathBuf,
    /// The frame's place in that file, from 0.
    pub(super) index: usize,
    /// The image's name in the set.
    pub(super) name: String,
    pub(super) image_path: PathBuf,
    /// An image whose black pixels are to be left out, if the set has one for this frame.
    pub(super) mask_path: Option<PathBuf>,
    /// The camera's name, where the set names its cameras.
    pub(super) view: Option<String>,
    /// The captured sequence spans [0, 1).
    pub(super) time: f32,
    /// Camera-from-world with OpenCV axes.
    pub(super) camera_from_world: Mat4,
    /// Intrinsics of the frame itself, which win over `shared`.
    pub(super) own: Intrinsics,
    /// Intrinsics of the file or the camera that the frame belongs to.
    pub(super) shared: Intrinsics,
    /// The lens whose distortion is taken out of the image.
    pub(super) lens: Lens,
    pub(super) size_rule: SizeRule,
}

impl FrameSpec {
    /// The camera, given the size of the decoded image in pixels.
    pub(super) fn camera(&self, width: u32, height: u32) -> Result<Camera, DatasetError> {
        self.checked_camera(width, height).map_err(|problem| DatasetError::new(&self.described_in, problem))
    }

    fn checked_camera(&self, width: u32, height: u32) -> Result<Camera, Problem> {
        let size = [(self.own.w.or(self.shared.w), width), (self.own.h.or(self.shared.h), height)];
        let stated = size.map(|(stated, is)| stated.unwrap_or(f64::from(is)));
        if self.size_rule == SizeRule::Exact {
            self.check_size(stated, [width, height])?;
        }
        for (field, value) in [("w", stated[0]), ("h", stated[1])] {
            self.check_value(field, value, 0.0)?;
        }
        let [fx, fy, cx, cy] = self.pinhole(stated)?;
        for (field, value, least) in [
            ("fl_x", fx, 0.0),
            ("fl_y", fy, 0.0),
            ("cx", cx, f64::NEG_INFINITY),
            ("cy", cy, f64::NEG_INFINITY),
        ] {
            self.check_value(field, f64::from(value as f32), least)?;
        }
        let [sx, sy] = [f64::from(width) / stated[0], f64::from(height) / stated[1]];
        let [fx, fy, cx, cy] = [fx * sx, fy * sy, cx * sx, cy * sy].map(|v| v as f32);
        let (camera_from_world, near) = (self.camera_from_world, DEFAULT_NEAR);
        let filter = PixelFilter::default();
        Ok(Camera { width, height, fx, fy, cx, cy, camera_from_world, near, filter })
    }

    fn check_value(&self, field: &'static str, value: f64, least: f64) -> Result<(), Problem> {
        if value.is_finite() && value > least {
            return Ok(());
        }
        let expected = if least == 0.0 { "finite and above 0" } else { "finite" };
        Err(Problem::Value { frame: self.index, field, expected, found: value.to_string() })
    }

    /// The image must have the size that the intrinsics state.
    fn check_size(&self, stated: [f64; 2], is: [u32; 2]) -> Result<(), Problem> {
        if stated == is.map(f64::from) {
            return Ok(());
        }
        Err(Problem::Size {
            frame: self.index,
            expected: format!("{} x {}", stated[0], stated[1]),
            found: format!("{} x {}", is[0], is[1]),
        })
    }

    /// Focal lengths and principal point `[fx, fy, cx, cy]`, pixels of an image of that size.
    ///
    /// Pixels are square unless the same level says otherwise: a frame's own `fl_x` is not paired with the
    /// file's `fl_y`. The principal point is the image's centre unless given.
    fn pinhole(&self, [width, height]: [f64; 2]) -> Result<[f64; 4], Problem> {
        let from_angle = |angle: f64| 0.5 * width / (0.5 * angle).tan();
        let focal_x = |i: &Intrinsics| i.fl_x.or(i.camera_angle_x.map(from_angle));
        let fx = focal_x(&self.own)
            .or(focal_x(&self.shared))
            .ok_or(Problem::Missing { frame: self.index, field: "fl_x` or `camera_angle_x" })?;
        let fy = self.own.fl_y.or(focal_x(&self.own)).or(self.shared.fl_y).unwrap_or(fx);
        let cx = self.own.cx.or(self.shared.cx).unwrap_or(0.5 * width);
        let cy = self.own.cy.or(self.shared.cy).unwrap_or(0.5 * height);
        Ok([fx, fy, cx, cy])
    }
}
