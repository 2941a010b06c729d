//! RGB to luma and chroma: the matrix of ITU-R BT.709 in its limited range, chroma for every 2 × 2 pixels.

/// Weights of red, green and blue in luma (BT.709).
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Luma `[height][width]` and both chroma planes of half the size, rounded up.
pub(crate) struct Planes {
    pub(crate) luma: Vec<u8>,
    pub(crate) chroma: [Vec<u8>; 2],
    /// Width of a chroma plane.
    pub(crate) chroma_width: usize,
}

/// Planes of 8-bit RGB pixels in rows of `width`.
pub(crate) fn planes(rgb: &[u8], width: usize) -> Planes {
    let pixels: &[[u8; 3]] = rgb.as_chunks().0;
    let height = pixels.len() / width;
    let luma = pixels.iter().map(|&pixel| stored(16.0, 219.0, luma(pixel.map(f32::from)))).collect();
    let chroma_width = width.div_ceil(2);
    let mut chroma = [Vec::new(), Vec::new()];
    for y in 0..height.div_ceil(2) {
        for x in 0..chroma_width {
            let [blue, red] = differences(mean(pixels, width, [2 * x, 2 * y]));
            chroma[0].push(stored(128.0, 224.0, blue));
            chroma[1].push(stored(128.0, 224.0, red));
        }
    }
    Planes { luma, chroma, chroma_width }
}

/// The mean of the 2 × 2 pixels from `at` on; fewer at the edges.
fn mean(pixels: &[[u8; 3]], width: usize, at: [usize; 2]) -> [f32; 3] {
    let height = pixels.len() / width;
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for y in at[1]..(at[1] + 2).min(height) {
        for x in at[0]..(at[0] + 2).min(width) {
            sum = std::array::from_fn(|c| sum[c] + f32::from(pixels[y * width + x][c]));
            count += 1.0;
        }
    }
    sum.map(|channel| channel / count)
}

/// Luma of a pixel, 0 to 255.
fn luma(rgb: [f32; 3]) -> f32 {
    (0..3).map(|c| LUMA[c] * rgb[c]).sum()
}

/// Differences of blue and of red from luma, scaled to ±127.5.
fn differences(rgb: [f32; 3]) -> [f32; 2] {
    let luma = luma(rgb);
    [(rgb[2] - luma) / (2.0 * (1.0 - LUMA[2])), (rgb[0] - luma) / (2.0 * (1.0 - LUMA[0]))]
}

/// A value of 255 parts as it is stored: from `zero` on, over `range`.
fn stored(zero: f32, range: f32, value: f32) -> u8 {
    (zero + range * value / 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_have_the_values_of_the_standard() {
        let of = |rgb: [u8; 3]| {
            let planes = planes(&rgb.repeat(4), 2);
            [planes.luma[0], planes.chroma[0][0], planes.chroma[1][0]]
        };
        assert_eq!(of([0; 3]), [16, 128, 128]);
        assert_eq!(of([255; 3]), [235, 128, 128]);
        assert_eq!(of([255, 0, 0]), [63, 102, 240]);
        assert_eq!(of([0, 0, 255]), [32, 240, 118]);
    }

    #[test]
    fn odd_sizes_have_room_for_their_last_pixels() {
        let planes = planes(&[7; 3 * 5 * 3], 5);
        assert_eq!((planes.luma.len(), planes.chroma[1].len(), planes.chroma_width), (15, 6, 3));
    }
}
