//! A float RGB image, row by row.

use crate::thresholds::LEAST_MSE;

/// Peak signal-to-noise ratio, dB, of a mean squared error of values in [0, 1]; 100 dB for equal images.
#[must_use]
pub fn psnr_of_mse(mse: f64) -> f64 {
    -10.0 * mse.max(LEAST_MSE).log10()
}

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

    /// Means of blocks of `factor`² pixels; rows and columns that fill no block are left out.
    /// [`crate::Camera::reduced`] fits to it.
    #[must_use]
    pub fn reduced(&self, factor: u32) -> Self {
        let side = factor as usize;
        let (width, height) = (self.width / factor, self.height / factor);
        let part = 1.0 / (side * side) as f32;
        let mean = |i: usize| {
            let (x, y) = (side * (i % width as usize), side * (i / width as usize));
            let rows = (y..y + side).map(|row| &self.pixels[row * self.width as usize + x..][..side]);
            rows.flatten().fold([0.0; 3], |sum: [f32; 3], p| std::array::from_fn(|c| sum[c] + part * p[c]))
        };
        Self { width, height, pixels: (0..width as usize * height as usize).map(mean).collect() }
    }

    /// The nearest pixels of the image at another size.
    #[must_use]
    pub fn resampled(&self, width: u32, height: u32) -> Self {
        let at = |i: u32, from: u32, to: u32| (u64::from(i) * u64::from(from) / u64::from(to)) as usize;
        let row = |y: u32| {
            let start = at(y, self.height, height) * self.width as usize;
            (0..width).map(move |x| self.pixels[start + at(x, self.width, width)])
        };
        Self { width, height, pixels: (0..height).flat_map(row).collect() }
    }

    /// Bytes of an 8-bit RGB image, rounded to nearest and clamped.
    #[must_use]
    pub fn to_rgb8(&self) -> Vec<u8> {
        self.pixels.as_flattened().iter().map(|&v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect()
    }

    /// The image as it reads back from an 8-bit file.
    #[must_use]
    pub fn quantized(&self) -> Self {
        let pixels = self
            .pixels
            .iter()
            .map(|p| p.map(|v| ((v.clamp(0.0, 1.0) * 255.0 + 0.5).floor()) / 255.0))
            .collect();
        Self { pixels, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;

    #[test]
    fn a_reduced_image_holds_means_and_its_camera_sees_them_in_place() {
        let pixels = (0..15).map(|i| [i as f32, 1.0, 0.0]).collect();
        let small = Image { width: 5, height: 3, pixels }.reduced(2);
        assert_eq!((small.width, small.height), (2, 1));
        assert_eq!(small.pixels, [[3.0, 1.0, 0.0], [5.0, 1.0, 0.0]]);
        let camera = Camera::look_at([3.0, 0.0, 1.0], [0.0; 3], 0.8, 101, 67);
        let (pixel, _) = camera.pixel_from_world([0.2, 0.3, 0.1]);
        let (reduced, _) = camera.reduced(2).pixel_from_world([0.2, 0.3, 0.1]);
        assert!((0..2).all(|i| (2.0 * reduced[i] - pixel[i]).abs() < 1e-3), "{pixel:?} {reduced:?}");
    }
}
