//! Ends of matrix products in backward passes and in the gradient by the inputs; all matrices are
//! `[rows, units]`.

use crate::product::{Epilogue, vector, vector_at};
use pulp::{Simd, WithSimd};

/// `out = slope ⊙ sums`; and `curvature ⊙ sums` in place of `curvature`, where it is given: what is left of
/// it is the part that comes through `φ''` on the way back.
pub(crate) struct Scale<'a> {
    pub(crate) slope: &'a [f32],
    pub(crate) curvature: Option<&'a mut [f32]>,
    pub(crate) out: &'a mut [f32],
    pub(crate) units: usize,
}

impl Epilogue for Scale<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let at = row * self.units + column;
        if let Some(curvature) = &mut self.curvature {
            let curvature = vector::<S>(curvature, at);
            *curvature = simd.mul_f32s(*curvature, sums);
        }
        *vector::<S>(self.out, at) = simd.mul_f32s(vector_at::<S>(self.slope, at), sums);
    }
}

/// `out = sums` where `h > 0`, and 0 elsewhere.
pub(crate) struct Mask<'a> {
    pub(crate) h: &'a [f32],
    pub(crate) out: &'a mut [f32],
    pub(crate) units: usize,
}

impl Epilogue for Mask<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let at = row * self.units + column;
        let zero = simd.splat_f32s(0.0);
        let active = simd.greater_than_f32s(vector_at::<S>(self.h, at), zero);
        *vector::<S>(self.out, at) = simd.select_f32s(active, sums, zero);
    }
}

/// `v_z = v_z + slope ⊙ sums`.
pub(crate) struct AddScaled<'a> {
    pub(crate) slope: &'a [f32],
    pub(crate) v_z: &'a mut [f32],
    pub(crate) units: usize,
}

impl Epilogue for AddScaled<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let at = row * self.units + column;
        let v_z = vector::<S>(self.v_z, at);
        *v_z = simd.mul_add_f32s(vector_at::<S>(self.slope, at), sums, *v_z);
    }
}

/// Hands one row to an epilogue as each of `rows` rows.
pub(crate) struct EveryRow<'a, E> {
    pub(crate) row: &'a [f32],
    pub(crate) rows: usize,
    pub(crate) epilogue: E,
}

impl<E: Epilogue> WithSimd for EveryRow<'_, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for row in 0..self.rows {
            for (at, &values) in S::as_simd_f32s(self.row).0.iter().enumerate() {
                self.epilogue.take(simd, row, at * S::F32_LANES, values);
            }
        }
    }
}
