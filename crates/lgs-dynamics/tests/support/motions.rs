//! Motions with closed forms, realised exactly by quadratic potentials, and their cycle errors.

use super::{lively_system, random_points};
use lgs_core::linear::{add, cross, norm, scale, sub};
use lgs_dynamics::testing::linear_law;
use lgs_dynamics::{
    Edit, ForceKind, PotentialKind, Reversal, RolloutSpec, State, System, VelocityPolicy, rollout,
    rollout_reversed,
};

pub(crate) const TAU_MAX: f32 = 0.75;
pub(crate) const POLICIES: [VelocityPolicy; 3] =
    [VelocityPolicy::Keep, VelocityPolicy::FromPositions, VelocityPolicy::Rigid];

fn gravity() -> System {
    linear_law([0.0, 0.0, 9.81], [0.0; 6], 0.0, [0.0; 3])
}

fn harmonic(omega: f32) -> System {
    linear_law([0.0; 3], [omega * omega, omega * omega, 0.0, 0.0, 0.0, 0.0], 0.0, [0.0; 3])
}

/// A solid body: points of a box around `center`.
pub(crate) fn body(center: [f32; 3], half: f32) -> Vec<[f32; 3]> {
    random_points(400, half, 5).into_iter().map(|p| std::array::from_fn(|i| p[i] + center[i])).collect()
}

/// Velocities of a rigid motion: `v` at `about`, and a spin.
pub(crate) fn twist_velocities(
    q: &[[f32; 3]],
    spin: [f32; 3],
    about: [f32; 3],
    v: [f32; 3],
) -> Vec<[f32; 3]> {
    q.iter().map(|&q| add(v, cross(spin, sub(q, about)))).collect()
}

pub(crate) struct Motion {
    pub(crate) name: &'static str,
    pub(crate) system: System,
    pub(crate) start: State,
    /// Bound of the exact reversal's cycle error under the policies that lose what is not rigid.
    pub(crate) lossy_bound: f64,
}

pub(crate) fn motions() -> Vec<Motion> {
    let fall = body([0.2, 0.1, 2.0], 0.3);
    let rest = vec![[0.0; 3]; fall.len()];
    let blade = body([0.5, 0.0, 0.3], 0.4);
    let turning = |spin: f32| twist_velocities(&blade, [0.0, 0.0, spin], [0.0; 3], [0.0; 3]);
    let thrown = body([-1.0, 0.0, 0.5], 0.25);
    let v_thrown = twist_velocities(&thrown, [0.0, 0.0, 4.0], [-1.0, 0.0, 0.5], [1.5, 0.4, 3.0]);
    let drifting = vec![[0.3, 0.2, 0.1]; fall.len()];
    let sliding = vec![[1.5, 0.5, 0.0]; thrown.len()];
    let motion = |name, system, q: &[[f32; 3]], v, lossy_bound| Motion {
        name,
        system,
        start: State::at_start(q.to_vec(), v),
        lossy_bound,
    };
    // a = g + ω × (v − v_c), v_c being the centre's velocity: its part along ω, which changes, drops out, so
    // the field is autonomous.
    let carried = [-4.0 * 0.4, 4.0 * 1.5, 9.81];
    vec![
        motion("free fall from rest", gravity(), &fall, rest, 1e-4),
        motion("fan, spin 2", harmonic(2.0), &blade, turning(2.0), 1e-4),
        motion("fan, spin 6", harmonic(6.0), &blade, turning(6.0), 1e-4),
        // The explicit gyroscopic kick lets speeds grow by (ω h)²/2 per step, which is not rigid.
        motion(
            "projectile with spin",
            linear_law(carried, [0.0; 6], 0.0, [0.0, 0.0, 4.0]),
            &thrown,
            v_thrown,
            0.01,
        ),
        motion("sled with drag", linear_law([0.0; 3], [0.0; 6], 1.2, [0.0; 3]), &thrown, sliding, 1e-4),
        motion(
            "network, not rigid",
            lively_system(PotentialKind::QuadraticMlp, ForceKind::Structured),
            &fall,
            drifting,
            0.05,
        ),
    ]
}

pub(crate) fn path_length(states: &[State]) -> f64 {
    let step =
        |w: &[State]| w[0].q.iter().zip(&w[1].q).map(|(&a, &b)| f64::from(norm(sub(a, b)))).sum::<f64>();
    states.windows(2).map(step).sum()
}

/// Forward to τ_max and back: distance from the start over the path travelled (method §7).
pub(crate) fn cycle_error(motion: &Motion, spec: &RolloutSpec, reversal: Reversal) -> f64 {
    let forward = rollout(&motion.system, &motion.start, spec);
    let back = rollout_reversed(&motion.system, &forward[forward.len() - 1], spec, reversal);
    let end = &back[back.len() - 1];
    let miss: f64 = end.q.iter().zip(&motion.start.q).map(|(&a, &b)| f64::from(norm(sub(a, b)))).sum();
    miss / path_length(&forward)
}

pub(crate) fn spec(dt: f32) -> RolloutSpec<'static> {
    RolloutSpec::new(dt, (TAU_MAX / dt).round() as usize)
}

/// The start that stays on a rigid motion of the discrete flow: velocities half a kick behind
/// (method §4.3).
pub(crate) fn half_a_kick_behind(motion: &Motion, dt: f32) -> Motion {
    let a = motion.system.accelerations(&motion.start.q, &motion.start.v, &Edit::default());
    let v = motion.start.v.iter().zip(a).map(|(&v, a)| sub(v, scale(a, 0.5 * dt))).collect();
    Motion { system: motion.system.clone(), start: State::at_start(motion.start.q.clone(), v), ..*motion }
}
