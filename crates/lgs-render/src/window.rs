//! The separable 11-tap Gaussian window of SSIM over blocks of columns of interleaved RGB rows.
//!
//! A block is 16 consecutive floats of a row, whatever they mean: a step of one pixel is three floats. Horizontally, taps are read from padded
//! rows at any offset; vertically, a block keeps the last rows it needs side by side, so that they stay in the first-level cache.

use crate::simd::{BLOCK, Lanes, V, splat};
use pulp::Simd;

/// Taps on either side of the centre.
pub(crate) const RADIUS: usize = 5;
/// Taps of the window.
pub(crate) const SIZE: usize = 2 * RADIUS + 1;
/// Standard deviation, pixels.
const SIGMA: f64 = 1.5;
/// Rows that are windowed at a time.
pub(crate) const STEP: usize = 8;
/// Rows that the windows of `STEP` rows reach.
pub(crate) const SPAN: usize = STEP + 2 * RADIUS;

/// The normalised window.
pub(crate) fn weights() -> [f32; SIZE] {
    let raw: [f64; SIZE] = std::array::from_fn(|i| (-0.5 * ((i as f64 - RADIUS as f64) / SIGMA).powi(2)).exp());
    let total: f64 = raw.iter().sum();
    raw.map(|w| (w / total) as f32)
}

/// The symmetric window as vectors: the outermost tap first, the centre last.
pub(crate) type Taps<S> = [V<S>; RADIUS + 1];

#[inline(always)]
pub(crate) fn taps<S: Simd>(simd: S, weights: &[f32; SIZE]) -> Taps<S> {
    let mut out = [splat(simd, 0.0); RADIUS + 1];
    for (out, &weight) in out.iter_mut().zip(weights) {
        *out = splat(simd, weight);
    }
    out
}

/// `STEP` rows with a block of padding on either side, and zeros past the image.
#[derive(Debug, Default)]
pub(crate) struct Padded {
    values: Vec<[f32; BLOCK]>,
    blocks: usize,
}

/// A block of a padded row between its neighbours.
pub(crate) type Reach = [f32; 3 * BLOCK];

impl Padded {
    /// Takes rows of so many blocks.
    pub(crate) fn resize(&mut self, blocks: usize) {
        if self.blocks != blocks {
            self.blocks = blocks;
            self.values.clear();
            self.values.resize(STEP * (blocks + 2), [0.0; BLOCK]);
        }
    }

    #[inline(always)]
    fn start(&self, row: usize) -> usize {
        row * (self.blocks + 2)
    }

    /// Replaces a row; none is zero.
    pub(crate) fn set_row(&mut self, row: usize, source: Option<&[f32]>) {
        let start = BLOCK * (self.start(row) + 1);
        let out = &mut self.values.as_flattened_mut()[start..start + BLOCK * self.blocks];
        let source = source.unwrap_or_default();
        out[..source.len()].copy_from_slice(source);
        out[source.len()..].fill(0.0);
    }

    /// Replaces a block of a row.
    #[inline(always)]
    pub(crate) fn set_block(&mut self, row: usize, block: usize, source: &Lanes) {
        let at = self.start(row) + 1 + block;
        self.values[at] = source.0;
    }

    /// What the windows of a block reach.
    #[inline(always)]
    pub(crate) fn reach(&self, row: usize, block: usize) -> &Reach {
        let start = self.start(row) + block;
        self.values[start..start + 3].as_flattened().try_into().expect("three blocks")
    }
}

/// The last `SPAN` rows of a block of columns, of several planes.
pub(crate) type Columns<const PLANES: usize> = [[Lanes; SPAN]; PLANES];

/// Makes room for `STEP` rows. Through registers, as `copy_within` would call `memmove`.
#[inline(always)]
pub(crate) fn advance<S: Simd, const PLANES: usize>(simd: S, columns: &mut Columns<PLANES>) {
    for plane in columns {
        for index in 0..BLOCK / S::F32_LANES {
            let mut kept = [splat(simd, 0.0); 2 * RADIUS];
            for (row, kept) in kept.iter_mut().enumerate() {
                *kept = plane[STEP + row].get(simd, index);
            }
            for (row, kept) in kept.into_iter().enumerate() {
                plane[row].set(index, kept);
            }
        }
    }
}

/// The window over the rows around row `RADIUS + row`.
#[inline(always)]
pub(crate) fn vertical<S: Simd>(simd: S, taps: &Taps<S>, plane: &[Lanes; SPAN], row: usize, index: usize) -> V<S> {
    let mut sum = taps[RADIUS] * plane[row + RADIUS].get(simd, index);
    for t in 0..RADIUS {
        let pair = plane[row + t].get(simd, index) + plane[row + SIZE - 1 - t].get(simd, index);
        sum = taps[t].mul_add(pair, sum);
    }
    sum
}

/// Vector number `index` of the block that `reach` is around, moved by `tap - RADIUS` pixels.
#[inline(always)]
pub(crate) fn shifted<S: Simd>(simd: S, reach: &Reach, tap: usize, index: usize) -> V<S> {
    let start = BLOCK + 3 * tap - 3 * RADIUS + index * S::F32_LANES;
    V { simd, value: S::as_simd_f32s(&reach[start..start + S::F32_LANES]).0[0] }
}

/// The window over the pixels around those of a block.
#[inline(always)]
pub(crate) fn horizontal<S: Simd>(simd: S, taps: &Taps<S>, reach: &Reach, index: usize) -> V<S> {
    let mut sum = taps[RADIUS] * shifted(simd, reach, RADIUS, index);
    for (t, &tap) in taps[..RADIUS].iter().enumerate() {
        sum = tap.mul_add(shifted(simd, reach, t, index) + shifted(simd, reach, SIZE - 1 - t, index), sum);
    }
    sum
}
