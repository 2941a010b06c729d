//! The forward derivative of `blend` by motions of some Gaussians: back to front through one tile.
//!
//! With `T` the transmittance in front of a Gaussian of colour `c` and `B` all light from behind it, the
//! pixel changes by `α T c − α / (1 − α) · B` for each unit by which its exponent changes, and its
//! transmittance by `−α / (1 − α)` of itself. The exponent changes by a quadratic polynomial of the pixel's
//! offset ([`SplatTangent`]), one for each motion.

use crate::blend::TileState;
use crate::blend_vjp::{LitRows, removed};
use crate::project_jvp::SplatTangent;
use crate::simd::fma;
use crate::tile_list::{BATCH, Batch, Heights, Plane, Splat, TileList, offset_x, take_row};
use crate::tiles::TILE;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// The tangent of a tile by one motion: three channels over the background, and the transmittance.
pub(crate) type TileTangent = [Plane; 4];

/// Tangents of some consecutive Gaussians by some motions.
#[derive(Clone, Copy)]
pub(crate) struct Moved<'a> {
    /// Index of the first Gaussian.
    pub first: usize,
    /// By Gaussian and motion.
    pub tangents: &'a [SplatTangent],
    pub motions: usize,
    /// Whether colours change as well.
    pub is_colored: bool,
}

impl<'a> Moved<'a> {
    /// The Gaussians that move.
    pub(crate) fn members(&self) -> Range<usize> {
        self.first..self.first + self.tangents.len() / self.motions
    }

    /// The tangents of a Gaussian, if it moves.
    #[inline(always)]
    fn of(&self, gaussian: usize) -> Option<&'a [SplatTangent]> {
        let at = gaussian.checked_sub(self.first)?;
        self.tangents.get(at * self.motions..(at + 1) * self.motions)
    }
}

/// Pushes motions of Gaussians forward to the pixels of a tile.
pub(crate) struct BlendJvp<'a> {
    pub list: TileList<'a>,
    pub state: &'a TileState,
    pub background: [f32; 3],
    pub moved: Moved<'a>,
}

impl WithSimd for BlendJvp<'_> {
    /// By motion.
    type Output = Vec<TileTangent>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<TileTangent> {
        let Self { list, state, background, moved } = self;
        let mut out = vec![[Plane::ZERO; 4]; moved.motions];
        let members = moved.members();
        let is_member = |position: &usize| members.contains(&(list.members[*position].gaussian as usize));
        let Some(foremost) = (0..state.processed).find(is_member) else { return out };
        let mut transmittance = state.transmittance;
        let mut behind = background.map(|channel| Plane(state.transmittance.0.map(|t| t * channel)));
        let [red, green, blue] = &mut behind;
        let mut pixels = Pixels::<S> {
            behind: [red.vectors::<S>(), green.vectors::<S>(), blue.vectors::<S>()],
            transmittance: transmittance.vectors::<S>(),
            last: S::as_simd_f32s(&state.transmittance.0).0,
            stop: S::as_simd_f32s(&state.stop.0).0,
            tangents: out.iter_mut().map(|planes| planes.each_mut().map(Plane::vectors::<S>)).collect(),
            is_colored: moved.is_colored,
        };
        let (mut batch, mut lit) = (Batch::new(), LitRows::new(state));
        for first in (0..state.processed).step_by(BATCH).rev() {
            batch.load(simd, &list, first, &|g| g.color);
            for position in (first.max(foremost)..state.processed.min(first + BATCH)).rev() {
                let mut g = batch.get(position - first);
                g.rows &= lit.at(position);
                let tangents = moved.of(list.members[position].gaussian as usize);
                pixels.remove(simd, &g, position as f32, tangents.unwrap_or_default());
            }
            if first <= foremost {
                break;
            }
        }
        out
    }
}

