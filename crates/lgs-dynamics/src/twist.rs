//! The `Rigid` velocity policy: a support keeps its momentum and its angular momentum, and a particle gets
//! the velocity that its support has there as one rigid body.
//!
//! Velocities belong to the midpoints m = (q₀ + q₁)/2 of steps, and what turns them from one to the next are
//! impulses at q₀, which leave the angular momentum about q₀ alone. With offsets r₀, r of the members from
//! their means at q₀ and m: `L = Σ r₀ × (v − v̄)`, `I = Σ (|r|² − r rᵀ)`, `ω = I⁻¹ L`, and the new velocity
//! is `v̄ + ω × r`. A free body spins for ever. A rigid displacement `q₁ − q₀ = (R − 1) q₀ + t` is a twist of
//! the midpoints exactly, since `(R − 1)(R + 1)⁻¹` is skew (Cayley), and has the same L about both: rigid
//! motions are fixed points of the policy for steps of any size. Degenerate supports keep v.

use crate::supports::Supports;
use lgs_core::geometry::PositiveFactor;
use lgs_core::linear::{add, cross, dot, scale, sub};
use rayon::prelude::*;

const CHUNK: usize = 128;

/// A support's twist.
struct Twist {
    mean_before: [f32; 3],
    mean: [f32; 3],
    mean_velocity: [f32; 3],
    spin: [f32; 3],
    /// None where the support is degenerate.
    inertia: Option<PositiveFactor>,
}

/// Positions before and after a step, and velocities that belong to the first.
struct Motion<'a> {
    before: &'a [[f32; 3]],
    after: &'a [[f32; 3]],
    v: &'a [[f32; 3]],
}

/// Mean of values over members, summed as offsets from the owner's.
fn mean_of(values: &[[f32; 3]], members: &[u32], owner: usize) -> [f32; 3] {
    let origin = values[owner];
    let offset = members.iter().fold([0.0; 3], |sum, &member| add(sum, sub(values[member as usize], origin)));
    add(origin, scale(offset, 1.0 / members.len() as f32))
}

impl Motion<'_> {
    fn twist(&self, members: &[u32], owner: usize) -> Twist {
        let [mean_before, mean, mean_velocity] =
            [self.before, self.after, self.v].map(|values| mean_of(values, members, owner));
        let (mut momentum, mut second) = ([0.0_f32; 3], [0.0_f32; 6]);
        for &member in members {
            let member = member as usize;
            let r = sub(self.after[member], mean);
            momentum = add(
                momentum,
                cross(sub(self.before[member], mean_before), sub(self.v[member], mean_velocity)),
            );
            for (sum, value) in second.iter_mut().zip([
                r[0] * r[0],
                r[1] * r[0],
                r[1] * r[1],
                r[2] * r[0],
                r[2] * r[1],
                r[2] * r[2],
            ]) {
                *sum += value;
            }
        }
        let [xx, yx, yy, zx, zy, zz] = second.map(f64::from);
        let inertia = PositiveFactor::new([yy + zz, -yx, xx + zz, -zx, -zy, xx + yy], xx + yy + zz);
        let spin = inertia.map_or([0.0; 3], |i| i.solve(momentum.map(f64::from)).map(|v| v as f32));
        Twist { mean_before, mean, mean_velocity, spin, inertia }
    }
}

/// Velocities `[n, 3]` of the least-squares twists of the supports at positions `[n, 3]`, each taken at its
/// particle.
///
/// This removes independent noise from fitted starting velocities.
#[must_use]
pub fn rigid_velocities(positions: &[[f32; 3]], v: &[[f32; 3]], supports: &Supports) -> Vec<[f32; 3]> {
    let mut carried = Vec::new();
    Carrier::default().velocities([positions, positions], v, supports, &mut carried);
    carried
}

/// Velocities that supports carry through a step, and their cotangents, in arrays that all steps share.
#[derive(Default)]
pub(crate) struct Carrier {
    pulls: Vec<Pull>,
    /// Cotangents of positions before and after and of the velocities, `[n, 3]` each.
    cotangents: Vec<[[f32; 3]; 3]>,
    midpoints: Vec<[f32; 3]>,
}

impl Carrier {
    /// Velocities at the midpoints between two positions, from momenta about the first.
    pub(crate) fn midway(
        &mut self,
        ends: [&[[f32; 3]]; 2],
        v: &[[f32; 3]],
        supports: &Supports,
        carried: &mut Vec<[f32; 3]>,
    ) {
        let midpoints = self.taken_midpoints(ends);
        self.velocities([ends[0], &midpoints], v, supports, carried);
        self.midpoints = midpoints;
    }

