//! The backward pass of the alignment.
//!
//! First every support works out what it sends to its members ([`Pull`]), in the lanes of the forward pass:
//! `A` is summed again and its curvature inverted at the rotation that was found, so nothing but positions
//! and results is kept. Then every particle gathers over the supports that it belongs to, in ascending order,
//! instead of scattering: no result depends on the number of threads.

use crate::align::{Alignment, TASK};
use crate::kabsch_lanes::{cross, matrix, pulled_back, rotated, rotated_back, solve};
use crate::lanes::{GROUP, Lanes, load, splat, store};
use crate::moments::{AHEAD, Group, Pair};
use crate::supports::Supports;
use glam::{Vec4, Vec4Swizzles, vec4};
use lgs_core::linear::{Mat3, mat_mul, transpose};
use lgs_core::prefetch::prefetch;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Cotangents that one support sends to a member at x and, among the candidates, at y, relative to its owner:
/// the rows `(V, b)` give `V x + b` for the member's candidate, their transpose with the row `d` gives `Vᵀ y
/// + d` for its position, `V` being the cotangent of `A`.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
struct Pull([Vec4; 4]);

/// The result of a backward pass, and arrays that the next one uses again.
#[derive(Debug, Default)]
pub struct AlignmentVjp {
    /// Cotangents of the positions `[n, 3]`.
    pub v_position: Vec<[f32; 3]>,
    /// Cotangents of the candidates `[n, 3]`.
    pub v_candidate: Vec<[f32; 3]>,
    pulls: Vec<[Pull; GROUP]>,
}

/// The backward pass of [`crate::align()`]: cotangents of its positions and candidates, given those of the
/// aligned positions `[n, 3]` and of the rotation matrices `[n, 3, 3]` (empty: zero).
#[must_use]
pub fn align_vjp(
    supports: &Supports,
    alignment: &Alignment,
    v_aligned: &[[f32; 3]],
    v_rotations: &[Mat3],
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let v_turns: Vec<[f32; 3]> = v_rotations
        .iter()
        .zip(alignment.rotations())
        .map(|(v, rotation)| turn_of_matrix(&rotation, v))
        .collect();
    let mut vjp = AlignmentVjp::default();
    vjp.update(supports, alignment, v_aligned, &v_turns);
    (vjp.v_position, vjp.v_candidate)
}

/// The cotangent of a small turn θ in `R exp([θ]×)` given that of the matrix: `vex(RᵀḠ − ḠᵀR)`.
fn turn_of_matrix(r: &Mat3, v_r: &Mat3) -> [f32; 3] {
    let x = mat_mul(&transpose(r), v_r);
    [x[2][1] - x[1][2], x[0][2] - x[2][0], x[1][0] - x[0][1]]
}

impl AlignmentVjp {
    /// As [`align_vjp`], in the arrays of an earlier pass, with the rotations' cotangents given as those of a
    /// small turn in body axes (empty: zero).
    pub fn update(
        &mut self,
        supports: &Supports,
        alignment: &Alignment,
        v_aligned: &[[f32; 3]],
        v_turns: &[[f32; 3]],
    ) {
        let n = supports.particles();
        assert_eq!(v_aligned.len(), n, "cotangents of the aligned positions");
        assert!(v_turns.is_empty() || v_turns.len() == n, "{} cotangents of {n} rotations", v_turns.len());
        self.pulls.resize(n.div_ceil(GROUP), [Pull::default(); GROUP]);
        self.v_position.resize(n, [0.0; 3]);
        self.v_candidate.resize(n, [0.0; 3]);
        // Entered once, so that both loops begin on a thread of the pool.
        rayon::scope(|_| self.update_in_pool(supports, alignment, [v_aligned, v_turns]));
    }

