//! Rows of an image with sixteen pixels side by side in a vector.
//!
//! A row is cut into sixteen segments of equal length. A cell holds a float of every segment: a channel of a pixel. The neighbour of a pixel is then the
//! same lane of a neighbouring cell, and windows along a row, like those along a column, read whole aligned vectors. Where segments end, a margin of cells
//! repeats the beginning of the next ones.

use crate::simd::{BLOCK, Lanes, V};
use crate::window::{RADIUS, ROW_STEP};
use pulp::Simd;
use std::ops::Range;

/// Segments of a row.
pub(crate) const SEGMENTS: usize = BLOCK;
/// Floats of a pixel.
pub(crate) const CHANNELS: usize = 3;

/// How a row of so many pixels lies in cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    width: usize,
    /// Pixels of a segment.
    pixels: usize,
}

impl Layout {
    pub(crate) fn new(width: usize) -> Self {
        Self { width, pixels: width.div_ceil(SEGMENTS).max(1) }
    }

    /// Cells of a row, margins excepted: floats of a segment.
    pub(crate) fn cells(&self) -> usize {
        CHANNELS * self.pixels
    }

    /// Squares of sixteen cells of a row.
    pub(crate) fn squares(&self) -> usize {
        self.cells().div_ceil(BLOCK)
    }

    /// An empty row: whole steps of windows with margins, which is more than whole squares.
    pub(crate) fn row<const PLANES: usize>(&self) -> Row<PLANES> {
        vec![[[Lanes::ZERO; PLANES]; CHANNELS]; self.pixels.next_multiple_of(ROW_STEP) + 2 * RADIUS]
    }

    /// The floats of a row that a segment has.
    pub(crate) fn segment(&self, segment: usize) -> Range<usize> {
        let end = CHANNELS * self.width;
        end.min(segment * self.cells())..end.min((segment + 1) * self.cells())
    }

    /// One for the floats of a cell that are in the image, zero for the others.
    pub(crate) fn inside(&self, cell: usize) -> Lanes {
        Lanes(std::array::from_fn(|segment| if cell < self.segment(segment).len() { 1.0 } else { 0.0 }))
    }

    /// Where the floats of a square begin in a row, and how far those of the next segment are.
    #[inline(always)]
    pub(crate) fn steps(&self, square: usize) -> (usize, usize) {
        (BLOCK * square, self.cells())
    }

    /// Of how many segments a square has sixteen floats, among so many floats from the beginning of a row on; the last ones may be of the next segment, or row.
    #[inline(always)]
    pub(crate) fn whole(&self, floats: usize, square: usize) -> usize {
        let (floats, pitch) = (floats.saturating_sub(BLOCK * square), self.cells());
        (self.width / self.pixels).min((floats + pitch).saturating_sub(BLOCK) / pitch)
    }

    /// The floats of a row that a segment has in a square.
    pub(crate) fn some(&self, segment: usize, square: usize) -> Range<usize> {
        let floats = self.segment(segment);
        let start = floats.end.min(floats.start + BLOCK * square);
        start..floats.end.min(start + BLOCK)
    }

    /// Where pixels of the margins lie.
    pub(crate) fn margins(&self) -> impl Iterator<Item = usize> {
        (0..RADIUS).chain(RADIUS + self.pixels..2 * RADIUS + self.pixels)
    }
}

/// By pixel of a segment, with margins, and channel: cells of several planes.
pub(crate) type Row<const PLANES: usize> = Vec<[[Lanes; PLANES]; CHANNELS]>;

/// Cells of a row from its first pixel on.
#[inline(always)]
pub(crate) fn cells<const PLANES: usize>(row: &Row<PLANES>) -> &[[Lanes; PLANES]] {
    row[RADIUS..].as_flattened()
}

/// Cells of a row from its first pixel on.
#[inline(always)]
pub(crate) fn cells_mut<const PLANES: usize>(row: &mut Row<PLANES>) -> &mut [[Lanes; PLANES]] {
    row[RADIUS..].as_flattened_mut()
}

