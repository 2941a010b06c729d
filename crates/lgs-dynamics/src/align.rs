//! Local rigid alignment (Eq. 6): every particle moves as the rigid motion that fits the candidates of its support best.
//!
//! With support means q̄, c and `A = Σ (q̃ − c)(q − q̄)ᵀ`, the aligned position is `R (q − q̄) + c`, `R` being Kabsch's rotation of `A`. All
//! particles are updated from the same positions and candidates (Jacobi style). Differences are taken to the particle itself before means,
//! so that f32 keeps its digits where the support is small and far from the origin. The backward pass gathers over the supports that a
//! particle belongs to, in the order of slots, instead of scattering: no result depends on the number of threads.

use crate::kabsch::{Cholesky, Fit, Mat3d, fit, mat_mul, matrix_from_quat_f64, skew};
use crate::supports::Supports;
use lgs_core::linear::{Mat3, add, cross, mat_vec, matrix_from_quat, sub, transpose};
use rayon::prelude::*;

/// Particles per task.
const CHUNK: usize = 128;

/// The result of an alignment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// Aligned positions `[n, 3]`, world units.
    pub aligned: Vec<[f32; 3]>,
    /// Rotation of each support, as unit quaternions `[n, 4]`.
    pub quaternions: Vec<[f32; 4]>,
    /// By slot of the supports.
    fits: Vec<Fit>,
}

impl Alignment {
    /// Rotation of each support, as matrices `[n, 3, 3]`.
    #[must_use]
    pub fn rotations(&self) -> Vec<Mat3> {
        self.quaternions.iter().map(|&quaternion| matrix_from_quat(quaternion)).collect()
    }
}

fn rotation_matrix(fit: &Fit) -> Mat3 {
    matrix_from_quat_f64(fit.rotation).map(|row| row.map(|v| v as f32))
}

/// A support at one time, relative to its owner.
struct Moments {
    /// Owner minus support mean, at the start of the step.
    from_mean: [f32; 3],
    /// Support mean minus owner, of the candidates.
    to_candidate_mean: [f32; 3],
    /// `Σ (q̃ − c)(q − q̄)ᵀ`.
    a: Mat3d,
}

fn moments(position: &[[f32; 3]], candidate: &[[f32; 3]], members: &[u32], owner: usize) -> Moments {
    let (q, c) = (position[owner], candidate[owner]);
    let (mut q_sum, mut c_sum, mut a) = ([0.0_f32; 3], [0.0_f32; 3], [[0.0_f32; 3]; 3]);
    for &member in members {
        let x = sub(position[member as usize], q);
        let y = sub(candidate[member as usize], c);
        for i in 0..3 {
            q_sum[i] += x[i];
            c_sum[i] += y[i];
            for j in 0..3 {
                a[i][j] += y[i] * x[j];
            }
        }
    }
    let per = 1.0 / members.len() as f32;
    // Σ (y − ȳ)(x − x̄)ᵀ = Σ y xᵀ − k ȳ x̄ᵀ; both terms are of the support's own size, as the owner is one of its points.
    let a =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(a[i][j]) - f64::from(c_sum[i]) * f64::from(q_sum[j]) * f64::from(per)));
    Moments { from_mean: q_sum.map(|v| -v * per), to_candidate_mean: c_sum.map(|v| v * per), a }
}

/// Aligns candidate positions with the shapes that the supports have at `position`. All arrays are `[n, 3]`, world units.
#[must_use]
pub fn align(position: &[[f32; 3]], candidate: &[[f32; 3]], supports: &Supports) -> Alignment {
    let n = supports.particles();
    assert!(position.len() == n && candidate.len() == n, "{} positions, {} candidates, {n} supports", position.len(), candidate.len());
    let (position, candidate) = (supports.to_slots(position), supports.to_slots(candidate));
    let mut result = Alignment { aligned: vec![[0.0; 3]; n], quaternions: vec![[0.0; 4]; n], fits: vec![IDENTITY; n] };
    let chunks = result.aligned.par_chunks_mut(CHUNK).zip(result.quaternions.par_chunks_mut(CHUNK)).zip(result.fits.par_chunks_mut(CHUNK));
    chunks.enumerate().for_each(|(chunk, ((aligned, quaternions), fits))| {
        for (at, ((aligned, quaternion), own)) in aligned.iter_mut().zip(quaternions).zip(fits).enumerate() {
            let owner = chunk * CHUNK + at;
            let m = moments(&position, &candidate, supports.slot_members(owner), owner);
            *own = fit(&m.a);
            *quaternion = own.rotation.map(|v| v as f32);
            let from_center = mat_vec(&rotation_matrix(own), m.from_mean);
            *aligned = add(candidate[owner], add(m.to_candidate_mean, from_center));
        }
    });
    result.aligned = supports.to_particles(&result.aligned);
    result.quaternions = supports.to_particles(&result.quaternions);
    result
}

