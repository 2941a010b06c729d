//! Local rigid alignment (Eq. 6): every particle moves as the rigid motion that fits the candidates of its
//! support best.
//!
//! With support means q̄, c and `A = Σ (q̃ − c)(q − q̄)ᵀ`, the aligned position is `R (q − q̄) + c`, `R`
//! being Kabsch's rotation of `A`. All particles are updated from the same positions and candidates (Jacobi
//! style). Differences are taken to the particle itself before means, so that f32 keeps its digits where the
//! support is small and far from the origin. Supports go through SIMD lanes in groups ([`crate::moments`],
//! [`crate::kabsch_lanes`]); the backward pass is in [`crate::align_vjp`].

use crate::kabsch_lanes::{fit_group, matrix, rotated};
use crate::lanes::{GROUP, Lanes, load, store};
use crate::moments::{Group, Pair, pair_up};
use crate::supports::Supports;
use lgs_core::linear::{Mat3, matrix_from_quat};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Groups per task.
pub(crate) const TASK: usize = 8;

/// The result of an alignment, and what its backward pass reads again: 60 bytes per particle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// Aligned positions `[n, 3]`, world units.
    pub aligned: Vec<[f32; 3]>,
    /// Rotation of each support, as unit quaternions `[n, 4]`.
    pub quaternions: Vec<[f32; 4]>,
    /// Positions and candidates.
    pub(crate) pairs: Vec<Pair>,
}

impl Alignment {
    /// Rotation of each support, as matrices `[n, 3, 3]`.
    #[must_use]
    pub fn rotations(&self) -> Vec<Mat3> {
        self.quaternions.iter().map(|&quaternion| matrix_from_quat(quaternion)).collect()
    }

    /// As [`align`], in the arrays of an earlier alignment: large arrays cost as much to allocate as to fill.
    pub fn update(&mut self, position: &[[f32; 3]], candidate: &[[f32; 3]], supports: &Supports) {
        let n = supports.particles();
        assert!(
            position.len() == n && candidate.len() == n,
            "{} positions, {} candidates, {n} supports",
            position.len(),
            candidate.len()
        );
        self.aligned.resize(n, [0.0; 3]);
        self.quaternions.resize(n, [0.0; 4]);
        // Entered once, so that both loops begin on a thread of the pool.
        rayon::scope(|_| self.update_in_pool(position, candidate, supports));
    }

    fn update_in_pool(&mut self, position: &[[f32; 3]], candidate: &[[f32; 3]], supports: &Supports) {
        let arch = Arch::new();
        pair_up(position, candidate, &mut self.pairs);
        let pairs = &self.pairs;
        let groups = self.aligned.par_chunks_mut(GROUP).zip(self.quaternions.par_chunks_mut(GROUP));
        groups.with_min_len(TASK).enumerate().for_each(|(group, (aligned, quaternions))| {
            arch.dispatch(Fit { pairs, supports, first: group * GROUP, aligned, quaternions });
        });
    }
}

/// Aligns candidate positions with the shapes that the supports have at `position`. All arrays are `[n, 3]`,
/// world units.
#[must_use]
pub fn align(position: &[[f32; 3]], candidate: &[[f32; 3]], supports: &Supports) -> Alignment {
    let mut alignment = Alignment::default();
    alignment.update(position, candidate, supports);
    alignment
}

/// Aligned positions and quaternions of a group of supports.
struct Fit<'a> {
    pairs: &'a [Pair],
    supports: &'a Supports,
    first: usize,
    aligned: &'a mut [[f32; 3]],
    quaternions: &'a mut [[f32; 4]],
}

impl WithSimd for Fit<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let group = Group::new(simd, self.pairs, self.supports, self.first);
        let mut rotation = [Lanes::ZERO; 4];
        fit_group(simd, &group.a, &mut rotation);
        let mut moved = [Lanes::ZERO; 3];
        for index in 0..GROUP / S::F64_LANES {
            let from_center =
                rotated(&matrix(&load(simd, &rotation, index)), &load(simd, &group.from_mean, index));
            let center = load(simd, &group.to_candidate_mean, index);
            store(
                &mut moved,
                index,
                [center[0] + from_center[0], center[1] + from_center[1], center[2] + from_center[2]],
            );
        }
        let (mut aligned, mut quaternions) = ([[0.0; 3]; GROUP], [[0.0; 4]; GROUP]);
        for lane in 0..GROUP {
            let Pair(_, candidate) = self.pairs[(self.first + lane).min(self.pairs.len() - 1)];
            for axis in 0..3 {
                aligned[lane][axis] = candidate[axis] + moved[axis].0[lane] as f32;
            }
            for i in 0..4 {
                quaternions[lane][i] = rotation[i].0[lane] as f32;
            }
        }
        self.aligned.copy_from_slice(&aligned[..self.aligned.len()]);
        self.quaternions.copy_from_slice(&quaternions[..self.quaternions.len()]);
    }
}
