//! Rows of an image with five pixels side by side in a vector.
//!
//! A row is cut into five segments of equal length. Cell `j` holds the RGB values of pixel `j` of every segment, 15 floats, and a zero. The
//! neighbour of a pixel is then the same lane of the neighbouring cell, and windows along a row, like those along a column, read whole
//! aligned vectors. Where a segment ends, a margin of cells repeats the beginning of the next one.

use crate::simd::Lanes;
use crate::window::{RADIUS, STEP};

/// Segments of a row, and the floats of a pixel.
const SEGMENTS: usize = 5;
const CHANNELS: usize = 3;

/// How a row of so many pixels lies in cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    width: usize,
    /// Pixels of a segment: the number of cells, margins excepted.
    pub cells: usize,
    /// Leading cells all of whose segments lie in the image.
    whole: usize,
}

impl Layout {
    pub(crate) fn new(width: usize) -> Self {
        let cells = width.div_ceil(SEGMENTS).max(1);
        Self { width, cells, whole: width.saturating_sub((SEGMENTS - 1) * cells) }
    }

    /// Cells of a row between margins, rounded up to whole steps.
    pub(crate) fn pitch(&self) -> usize {
        self.cells.next_multiple_of(STEP) + 2 * RADIUS
    }

    /// One for the floats of a cell that are in the image, zero for the others.
    pub(crate) fn inside(&self, cell: usize) -> Lanes {
        let mut out = Lanes::ZERO;
        for segment in 0..SEGMENTS {
            if cell < self.cells && segment * self.cells + cell < self.width {
                out.0[CHANNELS * segment..][..CHANNELS].fill(1.0);
            }
        }
        out
    }

    /// Zeroes what is not in the image.
    fn clear_outside(&self, cell: usize, lanes: &mut Lanes) {
        let inside = self.inside(cell);
        lanes.0.iter_mut().zip(inside.0).filter(|(_, inside)| *inside == 0.0).for_each(|(lane, _)| *lane = 0.0);
    }
}

/// Cells of a row of several planes.
pub(crate) type Row<const PLANES: usize> = Vec<[Lanes; PLANES]>;

/// Replaces one plane of a row by an interleaved row, or by zeros.
#[inline(always)]
pub(crate) fn read_row<const PLANES: usize>(layout: &Layout, from: Option<&[f32]>, row: &mut Row<PLANES>, plane: usize) {
    let Some(from) = from else {
        for planes in row {
            planes[plane] = Lanes::ZERO;
        }
        return;
    };
    for (segment, pixels) in from.chunks(CHANNELS * layout.cells).enumerate().take(SEGMENTS - 1) {
        // Four floats for three: the fourth is the next segment's.
        for (planes, pixel) in row.iter_mut().zip(pixels.windows(4).step_by(CHANNELS)) {
            planes[plane].0[CHANNELS * segment..][..4].copy_from_slice(pixel);
        }
        let last = pixels.len() / CHANNELS - 1;
        row[last][plane].0[CHANNELS * segment..][..CHANNELS].copy_from_slice(&pixels[CHANNELS * last..]);
    }
    let last = from.chunks(CHANNELS * layout.cells).nth(SEGMENTS - 1).unwrap_or_default();
    for (planes, pixel) in row.iter_mut().zip(last.as_chunks::<CHANNELS>().0) {
        planes[plane].0[CHANNELS * (SEGMENTS - 1)..][..CHANNELS].copy_from_slice(pixel);
    }
    for (cell, planes) in row.iter_mut().enumerate().take(layout.cells).skip(layout.whole) {
        layout.clear_outside(cell, &mut planes[plane]);
    }
}