const IDENTITY: Fit = Fit { rotation: [1.0, 0.0, 0.0, 0.0], curvature: None };

/// What one support sends back to its members.
struct Pull {
    /// Cotangent of `A`.
    v_a: Mat3,
    mean: [f32; 3],
    candidate_mean: [f32; 3],
    /// Cotangents of the means, per member.
    v_candidate: [f32; 3],
    v_position: [f32; 3],
}

/// Backwards through [`align`]: cotangents of `position` and `candidate`, given those of the aligned positions `[n, 3]` and of the rotation
/// matrices `[n, 3, 3]` (empty: zero).
#[must_use]
pub fn align_vjp(
    position: &[[f32; 3]],
    candidate: &[[f32; 3]],
    supports: &Supports,
    alignment: &Alignment,
    v_aligned: &[[f32; 3]],
    v_rotations: &[Mat3],
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let v_turns: Vec<[f32; 3]> = v_rotations.iter().zip(alignment.rotations()).map(|(v, rotation)| turn_of_matrix(&rotation, v)).collect();
    align_turns_vjp(position, candidate, supports, alignment, v_aligned, &v_turns)
}

/// The cotangent of a small turn θ in `R exp([θ]×)` given that of the matrix: `vex(RᵀḠ − ḠᵀR)`.
fn turn_of_matrix(r: &Mat3, v_r: &Mat3) -> [f32; 3] {
    let x = lgs_core::linear::mat_mul(&transpose(r), v_r);
    [x[2][1] - x[1][2], x[0][2] - x[2][0], x[1][0] - x[0][1]]
}

/// [`align_vjp`] with the rotations' cotangents given as those of a small turn in body axes (empty: zero).
pub(crate) fn align_turns_vjp(
    position: &[[f32; 3]],
    candidate: &[[f32; 3]],
    supports: &Supports,
    alignment: &Alignment,
    v_aligned: &[[f32; 3]],
    v_turns: &[[f32; 3]],
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let n = supports.particles();
    let [position, candidate, v_aligned] = &[position, candidate, v_aligned].map(|values| supports.to_slots(values));
    let v_turns = if v_turns.is_empty() { Vec::new() } else { supports.to_slots(v_turns) };
    let pull = |owner: usize| {
        let m = moments(position, candidate, supports.slot_members(owner), owner);
        let v_turn = v_turns.get(owner).copied().unwrap_or_default();
        pull_of(&alignment.fits[owner], &m, position[owner], candidate[owner], v_aligned[owner], v_turn, supports.k())
    };
    let pulls: Vec<Pull> = (0..n).into_par_iter().with_min_len(CHUNK).map(pull).collect();
    let (mut v_position, mut v_candidate) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    let chunks = v_position.par_chunks_mut(CHUNK).zip(v_candidate.par_chunks_mut(CHUNK)).enumerate();
    chunks.for_each(|(chunk, (v_position, v_candidate))| {
        for (at, (v_q, v_c)) in v_position.iter_mut().zip(v_candidate).enumerate() {
            let member = chunk * CHUNK + at;
            // The aligned position turns with its own offset from the mean.
            *v_q = mat_vec(&transpose(&rotation_matrix(&alignment.fits[member])), v_aligned[member]);
            for &owner in supports.slot_owners(member) {
                let p = &pulls[owner as usize];
                let (x, y) = (sub(position[member], p.mean), sub(candidate[member], p.candidate_mean));
                for i in 0..3 {
                    v_c[i] += p.v_a[i][0] * x[0] + p.v_a[i][1] * x[1] + p.v_a[i][2] * x[2] + p.v_candidate[i];
                    v_q[i] += p.v_a[0][i] * y[0] + p.v_a[1][i] * y[1] + p.v_a[2][i] * y[2] + p.v_position[i];
                }
            }
        }
    });
    (supports.to_particles(&v_position), supports.to_particles(&v_candidate))
}

fn pull_of(fit: &Fit, m: &Moments, q: [f32; 3], candidate: [f32; 3], v_aligned: [f32; 3], v_turn: [f32; 3], k: usize) -> Pull {
    let rotation = rotation_matrix(fit);
    let v_offset = mat_vec(&transpose(&rotation), v_aligned);
    // aligned = R d + c, and ⟨v, R [e]× d⟩ = e · (d × Rᵀv)
    let v_turn = add(v_turn, cross(m.from_mean, v_offset));
    let y = fit.curvature.map_or([0.0; 3], |curvature: Cholesky| curvature.solve(v_turn.map(f64::from)));
    let v_a = mat_mul(&matrix_from_quat_f64(fit.rotation), &skew(y)).map(|row| row.map(|v| v as f32));
    let per = 1.0 / k as f32;
    Pull {
        v_a,
        mean: sub(q, m.from_mean),
        candidate_mean: add(candidate, m.to_candidate_mean),
        v_candidate: v_aligned.map(|v| v * per),
        v_position: v_offset.map(|v| -v * per),
    }
}
