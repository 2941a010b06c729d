//! The separable 11-tap Gaussian window of SSIM, over vectors one after the other.
//!
//! With `c_k x = x[-k] + x[k]`, a symmetric window of eleven taps is, up to a factor, the nested sum
//!
//! `x + a₀ c₁ x + b₀ c₂ (x + a₁ c₁ x + b₁ c₂ (x + a₂ c₁ x))`:
//!
//! three additions and five multiply-adds where tap by tap it takes eleven. For a Gaussian all its terms are
//! positive, so that nothing cancels. What is nested is needed for two results; it is carried from one step
//! to the next.

use crate::simd::{Lanes, V, splat};
use pulp::Simd;

/// Taps on either side of the centre.
pub(crate) const RADIUS: usize = 5;
/// Taps of the window.
const SIZE: usize = 2 * RADIUS + 1;
/// Standard deviation, pixels.
const SIGMA: f64 = 1.5;
/// Vectors that enter at a time, and results.
pub(crate) const STEP: usize = 16;
/// Vectors behind the last one that results carry on from, and nested sums.
const CARRIED: usize = 4;
/// Vectors that are kept.
const KEPT: usize = CARRIED + 2;

/// The window, up to its sum.
fn raw() -> [f64; SIZE] {
    std::array::from_fn(|i| (-0.5 * ((i as f64 - RADIUS as f64) / SIGMA).powi(2)).exp())
}

/// The normalised window.
pub(crate) fn weights() -> [f32; SIZE] {
    let total: f64 = raw().iter().sum();
    raw().map(|w| (w / total) as f32)
}

/// Factors of the nested sum, from the outermost on.
#[derive(Clone, Copy)]
pub(crate) struct Nest<S: Simd> {
    /// Coefficients of `c₁ x`: a₀ - a₁, a₁ - a₂ and a₂, which are positive.
    near: [V<S>; 3],
    /// Coefficients of the nested sums: b₀ and b₁.
    far: [V<S>; 2],
}

/// Terms of `c₁ⁱ c₂ʲ` in the window: `[[1, c₁], [c₂, c₁ c₂], [c₂², c₁ c₂²]]`, from `c₁ c₂ = c₁ + c₃`, `c₂² =
/// c₄ + 2` and `c₁ c₂² = 2 c₁ + c₃ + c₅`.
fn terms() -> [[f64; 2]; 3] {
    let [_, _, _, _, _, w0, w1, w2, w3, w4, w5] = raw();
    [[w0 - 2.0 * w4, w1 - w3 - w5], [w2, w3 - w5], [w4, w5]]
}

/// Sum of the factors of the nested sum: by so much it exceeds a mean.
pub(crate) fn gain() -> f64 {
    raw().iter().sum::<f64>() / terms()[0][0]
}

impl<S: Simd> Nest<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let [[x0, near0], [x1, near1], [x2, near2]] = terms();
        let by = |a: f64, b: f64| splat(simd, (a / b) as f32);
        let [a0, a1, a2] = [near0 / x0, near1 / x1, near2 / x2];
        Self { near: [a0 - a1, a1 - a2, a2].map(|a| splat(simd, a as f32)), far: [by(x1, x0), by(x2, x1)] }
    }

    /// `x + a c₁ x` for a₂, a₁ and a₀, each from the one before it, so that no operand is needed once more.
    #[inline(always)]
    fn around(&self, near: V<S>, x: V<S>) -> [V<S>; 3] {
        let inner = self.near[2].mul_add(near, x);
        let middle = self.near[1].mul_add(near, inner);
        [inner, middle, self.near[0].mul_add(near, middle)]
    }
}

/// `STEP` vectors that enter a sequence, and the places of results, which may be theirs.
pub(crate) trait Line {
    fn get<S: Simd>(&self, simd: S, i: usize, index: usize) -> V<S>;
    /// After the vector of the same place was taken.
    fn set<S: Simd>(&mut self, i: usize, index: usize, value: V<S>);
}

/// State of a sequence between two steps: vectors, then middle sums; all zero after zeros.
pub(crate) type Past = [Lanes; KEPT + CARRIED];

/// The nested sums around the `STEP` vectors that lie `RADIUS` before those that enter.
#[inline(always)]
pub(crate) fn slide<S: Simd>(simd: S, nest: &Nest<S>, past: &mut Past, line: &mut impl Line, index: usize) {
    let mut carry = Carry::resume(simd, nest, past, index);
    carry.advance::<0>(nest, past, line, index);
    carry.advance::<GROUP>(nest, past, line, index);
    carry.advance::<{ 2 * GROUP }>(nest, past, line, index);
    carry.advance::<{ 3 * GROUP }>(nest, past, line, index);
    for i in 0..CARRIED {
        past[KEPT + i].set(index, carry.middle[i]);
    }
}

/// Results at a time: the compiler lays out so many one after the other.
const GROUP: usize = STEP / 4;

