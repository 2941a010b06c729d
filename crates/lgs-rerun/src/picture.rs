//! An image as a recording holds it.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lgs_core::Image;

/// An image as PNG with eight bits per channel, the same that `render` writes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Picture {
    pub(crate) png: Vec<u8>,
}

impl Picture {
    /// Encodes an image; one without pixels is an empty picture.
    #[must_use]
    pub fn of(image: &Image) -> Self {
        let mut png = Vec::new();
        let encoder = PngEncoder::new(&mut png);
        let done = encoder.write_image(&image.to_rgb8(), image.width, image.height, ExtendedColorType::Rgb8);
        Self { png: if done.is_ok() { png } else { Vec::new() } }
    }
}
