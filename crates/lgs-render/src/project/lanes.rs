//! Blocks of Gaussians, lane by lane: parameters before projection and the image plane after it.

use crate::projected::{LOG2_255, Projected};
use crate::sh::Basis;
use crate::simd::{BLOCK, Lanes, V, splat};
use crate::splats::Splats;
use pulp::Simd;

/// A block of raw parameters, lane by lane.
pub(super) struct Inputs {
    pub(super) mean: [Lanes; 3],
    pub(super) rotation: [Lanes; 4],
    pub(super) log_scale: [Lanes; 3],
    pub(super) raw_opacity: Lanes,
}

impl Inputs {
    #[inline(always)]
    pub(super) fn load(splats: &Splats, first: usize, count: usize) -> Self {
        let zero = Lanes::ZERO;
        let mut out = Self { mean: [zero; 3], rotation: [zero; 4], log_scale: [zero; 3], raw_opacity: zero };
        let range = first..first + count;
        transpose(&splats.means[range.clone()], &mut out.mean);
        transpose(&splats.rotations[range.clone()], &mut out.rotation);
        transpose(&splats.log_scales[range.clone()], &mut out.log_scale);
        out.raw_opacity.0[..count].copy_from_slice(&splats.raw_opacities[range]);
        out
    }
}

#[inline(always)]
fn transpose<const N: usize>(rows: &[[f32; N]], out: &mut [Lanes; N]) {
    for (lane, row) in rows.iter().enumerate().take(BLOCK) {
        for axis in 0..N {
            out[axis].0[lane] = row[axis];
        }
    }
}

/// The fields of [`Projected`] of a block, lane by lane.
pub(super) struct ImageBlock {
    pub(super) mean: [Lanes; 2],
    pub(super) factor: [Lanes; 3],
    pub(super) log2_opacity: Lanes,
    pub(super) depth: Lanes,
    half: [Lanes; 2],
    rightmost: Lanes,
    /// Three standard deviations along the longer axis, pixels.
    pub(super) radius: Lanes,
    pub(super) determinant: Lanes,
    pub(super) basis: Basis,
}

impl Default for ImageBlock {
    #[inline(always)]
    fn default() -> Self {
        let zero = Lanes::ZERO;
        Self {
            mean: [zero; 2],
            factor: [zero; 3],
            log2_opacity: zero,
            depth: zero,
            half: [zero; 2],
            rightmost: zero,
            radius: zero,
            determinant: zero,
            basis: Basis::ZERO,
        }
    }
}

impl ImageBlock {
    /// A lane, still without its colour; `None` up to the near plane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize, near: f32) -> Option<Projected> {
        let depth = self.depth.0[lane];
        // Written so that NaN is culled as well.
        (depth > near).then_some(Projected {
            mean: [self.mean[0].0[lane], self.mean[1].0[lane]],
            factor: [self.factor[0].0[lane], self.factor[1].0[lane], self.factor[2].0[lane]],
            log2_opacity: self.log2_opacity.0[lane],
            color: [0.0; 3],
            depth,
            reach: self.log2_opacity.0[lane] + LOG2_255,
            half: [self.half[0].0[lane], self.half[1].0[lane]],
            rightmost: self.rightmost.0[lane],
        })
    }

    /// The extent on the image of an ellipse with the covariance `[[a, b], [b, c]]` and the squared
    /// Mahalanobis radius `reach`.
    #[inline(always)]
    pub(super) fn set_extent<S: Simd>(
        &mut self,
        index: usize,
        [a, b, c]: [V<S>; 3],
        determinant: V<S>,
        reach: V<S>,
    ) {
        let simd = reach.simd;
        // Relative slack for ellipses much larger than the image.
        self.half[0].set(index, (reach * a).sqrt() * splat(simd, 1.0 + 1e-5));
        self.half[1].set(index, (reach * c).sqrt() * splat(simd, 1.0 + 1e-5));
        self.rightmost.set(index, b * (reach / a).sqrt());
        let half_trace = splat(simd, 0.5) * (a + c);
        let longest = half_trace + (half_trace * half_trace - determinant).max(splat(simd, 0.1)).sqrt();
        self.radius.set(index, splat(simd, 3.0) * longest.sqrt());
        self.determinant.set(index, determinant);
    }
}