/// Writes one plane of a row to an interleaved row.
pub(crate) fn write_row<const PLANES: usize>(layout: &Layout, row: &Row<PLANES>, plane: usize, out: &mut [f32]) {
    for (segment, pixels) in out.chunks_mut(CHANNELS * layout.cells).enumerate() {
        let last = pixels.len() / CHANNELS - 1;
        // Four floats for three: the fourth is overwritten by the next pixel.
        for (cell, planes) in row[..last].iter().enumerate() {
            pixels[CHANNELS * cell..][..4].copy_from_slice(&planes[plane].0[CHANNELS * segment..][..4]);
        }
        pixels[CHANNELS * last..].copy_from_slice(&row[last][plane].0[CHANNELS * segment..][..CHANNELS]);
    }
}

/// Fills the margins of a row, whose cell `j` is at `RADIUS + j`: neighbouring segments, zero outside of the image.
#[inline(always)]
pub(crate) fn fill_margins<const PLANES: usize>(row: &mut Row<PLANES>, count: usize) {
    for k in 1..=RADIUS {
        // Where the pixels lie, in cells and in segments to the left; then to the right.
        let segments = k.div_ceil(count);
        let mut left = row[RADIUS + segments * count - k];
        for lanes in &mut left {
            *lanes = moved_up(lanes, segments);
        }
        row[RADIUS - k] = left;
        let (at, segments) = (RADIUS + count + k - 1, (count + k - 1) / count);
        let mut right = row[at - segments * count];
        for lanes in &mut right {
            *lanes = moved_down(lanes, segments);
        }
        row[at] = right;
    }
}

/// Every segment so many places up.
#[inline(always)]
fn moved_up(from: &Lanes, segments: usize) -> Lanes {
    let mut out = *from;
    for _ in 0..segments.min(SEGMENTS) {
        let [a, b, c, d, e, f, g, h, i, j, k, l, _, _, _, _] = out.0;
        out.0 = [0.0, 0.0, 0.0, a, b, c, d, e, f, g, h, i, j, k, l, 0.0];
    }
    out
}

/// Every segment so many places down.
#[inline(always)]
fn moved_down(from: &Lanes, segments: usize) -> Lanes {
    let mut out = *from;
    for _ in 0..segments.min(SEGMENTS) {
        let [_, _, _, d, e, f, g, h, i, j, k, l, m, n, o, _] = out.0;
        out.0 = [d, e, f, g, h, i, j, k, l, m, n, o, 0.0, 0.0, 0.0, 0.0];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::BLOCK;

    #[test]
    fn a_cell_holds_a_pixel_of_every_segment_and_margins_those_next_to_it() {
        for width in [1, 3, 5, 7, 23, 24, 40] {
            let layout = Layout::new(width);
            let pixels: Vec<f32> = (0..3 * width).map(|i| i as f32 + 1.0).collect();
            let mut row: Row<2> = vec![[Lanes([7.0; BLOCK]); 2]; layout.pitch() - 2 * RADIUS];
            row.iter_mut().for_each(|planes| planes[1].0[BLOCK - 1] = 0.0);
            read_row(&layout, Some(&pixels), &mut row, 1);
            let mut out = vec![0.0; 3 * width];
            write_row(&layout, &row, 1, &mut out);
            assert_eq!(out, pixels);

            let mut wide: Row<2> = vec![[Lanes::ZERO; 2]; layout.pitch()];
            wide[RADIUS..RADIUS + layout.cells].copy_from_slice(&row[..layout.cells]);
            fill_margins(&mut wide, layout.cells);
            for (cell, planes) in wide.iter().enumerate().take(layout.cells + 2 * RADIUS) {
                for (lane, &value) in planes[1].0.iter().enumerate() {
                    let pixel = (lane / CHANNELS * layout.cells + cell) as isize - RADIUS as isize;
                    let inside = lane < SEGMENTS * CHANNELS && (0..width as isize).contains(&pixel);
                    let expected = if inside { (3 * pixel + (lane % CHANNELS) as isize + 1) as f32 } else { 0.0 };
                    assert_eq!(value, expected, "width {width}, cell {cell}, lane {lane}");
                }
            }
        }
    }
}
