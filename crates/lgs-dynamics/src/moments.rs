//! Moments that the fit of a support reads: sums over its members, relative to its owner, a group of supports
//! at a time.

use crate::lanes::{GROUP, Lanes};
use crate::supports::Supports;
use glam::{Vec4, Vec4Swizzles, vec4};
use lgs_core::prefetch::prefetch;
use pulp::Simd;
use rayon::prelude::*;

/// Particles per task of [`pair_up`].
const CHUNK: usize = 1 << 10;

/// Groups between the one at work and the one for which memory is asked.
pub(crate) const AHEAD: usize = 2;

/// Two vectors of one particle side by side, so that both come with one line of the cache: its position and
/// candidate, say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Pair(pub(crate) Vec4, pub(crate) Vec4);

/// Positions and candidates `[n, 3]`, with a one behind them.
pub(crate) fn pair_up(position: &[[f32; 3]], candidate: &[[f32; 3]], pairs: &mut Vec<Pair>) {
    let with_one = |[x, y, z]: [f32; 3]| vec4(x, y, z, 1.0);
    let pair = |(&q, &c): (&[f32; 3], &[f32; 3])| Pair(with_one(q), with_one(c));
    position.par_iter().zip(candidate).with_min_len(CHUNK).map(pair).collect_into_vec(pairs);
}

/// A group of supports at one time; each relative to its owner.
pub(crate) struct Group {
    /// `A = Σ (q̃ − c)(q − q̄)ᵀ`, row by row.
    pub(crate) a: [Lanes; 9],
    /// Owner minus support mean, at the start of the step.
    pub(crate) from_mean: [Lanes; 3],
    /// Support mean minus owner, of the candidates.
    pub(crate) to_candidate_mean: [Lanes; 3],
}

impl Group {
    /// Moments of supports from particle `first` on; the last one stands in for those that the last group
    /// lacks.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, pairs: &[Pair], supports: &Supports, first: usize) -> Self {
        for &member in supports.member_arrivals(first / GROUP + AHEAD) {
            prefetch::<S, Pair, false>(simd, pairs.get(member as usize));
        }
        let mut group =
            Self { a: [Lanes::ZERO; 9], from_mean: [Lanes::ZERO; 3], to_candidate_mean: [Lanes::ZERO; 3] };
        for lane in 0..GROUP {
            let owner = (first + lane).min(pairs.len() - 1);
            group.set(lane, sums(pairs, supports.members(owner), owner), supports.k());
        }
        group
    }

    /// Moments from `Σ (y, 1)(x, 1)ᵀ` of `k` members: `Σ (y − ȳ)(x − x̄)ᵀ = Σ y xᵀ − k ȳ x̄ᵀ`; both terms are
    /// of the support's own size, as the owner is one of its points.
    #[inline(always)]
    fn set(&mut self, lane: usize, sums: [[f32; 4]; 4], k: usize) {
        let per = 1.0 / k as f64;
        for i in 0..3 {
            let y = f64::from(sums[i][3]) * per;
            for (j, a) in self.a[3 * i..3 * i + 3].iter_mut().enumerate() {
                a.0[lane] = f64::from(sums[i][j]) - y * f64::from(sums[3][j]);
            }
            self.to_candidate_mean[i].0[lane] = y;
            self.from_mean[i].0[lane] = -f64::from(sums[3][i]) * per;
        }
    }
}

/// `Σ (y, 1)(x, 1)ᵀ` of the members' positions x and candidates y relative to the owner's.
#[inline(always)]
fn sums(pairs: &[Pair], members: &[u32], owner: usize) -> [[f32; 4]; 4] {
    let Pair(owner_q, owner_c) = pairs[owner];
    // The ones stay behind.
    let (owner_q, owner_c) = (owner_q.with_w(0.0), owner_c.with_w(0.0));
    let mut rows = [Vec4::ZERO; 4];
    for &member in members {
        let Pair(q, c) = pairs[member as usize];
        let (x, y) = (q - owner_q, c - owner_c);
        rows[0] += y.xxxx() * x;
        rows[1] += y.yyyy() * x;
        rows[2] += y.zzzz() * x;
        rows[3] += x;
    }
    rows.map(|row| row.to_array())
}