/// The pixels of a tile while Gaussians are taken away again.
struct Pixels<'a, S: Simd> {
    /// Light from behind.
    behind: [&'a mut [S::f32s]; 3],
    transmittance: &'a mut [S::f32s],
    /// The transmittance behind all Gaussians.
    last: &'a [S::f32s],
    stop: &'a [S::f32s],
    /// By motion and channel.
    tangents: Vec<[&'a mut [S::f32s]; 4]>,
    is_colored: bool,
}

impl<S: Simd> Pixels<'_, S> {
    /// Takes away the rearmost Gaussian, which moves by some tangents or, without any, rests.
    #[inline(always)]
    fn remove(&mut self, simd: S, g: &Splat, position: f32, moved: &[SplatTangent]) {
        let per_row = TILE / S::F32_LANES;
        let heights = Heights::new(simd, g);
        for column in 0..per_row {
            let dx = offset_x(simd, g, column);
            let along = simd.mul_f32s(simd.splat_f32s(g.factor[0]), dx);
            let mut rows = g.rows;
            while rows != 0 {
                let row = take_row(&mut rows);
                let at = row * per_row + column;
                let hit = simd.less_than_f32s(simd.splat_f32s(position), self.stop[at]);
                let log2_alpha = heights.log2_alpha(simd, along, row);
                let effect = self.remove_at(simd, at, g.channels, (log2_alpha, hit));
                self.push(simd, at, &effect, ((dx, heights.dy.0[row]), moved));
            }
        }
    }

    /// Takes a Gaussian of a colour away from the vector of pixels number `at`, where those count that are
    /// `hit`.
    #[inline(always)]
    fn remove_at(
        &mut self,
        simd: S,
        at: usize,
        color: [f32; 3],
        (log2_alpha, hit): (S::f32s, S::m32s),
    ) -> Effect<S> {
        let removed = removed(simd, (log2_alpha, hit), self.transmittance[at]);
        let free = |value| simd.select_f32s(removed.is_free, value, simd.splat_f32s(0.0));
        let mut by_exponent = [simd.splat_f32s(0.0); 4];
        for channel in 0..3 {
            let light = simd.mul_f32s(removed.weight, simd.splat_f32s(color[channel]));
            let behind = self.behind[channel][at];
            by_exponent[channel] = free(simd.negate_mul_add_f32s(removed.odds, behind, light));
            self.behind[channel][at] = simd.add_f32s(behind, light);
        }
        by_exponent[3] = free(simd.neg_f32s(simd.mul_f32s(removed.odds, self.last[at])));
        self.transmittance[at] = simd.mul_f32s(self.transmittance[at], removed.inverse);
        Effect { by_exponent, by_color: removed.weight }
    }

    /// Adds what motions of a Gaussian do to a vector of pixels at some offset from it.
    #[inline(always)]
    fn push(
        &mut self,
        simd: S,
        at: usize,
        effect: &Effect<S>,
        ((dx, dy), moved): ((S::f32s, f32), &[SplatTangent]),
    ) {
        for (planes, SplatTangent { exponent: [one, x, y, xx, xy, yy], color }) in
            self.tangents.iter_mut().zip(moved)
        {
            let constant = simd.splat_f32s(dy.mul_add(dy.mul_add(*yy, *y), *one));
            let linear = simd.splat_f32s(dy.mul_add(*xy, *x));
            let exponent = fma(simd, dx, fma(simd, dx, simd.splat_f32s(*xx), linear), constant);
            for (plane, by_exponent) in planes.iter_mut().zip(effect.by_exponent) {
                plane[at] = fma(simd, exponent, by_exponent, plane[at]);
            }
            if self.is_colored {
                for (plane, &color) in planes.iter_mut().zip(color) {
                    plane[at] = fma(simd, effect.by_color, simd.splat_f32s(color), plane[at]);
                }
            }
        }
    }
}

/// What a Gaussian does to a vector of pixels.
struct Effect<S: Simd> {
    /// Derivatives of three channels and of the transmittance by its exponent.
    by_exponent: [S::f32s; 4],
    /// Derivative of a channel by its colour.
    by_color: S::f32s,
}