/// Fills the margins of a row: neighbouring segments, zero outside of the image.
#[inline(always)]
pub(crate) fn fill_margins<S: Simd, const PLANES: usize>(simd: S, layout: &Layout, row: &mut Row<PLANES>) {
    let count = layout.pixels;
    for at in layout.margins() {
        // The pixel lies so many segments to the left, or to the right.
        let (left, right) = (RADIUS.saturating_sub(at).div_ceil(count), at.saturating_sub(RADIUS) / count);
        let mut pixel = row[at + left * count - right * count];
        for lanes in pixel.as_flattened_mut() {
            for _ in 0..left {
                *lanes = moved_up(simd, lanes);
            }
            for _ in 0..right {
                *lanes = moved_down(simd, lanes);
            }
        }
        row[at] = pixel;
    }
}

/// Every segment in the place of the next one.
#[inline(always)]
fn moved_up<S: Simd>(simd: S, lanes: &Lanes) -> Lanes {
    if S::F32_LANES == BLOCK {
        return turned(simd, lanes, 1, 0);
    }
    let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, _] = lanes.0;
    Lanes([0.0, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o])
}

/// Every segment in the place of the one before it.
#[inline(always)]
fn moved_down<S: Simd>(simd: S, lanes: &Lanes) -> Lanes {
    if S::F32_LANES == BLOCK {
        return turned(simd, lanes, BLOCK - 1, BLOCK - 1);
    }
    let [_, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = lanes.0;
    Lanes([b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, 0.0])
}

/// A whole vector turned by so many places, and one of them cleared.
#[inline(always)]
fn turned<S: Simd>(simd: S, lanes: &Lanes, places: usize, cleared: usize) -> Lanes {
    let mut out = Lanes::ZERO;
    out.set(0, V { simd, value: simd.rotate_right_f32s(lanes.get(simd, 0).value, places) });
    out.0[cleared] = 0.0;
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transpose::transpose;
    use pulp::{Arch, Scalar, WithSimd};

    /// Reads floats to cells, and back.
    struct ThereAndBack<'a>(Layout, &'a [f32]);

    impl WithSimd for ThereAndBack<'_> {
        type Output = (Row<2>, Vec<f32>);

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let Self(layout, floats) = self;
            let (mut row, mut back) = (layout.row::<2>(), vec![0.0; floats.len()]);
            for square in (0..layout.squares()).rev() {
                let mut lanes = [Lanes::ZERO; BLOCK];
                for (segment, lanes) in lanes.iter_mut().enumerate() {
                    let some = layout.some(segment, square);
                    lanes.0[..some.len()].copy_from_slice(&floats[some.clone()]);
                    back[some.clone()].copy_from_slice(&lanes.0[..some.len()]);
                }
                transpose(simd, &lanes, 1, &mut cells_mut(&mut row).as_chunks_mut().0[square]);
            }
            fill_margins(simd, &layout, &mut row);
            (row, back)
        }
    }

    #[test]
    fn a_cell_holds_a_float_of_every_segment_and_margins_those_next_to_it() {
        for width in [1, 3, 5, 7, 23, 24, 40, 79, 80, 81, 97, 112, 200] {
            let layout = Layout::new(width);
            let floats: Vec<f32> = (0..3 * width).map(|i| i as f32 + 1.0).collect();
            for (row, back) in [Arch::new().dispatch(ThereAndBack(layout, &floats)), Scalar.vectorize(ThereAndBack(layout, &floats))] {
                assert_eq!(back, floats, "width {width}");
                for (at, cells) in row.iter().enumerate().take(layout.pixels + 2 * RADIUS) {
                    for (channel, planes) in cells.iter().enumerate() {
                        for (segment, &value) in planes[1].0.iter().enumerate() {
                            let pixel = (segment * layout.pixels + at) as isize - RADIUS as isize;
                            let expected =
                                if (0..width as isize).contains(&pixel) { (3 * pixel + channel as isize + 1) as f32 } else { 0.0 };
                            assert_eq!(value, expected, "width {width}, pixel {at}, segment {segment}");
                        }
                    }
                }
            }
        }
    }
}
