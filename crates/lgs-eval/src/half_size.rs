//! Images of half the size, as the published scripts score scenes of single objects (method §7).

use lgs_core::Image;

use crate::thresholds::LEAST_OVERLAP;

/// An image of half the width and height, rounded down, by area averaging: 2 × 2 pixels each where the size
/// is even.
#[must_use]
pub fn halved(image: &Image) -> Image {
    let size = [image.width as usize, image.height as usize];
    let pixels = halved_pixels(&image.pixels, size);
    let [width, height] = size.map(half);
    Image { width: width as u32, height: height as u32, pixels }
}

/// The same for `[height · width]` pixels of any number of channels.
#[must_use]
pub fn halved_pixels<const C: usize>(pixels: &[[f32; C]], [width, height]: [usize; 2]) -> Vec<[f32; C]> {
    assert_eq!(pixels.len(), width * height, "size of the image");
    let (columns, rows) = (shares(width), shares(height));
    let mut out = Vec::with_capacity(columns.len() * rows.len());
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0_f64; C];
            for &(y, share_y) in row {
                for &(x, share_x) in column {
                    let pixel = &pixels[y * width + x];
                    (0..C).for_each(|c| sum[c] += share_y * share_x * f64::from(pixel[c]));
                }
            }
            out.push(sum.map(|v| v as f32));
        }
    }
    out
}

fn half(side: usize) -> usize {
    (side / 2).max(1)
}

/// For every pixel of the smaller side, the pixels of the larger one under it and their shares, which sum to
/// one.
fn shares(side: usize) -> Vec<Vec<(usize, f64)>> {
    let count = half(side);
    let span = side as f64 / count as f64;
    let covered = |i: usize| {
        let (from, to) = (i as f64 * span, (i + 1) as f64 * span);
        let overlap = |x: usize| ((x + 1) as f64).min(to) - (x as f64).max(from);
        (from as usize..side)
            .map(|x| (x, overlap(x) / span))
            .take_while(|&(_, share)| share > LEAST_OVERLAP)
            .collect()
    };
    (0..count).map(covered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_sizes_average_two_by_two_pixels() {
        let image = Image { width: 4, height: 2, pixels: (0..8).map(|i| [i as f32, 0.0, 1.0]).collect() };
        let small = halved(&image);
        assert_eq!((small.width, small.height), (2, 1));
        assert_eq!(small.pixels, [[2.5, 0.0, 1.0], [4.5, 0.0, 1.0]]);
    }

    #[test]
    fn odd_sizes_share_the_pixels_between_and_keep_the_mean() {
        let small = halved_pixels(&[[3.0], [1.0], [2.0], [6.0], [8.0]], [5, 1]);
        assert_eq!(small, [[(3.0 + 1.0 + 0.5 * 2.0) / 2.5], [(0.5 * 2.0 + 6.0 + 8.0) / 2.5]]);
        assert_eq!(halved_pixels(&[[7.0]], [1, 1]), [[7.0]]);
    }
}