    fn update_in_pool(
        &mut self,
        supports: &Supports,
        alignment: &Alignment,
        [v_aligned, v_turns]: [&[[f32; 3]]; 2],
    ) {
        let arch = Arch::new();
        let groups = self
            .pulls
            .par_iter_mut()
            .zip(self.v_position.par_chunks_mut(GROUP))
            .with_min_len(TASK)
            .enumerate();
        groups.for_each(|(group, (pulls, own))| {
            arch.dispatch(PullBack {
                supports,
                alignment,
                v_aligned,
                v_turns,
                first: group * GROUP,
                pulls,
                own,
            });
        });
        let (pulls, pairs) = (self.pulls.as_flattened(), &alignment.pairs[..]);
        let members = self.v_position.par_chunks_mut(GROUP).zip(self.v_candidate.par_chunks_mut(GROUP));
        members.with_min_len(TASK).enumerate().for_each(|(group, (v_position, v_candidate))| {
            arch.dispatch(Gather { supports, pairs, pulls, first: group * GROUP, v_position, v_candidate });
        });
    }
}

/// Cotangents of the positions and candidates of a group of members; those of the positions come with what
/// only the own support sends.
struct Gather<'a> {
    supports: &'a Supports,
    pairs: &'a [Pair],
    pulls: &'a [Pull],
    first: usize,
    v_position: &'a mut [[f32; 3]],
    v_candidate: &'a mut [[f32; 3]],
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for &owner in self.supports.owner_arrivals(self.first / GROUP + AHEAD) {
            prefetch::<S, Pair, false>(simd, self.pairs.get(owner as usize));
            prefetch::<S, Pull, false>(simd, self.pulls.get(owner as usize));
        }
        for (member, (v_position, v_candidate)) in
            (self.first..).zip(self.v_position.iter_mut().zip(self.v_candidate))
        {
            let Pair(v_q, v_c) =
                gather(self.pulls, self.pairs, self.supports.owners(member), member, *v_position);
            (*v_position, *v_candidate) = (v_q.xyz().to_array(), v_c.xyz().to_array());
        }
    }
}

/// Cotangents of a member's position and candidate: what its owners send, on top of what its `own` support
/// sends to it alone.
#[inline(always)]
fn gather(pulls: &[Pull], pairs: &[Pair], owners: &[u32], member: usize, own: [f32; 3]) -> Pair {
    let Pair(q, c) = pairs[member];
    // Less the owner's one, a one is left.
    let (q, c) = (q.with_w(2.0), c.with_w(2.0));
    let mut v_q = vec4(own[0], own[1], own[2], 0.0);
    // Of the candidate, one row per axis whose lanes are summed at the end.
    let mut rows = [Vec4::ZERO; 3];
    for &owner in owners {
        let (Pull(pull), Pair(owner_q, owner_c)) = (pulls[owner as usize], pairs[owner as usize]);
        let (x, y) = (q - owner_q, c - owner_c);
        v_q = v_q + pull[0] * y.xxxx() + pull[1] * y.yyyy() + pull[2] * y.zzzz() + pull[3];
        rows[0] += pull[0] * x;
        rows[1] += pull[1] * x;
        rows[2] += pull[2] * x;
    }
    let sum = |row: Vec4| (row.x + row.y) + (row.z + row.w);
    Pair(v_q, vec4(sum(rows[0]), sum(rows[1]), sum(rows[2]), 0.0))
}

/// Cotangents that a group of supports sends to its members, and to its owners alone.
struct PullBack<'a> {
    supports: &'a Supports,
    alignment: &'a Alignment,
    v_aligned: &'a [[f32; 3]],
    v_turns: &'a [[f32; 3]],
    first: usize,
    pulls: &'a mut [Pull; GROUP],
    own: &'a mut [[f32; 3]],
}

/// Cotangents that come down to a group, and its rotations.
struct Given {
    rotation: [Lanes; 4],
    v_aligned: [Lanes; 3],
    v_turn: [Lanes; 3],
    /// The inverse of the size of a support.
    per_member: f64,
}

/// Cotangents that go out of a group.
struct Sent {
    /// `V`, row by row.
    v_a: [Lanes; 9],
    to_candidate: [Lanes; 3],
    to_position: [Lanes; 3],
    to_owner: [Lanes; 3],
}

impl PullBack<'_> {
    #[inline(always)]
    fn given(&self) -> Given {
        let mut given = Given {
            rotation: [Lanes::ZERO; 4],
            v_aligned: [Lanes::ZERO; 3],
            v_turn: [Lanes::ZERO; 3],
            per_member: 1.0 / self.supports.k() as f64,
        };
        let group = self.first..(self.first + GROUP).min(self.v_aligned.len());
        fill(&mut given.rotation, &self.alignment.quaternions[group.clone()]);
        fill(&mut given.v_aligned, &self.v_aligned[group.clone()]);
        fill(&mut given.v_turn, self.v_turns.get(group).unwrap_or_default());
        given
    }
}