/// Partial sums that consecutive results share.
struct Carry<S: Simd> {
    /// The last two vectors.
    x: [V<S>; 2],
    /// The innermost sum at the next four results.
    inner: [V<S>; CARRIED],
    /// The middle sum, but for what is nested, two vectors behind the next result and one more.
    between: [V<S>; 2],
    /// The middle sum at the two vectors before the next result and at the next two results.
    middle: [V<S>; CARRIED],
    /// The next four results, but for what is nested.
    outer: [V<S>; CARRIED],
}

impl<S: Simd> Carry<S> {
    #[inline(always)]
    fn resume(simd: S, nest: &Nest<S>, past: &Past, index: usize) -> Self {
        let zero = splat(simd, 0.0);
        let mut x = [zero; KEPT];
        for i in 0..KEPT {
            x[i] = past[i].get(simd, index);
        }
        let [mut inner, mut between, mut middle, mut outer] = [[zero; CARRIED]; 4];
        for i in 0..CARRIED {
            [inner[i], between[i], outer[i]] = nest.around(x[i] + x[i + 2], x[i + 1]);
            middle[i] = past[KEPT + i].get(simd, index);
        }
        Self { x: [x[4], x[5]], inner, between: [between[2], between[3]], middle, outer }
    }

    #[inline(always)]
    fn advance<const FROM: usize>(
        &mut self,
        nest: &Nest<S>,
        past: &mut Past,
        line: &mut impl Line,
        index: usize,
    ) {
        let (zero, simd) = (self.x[0], self.x[0].simd);
        let [mut x, mut between] = [[zero; 2 + GROUP]; 2];
        let [mut inner, mut middle, mut outer] = [[zero; CARRIED + GROUP]; 3];
        x[..2].copy_from_slice(&self.x);
        between[..2].copy_from_slice(&self.between);
        inner[..CARRIED].copy_from_slice(&self.inner);
        middle[..CARRIED].copy_from_slice(&self.middle);
        outer[..CARRIED].copy_from_slice(&self.outer);
        // All at once, so that a vector is not needed any more when it becomes a sum.
        let mut near = [zero; GROUP];
        for i in 0..GROUP {
            x[i + 2] = line.get(simd, FROM + i, index);
            if FROM + i >= STEP - KEPT {
                past[FROM + i + KEPT - STEP].set(index, x[i + 2]);
            }
            near[i] = x[i] + x[i + 2];
        }
        for i in 0..GROUP {
            [inner[i + 4], between[i + 2], outer[i + 4]] = nest.around(near[i], x[i + 1]);
            middle[i + 4] = nest.far[1].mul_add(inner[i] + inner[i + 4], between[i]);
            line.set(FROM + i, index, nest.far[0].mul_add(middle[i] + middle[i + 4], outer[i]));
        }
        self.x.copy_from_slice(&x[GROUP..]);
        self.between.copy_from_slice(&between[GROUP..]);
        self.inner.copy_from_slice(&inner[GROUP..]);
        self.middle.copy_from_slice(&middle[GROUP..]);
        self.outer.copy_from_slice(&outer[GROUP..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::BLOCK;
    use pulp::{Arch, Scalar, WithSimd};

    impl Line for [Lanes; STEP] {
        fn get<S: Simd>(&self, simd: S, i: usize, index: usize) -> V<S> {
            self[i].get(simd, index)
        }

        fn set<S: Simd>(&mut self, i: usize, index: usize, value: V<S>) {
            self[i].set(index, value);
        }
    }

    /// Three steps of a sequence that begins after zeros.
    struct Steps([[Lanes; STEP]; 3]);

    impl WithSimd for Steps {
        type Output = [[Lanes; STEP]; 3];

        #[inline(always)]
        fn with_simd<S: Simd>(mut self, simd: S) -> Self::Output {
            let (nest, mut past) = (Nest::new(simd), Past::default());
            for step in &mut self.0 {
                for index in 0..BLOCK / S::F32_LANES {
                    slide(simd, &nest, &mut past, step, index);
                }
            }
            self.0
        }
    }

    #[test]
    fn every_sum_weighs_the_vectors_around_it() {
        let value = |i: usize, lane: usize| ((i * 37 + lane * 11) % 17) as f32 - 5.0;
        let steps: [[Lanes; STEP]; 3] = std::array::from_fn(|step| {
            std::array::from_fn(|i| Lanes(std::array::from_fn(|lane| value(STEP * step + i, lane))))
        });
        for found in [Arch::new().dispatch(Steps(steps)), Scalar.vectorize(Steps(steps))] {
            for (i, sums) in found.as_flattened().iter().enumerate() {
                for (lane, &sum) in sums.0.iter().enumerate() {
                    // The window ends at the vector that entered in the place of the sum.
                    let taps = (0..SIZE).filter_map(|k| {
                        Some(
                            f64::from(weights()[k])
                                * f64::from(value((i + k).checked_sub(2 * RADIUS)?, lane)),
                        )
                    });
                    let (mean, found) = (taps.sum::<f64>(), f64::from(sum) / gain());
                    assert!((found - mean).abs() < 2e-6, "{found} for {mean} at {i}");
                }
            }
        }
    }
}
