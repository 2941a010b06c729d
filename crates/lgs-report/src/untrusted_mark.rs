//! The mark in the corner of a frame that shows a time beyond trust.

use lgs_core::Image;

use crate::style::SOURCE;
use crate::thresholds::{LEAST_MARK, MARK_FRACTION};

/// Draws a small triangle into the upper right corner of a frame.
pub fn mark_untrusted(frame: &mut Image) {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let side = ((MARK_FRACTION * width as f32) as usize).max(LEAST_MARK).min(width).min(height);
    let colour = [SOURCE.0, SOURCE.1, SOURCE.2].map(|c| f32::from(c) / 255.0);
    for row in 0..side {
        let end = (row + 1) * width;
        frame.pixels[end - (side - row)..end].fill(colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mark_fills_a_corner_and_leaves_the_rest() {
        let mut frame = Image::filled(100, 80, [0.5; 3]);
        mark_untrusted(&mut frame);
        let marked = |x: usize, y: usize| frame.pixels[100 * y + x] != [0.5; 3];
        assert!(marked(99, 0) && marked(95, 0) && !marked(90, 0) && !marked(95, 4) && !marked(0, 79));
        let mut tiny = Image::filled(2, 1, [0.5; 3]);
        mark_untrusted(&mut tiny);
    }
}