    /// The backward pass of [`Carrier::midway`]: cotangents of the first positions, of the midpoints and of
    /// the velocities.
    pub(crate) fn midway_vjp(
        &mut self,
        ends: [&[[f32; 3]]; 2],
        v: &[[f32; 3]],
        supports: &Supports,
        v_out: &[[f32; 3]],
    ) -> &[[[f32; 3]; 3]] {
        let midpoints = self.taken_midpoints(ends);
        self.velocities_vjp([ends[0], &midpoints], v, supports, v_out);
        self.midpoints = midpoints;
        &self.cotangents
    }

    fn taken_midpoints(&mut self, [q0, q1]: [&[[f32; 3]]; 2]) -> Vec<[f32; 3]> {
        let mut midpoints = std::mem::take(&mut self.midpoints);
        midpoints.clear();
        midpoints.extend(q0.iter().zip(q1).map(|(&a, &b)| add(a, scale(sub(b, a), 0.5))));
        midpoints
    }

    /// Velocities `[n, 3]` after a step that took particles between two positions, each `[n, 3]`, from the
    /// velocities before it.
    fn velocities(
        &mut self,
        ends: [&[[f32; 3]]; 2],
        v: &[[f32; 3]],
        supports: &Supports,
        carried: &mut Vec<[f32; 3]>,
    ) {
        let [before, after] = ends;
        let motion = Motion { before, after, v };
        let own = |owner: usize| {
            let t = motion.twist(supports.members(owner), owner);
            if t.inertia.is_none() {
                motion.v[owner]
            } else {
                add(t.mean_velocity, cross(t.spin, sub(motion.after[owner], t.mean)))
            }
        };
        (0..v.len()).into_par_iter().with_min_len(CHUNK).map(own).collect_into_vec(carried);
    }

    /// The backward pass of [`Carrier::velocities`]: sets the cotangents.
    fn velocities_vjp(
        &mut self,
        ends: [&[[f32; 3]]; 2],
        v: &[[f32; 3]],
        supports: &Supports,
        v_out: &[[f32; 3]],
    ) {
        let per = 1.0 / supports.k() as f32;
        let [before, after] = ends;
        let motion = Motion { before, after, v };
        let pull = |owner: usize| {
            let twist = motion.twist(supports.members(owner), owner);
            let v_arm = cross(v_out[owner], twist.spin);
            let v_spin = cross(sub(after[owner], twist.mean), v_out[owner]);
            let y = twist.inertia.map_or([0.0; 3], |i| i.solve(v_spin.map(f64::from)).map(|v| v as f32));
            Pull { twist, y, v_mean: scale(v_arm, -per), v_mean_velocity: scale(v_out[owner], per) }
        };
        (0..v.len()).into_par_iter().with_min_len(CHUNK).map(pull).collect_into_vec(&mut self.pulls);
        let pulls = &self.pulls;
        let member_vjp = |member: usize| {
            let own = &pulls[member].twist;
            // Kept velocities of degenerate supports pass their cotangent on; such supports send nothing to
            // their members.
            let start = match own.inertia {
                None => [[0.0; 3], [0.0; 3], v_out[member]],
                Some(_) => [[0.0; 3], cross(v_out[member], own.spin), [0.0; 3]],
            };
            supports
                .owners(member)
                .iter()
                .fold(start, |sum, &owner| pulls[owner as usize].onto(&motion, member, sum))
        };
        (0..v.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(member_vjp)
            .collect_into_vec(&mut self.cotangents);
    }
}

/// Cotangents that one support sends back to its members.
struct Pull {
    twist: Twist,
    /// `I⁻¹ ω̄`.
    y: [f32; 3],
    v_mean: [f32; 3],
    v_mean_velocity: [f32; 3],
}

impl Pull {
    /// Adds what this support sends to a member: cotangents of its positions before and after and of its
    /// velocity.
    fn onto(
        &self,
        motion: &Motion<'_>,
        member: usize,
        [v_before, v_after, v_v]: [[f32; 3]; 3],
    ) -> [[f32; 3]; 3] {
        if self.twist.inertia.is_none() {
            return [v_before, v_after, v_v];
        }
        let (y, spin) = (self.y, self.twist.spin);
        let r0 = sub(motion.before[member], self.twist.mean_before);
        let r1 = sub(motion.after[member], self.twist.mean);
        let u = sub(motion.v[member], self.twist.mean_velocity);
        // ω = I⁻¹L: ⟨ω̄, dω⟩ = ⟨y, dL⟩ − yᵀ dI ω
        let of_inertia =
            add(scale(r1, -2.0 * dot(y, spin)), add(scale(y, dot(r1, spin)), scale(spin, dot(y, r1))));
        [
            add(v_before, cross(u, y)),
            add(v_after, add(of_inertia, self.v_mean)),
            add(v_v, add(cross(y, r0), self.v_mean_velocity)),
        ]
    }
}
