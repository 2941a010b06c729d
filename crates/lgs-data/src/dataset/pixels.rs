//! Decoding and resizing of images.

use super::error::{DatasetError, Problem};
use crate::files::FileError;
use image::{ImageReader, Rgba, Rgba32FImage, RgbaImage, imageops};
use std::path::Path;

/// Decodes an image by its contents; one without alpha becomes opaque.
pub(super) fn decode(path: &Path) -> Result<RgbaImage, DatasetError> {
    let unreadable = |reason| FileError::new("read image", path, reason);
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(unreadable)?;
    let decoded = reader.decode().map_err(|e| DatasetError::new(path, Problem::Image(e)))?;
    Ok(decoded.into_rgba8())
}

/// Bicubic resampling of premultiplied colours, so that the colour of transparent pixels never bleeds into
/// opaque ones.
pub(super) fn resized(image: &RgbaImage, width: u32, height: u32) -> RgbaImage {
    let premultiplied = Rgba32FImage::from_fn(image.width(), image.height(), |x, y| {
        let p = image.get_pixel(x, y).0.map(|v| f32::from(v) / 255.0);
        Rgba([p[0] * p[3], p[1] * p[3], p[2] * p[3], p[3]])
    });
    let small = imageops::resize(&premultiplied, width, height, imageops::FilterType::CatmullRom);
    RgbaImage::from_fn(width, height, |x, y| {
        let p = small.get_pixel(x, y).0;
        let alpha = p[3].clamp(0.0, 1.0);
        let straight = |v: f32| if alpha > 0.0 { v / alpha } else { 0.0 };
        Rgba(
            [straight(p[0]), straight(p[1]), straight(p[2]), alpha]
                .map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8),
        )
    })
}
