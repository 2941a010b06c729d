//! SSIM and its slopes from windowed means.

use super::lines::{Cells, PIXELS};
use crate::pack::Pack;
use crate::simd::V;
use crate::ssim::{Constants, compare};
use pulp::Simd;

/// Pixels of which SSIM is computed at once.
const PACK: usize = 4;

/// Sixteen pixels that are compared; those count that are inside of the image.
pub(super) struct ComparedPixels<'a, S: Simd> {
    pub constants: &'a Constants<S>,
    /// The number 1 inside of the image, 0 outside.
    pub inside: &'a [f32; PIXELS],
}

impl<S: Simd> ComparedPixels<'_, S> {
    /// The sum of a channel's SSIM; slopes take the place of means.
    #[inline(always)]
    pub(super) fn pixels(&self, cells: &mut Cells, channel: usize, weight: V<S>, index: usize) -> V<S> {
        let mut total = weight.of(0.0);
        for first in (0..PIXELS).step_by(PACK) {
            let mut packed = [Pack([weight; PACK]); 4];
            for plane in 0..4 {
                for i in 0..PACK {
                    packed[plane].0[i] = cells[first + i][channel][plane].get(weight.simd, index);
                }
            }
            let (ssim, by) = compare(self.constants, packed, weight);
            for i in 0..PACK {
                total = ssim.0[i].mul_add(weight.of(self.inside[first + i]), total);
                for plane in 0..3 {
                    cells[first + i][channel][plane].set(index, by[plane].0[i]);
                }
            }
        }
        total
    }
}
