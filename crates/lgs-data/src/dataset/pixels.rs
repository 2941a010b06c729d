//! Decoding and resizing of images and their masks.

use super::error::{DatasetError, Problem};
use super::store::Picture;
use crate::files::FileError;
use crate::thresholds::MASK_TOLERANCE;
use image::{
    DynamicImage, GrayImage, ImageBuffer, ImageReader, Luma, Rgba, Rgba32FImage, RgbaImage, imageops,
};
use std::path::Path;

/// An image, and where it says nothing: mask pixels are 0 there and 255 elsewhere.
pub(super) struct Masked {
    pub(super) image: RgbaImage,
    pub(super) mask: Option<GrayImage>,
}

/// Decodes an image by its contents; one without alpha becomes opaque.
pub(super) fn decode(path: &Path) -> Result<RgbaImage, DatasetError> {
    Ok(decoded(path)?.into_rgba8())
}

/// Decodes a mask of an image of a size; black pixels are to be left out.
pub(super) fn decode_mask(path: &Path, (width, height): (u32, u32)) -> Result<GrayImage, DatasetError> {
    let mut mask = decoded(path)?.into_luma8();
    if mask.dimensions() != (width, height) {
        let found = format!("{} x {}", mask.width(), mask.height());
        let expected = format!("{width} x {height}");
        return Err(DatasetError::new(path, Problem::MaskSize { expected, found }));
    }
    mask.pixels_mut().for_each(|p| p.0 = [if p.0 == [0] { 0 } else { 255 }]);
    Ok(mask)
}

fn decoded(path: &Path) -> Result<DynamicImage, DatasetError> {
    let unreadable = |reason| FileError::new("read image", path, reason);
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(unreadable)?;
    reader.decode().map_err(|e| DatasetError::new(path, Problem::Image(e)))
}

/// Colours times opacity, and opacity, in [0, 1].
pub(super) fn premultiplied(image: &RgbaImage) -> Rgba32FImage {
    Rgba32FImage::from_fn(image.width(), image.height(), |x, y| {
        let p = image.get_pixel(x, y).0.map(|v| f32::from(v) / 255.0);
        Rgba([p[0] * p[3], p[1] * p[3], p[2] * p[3], p[3]])
    })
}

/// The straight bytes of a premultiplied pixel.
pub(super) fn straight(p: [f32; 4]) -> [u8; 4] {
    let alpha = p[3].clamp(0.0, 1.0);
    let colour = |v: f32| if alpha > 0.0 { v / alpha } else { 0.0 };
    [colour(p[0]), colour(p[1]), colour(p[2]), alpha].map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// Bicubic resampling of premultiplied colours, so that the colour of transparent pixels never bleeds into
/// opaque ones.
fn resized(image: &RgbaImage, width: u32, height: u32) -> RgbaImage {
    let small = imageops::resize(&premultiplied(image), width, height, imageops::FilterType::CatmullRom);
    RgbaImage::from_fn(width, height, |x, y| Rgba(straight(small.get_pixel(x, y).0)))
}

/// A resized pixel counts if nothing that was left out had a part in it, negative parts of the cubic
/// included: levels are ones that overshoot without being clamped.
fn resized_mask(mask: &GrayImage, width: u32, height: u32) -> GrayImage {
    const LEVELS: [f32; 2] = [0.25, 0.5];
    let levels = ImageBuffer::<Luma<f32>, Vec<f32>>::from_fn(mask.width(), mask.height(), |x, y| {
        Luma([LEVELS[usize::from(mask.get_pixel(x, y).0[0] > 0)]])
    });
    let small = imageops::resize(&levels, width, height, imageops::FilterType::CatmullRom);
    let whole = |v: f32| (v - LEVELS[1]).abs() <= MASK_TOLERANCE * (LEVELS[1] - LEVELS[0]);
    GrayImage::from_fn(width, height, |x, y| Luma([if whole(small.get_pixel(x, y).0[0]) { 255 } else { 0 }]))
}

impl Masked {
    /// A decoded image of a size.
    pub(super) fn of(picture: &Picture, width: u32, height: u32) -> Self {
        let mask = picture.mask.clone().and_then(|mask| GrayImage::from_raw(width, height, mask));
        Self { image: RgbaImage::from_raw(width, height, picture.rgba.clone()).unwrap_or_default(), mask }
    }

    /// Both at another size.
    pub(super) fn resized(&self, width: u32, height: u32) -> Self {
        Self {
            image: resized(&self.image, width, height),
            mask: self.mask.as_ref().map(|mask| resized_mask(mask, width, height)),
        }
    }

    /// Whether the mask leaves a pixel out.
    pub(super) fn has_left_out(&self) -> bool {
        self.mask.as_ref().is_some_and(|mask| mask.pixels().any(|p| p.0 == [0]))
    }

    /// The bytes; a mask that leaves nothing out is none.
    pub(super) fn into_picture(self) -> Picture {
        let mask = self.mask.map(GrayImage::into_raw).filter(|mask| mask.contains(&0));
        Picture { rgba: self.image.into_raw(), mask }
    }
}
