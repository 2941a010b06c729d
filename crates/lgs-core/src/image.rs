//! A float RGB image, row by row.

/// An RGB image in [0, 1], display-referred, row-major from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width · height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// An image of one colour.
    #[must_use]
    pub fn filled(width: u32, height: u32, rgb: [f32; 3]) -> Self {
        Self { width, height, pixels: vec![rgb; width as usize * height as usize] }
    }

    /// Bytes of an 8-bit RGB image, rounded to nearest and clamped.
    #[must_use]
    pub fn to_rgb8(&self) -> Vec<u8> {
        self.pixels.as_flattened().iter().map(|&v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect()
    }

    /// The image as it reads back from an 8-bit file.
    #[must_use]
    pub fn quantized(&self) -> Self {
        let pixels = self.pixels.iter().map(|p| p.map(|v| ((v.clamp(0.0, 1.0) * 255.0 + 0.5).floor()) / 255.0)).collect();
        Self { pixels, ..*self }
    }
}
