//! The separable 11-tap Gaussian window of SSIM, over vectors one after the other; down a column of them.
//!
//! With `c_k x = x[-k] + x[k]`, a symmetric window of eleven taps is, up to a factor, the nested sum
//!
//! `x + a₀ c₁ x + b₀ c₂ (x + a₁ c₁ x + b₁ c₂ (x + a₂ c₁ x))`:
//!
//! three additions and five multiply-adds where tap by tap it takes eleven. For a Gaussian all its terms are positive, so that nothing
//! cancels. What is nested is needed for two results; it is carried from one block of results to the next.

use crate::simd::{Lanes, V, splat};
use pulp::Simd;

/// Taps on either side of the centre.
pub(crate) const RADIUS: usize = 5;
/// Taps of the window.
pub(crate) const SIZE: usize = 2 * RADIUS + 1;
/// Standard deviation, pixels.
const SIGMA: f64 = 1.5;
/// Results at a time down a column.
pub(crate) const STEP: usize = 8;
/// Results at a time along a row, whose segments are short.
pub(crate) const ROW_STEP: usize = 5;
/// Inputs behind the last one that a block of results carries on from, and nested sums.
const CARRIED: usize = 4;
/// Inputs that a column keeps.
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
    /// Of `c₁ x`: a₀, a₁ and a₂.
    near: [V<S>; 3],
    /// Of what is nested: b₀ and b₁.
    far: [V<S>; 2],
}

/// Terms of `c₁ⁱ c₂ʲ` in the window: `[[1, c₁], [c₂, c₁ c₂], [c₂², c₁ c₂²]]`, from `c₁ c₂ = c₁ + c₃`, `c₂² = c₄ + 2` and `c₁ c₂² = 2 c₁ + c₃ + c₅`.
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
        Self { near: [by(near0, x0), by(near1, x1), by(near2, x2)], far: [by(x1, x0), by(x2, x1)] }
    }
}

/// What the results of a block share with those of the next one.
#[derive(Clone, Copy)]
pub(crate) struct Carry<S: Simd> {
    /// `c₁ x` at the first four results.
    near: [V<S>; CARRIED],
    /// The innermost sum at the first four results.
    inner: [V<S>; CARRIED],
    /// The middle sum at the two inputs before the first result and at the first two results.
    middle: [V<S>; CARRIED],
}

impl<S: Simd> Carry<S> {
    /// From the six inputs around the first four results, and middle sums.
    #[inline(always)]
    fn resume(nest: &Nest<S>, x: &[V<S>; KEPT], middle: [V<S>; CARRIED]) -> Self {
        let mut carry = Self { near: middle, inner: middle, middle };
        for i in 0..CARRIED {
            carry.near[i] = x[i] + x[i + 2];
            carry.inner[i] = nest.near[2].mul_add(carry.near[i], x[i + 1]);
        }
        carry
    }

    /// From the ten inputs around the first result, four of them behind it.
    #[inline(always)]
    pub(crate) fn begin(nest: &Nest<S>, x: &[V<S>; 2 * RADIUS]) -> Self {
        // Four results behind the first one, whose own middle sums are not known, leave behind all that the first one needs.
        let mut carry = Self::resume(nest, x.first_chunk().expect("six inputs"), [x[0]; CARRIED]);
        let mut reach = [x[0]; STEP + RADIUS];
        reach[..CARRIED + RADIUS].copy_from_slice(&x[1..]);
        let _: [V<S>; CARRIED] = carry.advance(nest, &reach);
        carry
    }

    /// The nested sums at `x[..COUNT]`, of at most `STEP`, from `RADIUS` inputs more.
    #[inline(always)]
    pub(crate) fn advance<const COUNT: usize>(&mut self, nest: &Nest<S>, x: &[V<S>; STEP + RADIUS]) -> [V<S>; COUNT] {
        let [mut near, mut inner, mut middle] = [[x[0]; STEP + CARRIED]; 3];
        near[..CARRIED].copy_from_slice(&self.near);
        inner[..CARRIED].copy_from_slice(&self.inner);
        middle[..CARRIED].copy_from_slice(&self.middle);
        let mut out = [x[0]; COUNT];
        for i in 0..COUNT {
            near[i + 4] = x[i + 3] + x[i + 5];
            inner[i + 4] = nest.near[2].mul_add(near[i + 4], x[i + 4]);
            middle[i + 4] = nest.far[1].mul_add(inner[i] + inner[i + 4], nest.near[1].mul_add(near[i + 2], x[i + 2]));
            out[i] = nest.far[0].mul_add(middle[i] + middle[i + 4], nest.near[0].mul_add(near[i], x[i]));
        }
        self.near.copy_from_slice(&near[COUNT..COUNT + CARRIED]);
        self.inner.copy_from_slice(&inner[COUNT..COUNT + CARRIED]);
        self.middle.copy_from_slice(&middle[COUNT..COUNT + CARRIED]);
        out
    }
}

/// What a column keeps from step to step: inputs, then middle sums. All zero, it follows zeros.
pub(crate) type Column = [Lanes; KEPT + CARRIED];

/// The nested sums around the `STEP` inputs that lie `RADIUS` before those that enter a column.
#[inline(always)]
pub(crate) fn down<S: Simd>(simd: S, nest: &Nest<S>, column: &mut Column, entering: &[V<S>; STEP], index: usize) -> [V<S>; STEP] {
    let mut x = [splat(simd, 0.0); KEPT + STEP];
    let mut middle = [splat(simd, 0.0); CARRIED];
    for i in 0..KEPT {
        x[i] = column[i].get(simd, index);
    }
    for i in 0..CARRIED {
        middle[i] = column[KEPT + i].get(simd, index);
    }
    x[KEPT..].copy_from_slice(entering);
    let mut carry = Carry::resume(nest, x.first_chunk().expect("six inputs"), middle);
    let out = carry.advance::<STEP>(nest, x.last_chunk().expect("thirteen inputs"));
    for i in 0..KEPT {
        column[i].set(index, x[STEP + i]);
    }
    for i in 0..CARRIED {
        column[KEPT + i].set(index, carry.middle[i]);
    }
    out
}