/// Sets lanes from rows.
#[inline(always)]
fn fill<const D: usize>(lanes: &mut [Lanes; D], rows: &[[f32; D]]) {
    for (lane, row) in rows.iter().enumerate().take(GROUP) {
        for (lanes, &value) in lanes.iter_mut().zip(row) {
            lanes.0[lane] = f64::from(value);
        }
    }
}

/// Vector number `index` of what goes out: aligned = R d + c, and ⟨v, R [e]× d⟩ = e · (d × Rᵀv).
#[inline(always)]
fn send<S: Simd>(simd: S, group: &Group, given: &Given, index: usize, sent: &mut Sent) {
    let (zero, per) = (splat(simd, 0.0), splat(simd, given.per_member));
    let r = matrix(&load(simd, &given.rotation, index));
    let (d, c) = (load(simd, &group.from_mean, index), load(simd, &group.to_candidate_mean, index));
    let (v, v_turn) = (load(simd, &given.v_aligned, index), load(simd, &given.v_turn, index));
    let v_offset = rotated_back(&r, &v);
    let of_offset = cross(d, v_offset);
    let k = pulled_back(&load(simd, &group.a, index), &r);
    let (y, certified) =
        solve(&k, [v_turn[0] + of_offset[0], v_turn[1] + of_offset[1], v_turn[2] + of_offset[2]]);
    let y = [certified.select(y[0], zero), certified.select(y[1], zero), certified.select(y[2], zero)];
    // V = R [y]×, whose rows are those of R times y.
    let rows = [cross([r[0], r[1], r[2]], y), cross([r[3], r[4], r[5]], y), cross([r[6], r[7], r[8]], y)];
    let v_a = [
        rows[0][0], rows[0][1], rows[0][2], rows[1][0], rows[1][1], rows[1][2], rows[2][0], rows[2][1],
        rows[2][2],
    ];
    // A member is x + d from the mean, its candidate y − c.
    let (of_d, of_c) = (rotated(&v_a, &d), rotated_back(&v_a, &c));
    store(&mut sent.v_a, index, v_a);
    store(
        &mut sent.to_candidate,
        index,
        [v[0].mul_add(per, of_d[0]), v[1].mul_add(per, of_d[1]), v[2].mul_add(per, of_d[2])],
    );
    let less = zero - per;
    let to_position =
        [v_offset[0] * less - of_c[0], v_offset[1] * less - of_c[1], v_offset[2] * less - of_c[2]];
    store(&mut sent.to_position, index, to_position);
    store(&mut sent.to_owner, index, v_offset);
}

impl WithSimd for PullBack<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let group = Group::new(simd, &self.alignment.pairs, self.supports, self.first);
        let (given, zero) = (self.given(), [Lanes::ZERO; 3]);
        let mut sent = Sent { v_a: [Lanes::ZERO; 9], to_candidate: zero, to_position: zero, to_owner: zero };
        for index in 0..GROUP / S::F64_LANES {
            send(simd, &group, &given, index, &mut sent);
        }
        let ([ax, ay, az, bx, by, bz, cx, cy, cz], [x, y, z]) = (&sent.v_a, &sent.to_candidate);
        let ([px, py, pz], [ox, oy, oz], none) = (&sent.to_position, &sent.to_owner, &Lanes::ZERO);
        for (lane, pull) in self.pulls.iter_mut().enumerate() {
            *pull = Pull(
                [[ax, ay, az, x], [bx, by, bz, y], [cx, cy, cz, z], [px, py, pz, none]]
                    .map(|lanes| row(lanes, lane)),
            );
        }
        for (lane, own) in self.own.iter_mut().enumerate().take(GROUP) {
            *own = [ox.0[lane] as f32, oy.0[lane] as f32, oz.0[lane] as f32];
        }
    }
}

/// One lane of four numbers.
#[inline(always)]
fn row([x, y, z, w]: [&Lanes; 4], lane: usize) -> Vec4 {
    vec4(x.0[lane] as f32, y.0[lane] as f32, z.0[lane] as f32, w.0[lane] as f32)
}
