//! Arithmetic in double precision on [`GROUP`] supports at a time, generic over the processor's vector width.
//!
//! Like the rasterizer's lanes: no closures, whose bodies would be compiled without the vector features.

use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// Supports that go through the lanes together, whatever the width of vectors.
pub(crate) const GROUP: usize = 16;

/// A number of every support of a group.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Lanes(pub(crate) [f64; GROUP]);

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; GROUP]);

    /// Vector number `index`.
    #[inline(always)]
    pub(crate) fn get<S: Simd>(&self, simd: S, index: usize) -> V<S> {
        V { simd, value: S::as_simd_f64s(&self.0).0[index] }
    }

    /// Replaces vector number `index`.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(&mut self, index: usize, value: V<S>) {
        S::as_mut_simd_f64s(&mut self.0).0[index] = value.value;
    }
}

/// Vectors number `index` of several numbers.
#[inline(always)]
pub(crate) fn load<S: Simd, const N: usize>(simd: S, lanes: &[Lanes; N], index: usize) -> [V<S>; N] {
    let mut vectors = [splat(simd, 0.0); N];
    for i in 0..N {
        vectors[i] = lanes[i].get(simd, index);
    }
    vectors
}

/// Replaces vectors number `index` of several numbers.
#[inline(always)]
pub(crate) fn store<S: Simd, const N: usize>(lanes: &mut [Lanes; N], index: usize, vectors: [V<S>; N]) {
    for i in 0..N {
        lanes[i].set(index, vectors[i]);
    }
}

/// A vector with operators.
#[derive(Clone, Copy)]
pub(crate) struct V<S: Simd> {
    simd: S,
    value: S::f64s,
}

/// The same value in every lane.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, value: f64) -> V<S> {
    V { simd, value: simd.splat_f64s(value) }
}

impl<S: Simd> V<S> {
    /// A constant beside `self`.
    #[inline(always)]
    pub(crate) fn of(self, value: f64) -> Self {
        splat(self.simd, value)
    }

    /// `self · b + c`.
    #[inline(always)]
    pub(crate) fn mul_add(self, b: Self, c: Self) -> Self {
        Self { value: self.simd.mul_add_f64s(self.value, b.value, c.value), ..self }
    }

    /// `1 / self`.
    #[inline(always)]
    pub(crate) fn reciprocal(self) -> Self {
        Self { value: self.simd.div_f64s(self.simd.splat_f64s(1.0), self.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self { value: self.simd.sqrt_f64s(self.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self { value: self.simd.max_f64s(self.value, other.value), ..self }
    }

    /// Lanes where `self > other`; none where either is not a number.
    #[inline(always)]
    pub(crate) fn exceeds(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, value: self.simd.greater_than_f64s(self.value, other.value) }
    }
}

impl<S: Simd> Add for V<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.simd.add_f64s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Sub for V<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.simd.sub_f64s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Mul for V<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.simd.mul_f64s(self.value, other.value), ..self }
    }
}

/// A condition in every lane.
#[derive(Clone, Copy)]
pub(crate) struct Mask<S: Simd> {
    simd: S,
    value: S::m64s,
}

impl<S: Simd> Mask<S> {
    #[inline(always)]
    pub(crate) fn and(self, other: Self) -> Self {
        Self { value: self.simd.and_m64s(self.value, other.value), ..self }
    }

    /// Whether it holds in no lane.
    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self.simd.first_true_m64s(self.value) >= S::F64_LANES
    }

    /// `yes` where it holds, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(self, yes: V<S>, no: V<S>) -> V<S> {
        V { value: self.simd.select_f64s(self.value, yes.value, no.value), ..yes }
    }
}
