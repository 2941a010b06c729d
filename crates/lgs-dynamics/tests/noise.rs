//! The response of rollouts with local rigid alignment (method §4.6) to noise in the starting velocities.

mod support;

use lgs_core::linear::{add, norm, sub};
use lgs_dynamics::{Reversal, RolloutSpec, Supports, VelocityPolicy, rigid_velocities, rollout};
use support::motions::{Motion, POLICIES, cycle_error, half_a_kick_behind, motions, path_length, spec};
use support::random_points;

/// A motion whose starting velocities carry independent noise.
fn noisy(motion: usize, noise: f32) -> Motion {
    let mut motion = half_a_kick_behind(&motions()[motion], 0.01);
    let n = motion.start.len();
    for (v, e) in motion.start.v.iter_mut().zip(random_points(n, noise, 8)) {
        *v = add(*v, e);
    }
    motion
}

/// Mean distance from the closed form at 3 τ_max over the path, for a fan (spin 6) whose starting velocities
/// carry independent noise.
fn fan_error_at_the_end(noise: f32, supports: Option<&Supports>, policy: VelocityPolicy) -> f64 {
    let motion = noisy(2, noise);
    let plain = RolloutSpec::new(0.01, 225);
    let states =
        rollout(&motion.system, &motion.start, &supports.map_or(plain, |s| plain.aligned(s, policy)));
    // Symplectic Euler turns by 2 asin(h ω / 2) per step.
    let (sin, cos) = (450.0 * (0.03_f64).asin()).sin_cos();
    let turned = |q: [f32; 3]| {
        [(cos as f32) * q[0] - (sin as f32) * q[1], (sin as f32) * q[0] + (cos as f32) * q[1], q[2]]
    };
    let miss: f64 =
        states[225].q.iter().zip(&motion.start.q).map(|(&q, &q0)| f64::from(norm(sub(q, turned(q0))))).sum();
    miss / path_length(&states)
}

#[test]
fn alignment_averages_the_noise_of_long_rollouts_away() {
    let supports = Supports::nearest(&motions()[2].start.q, 20);
    for noise in [0.0, 0.1, 0.5] {
        let without = fan_error_at_the_end(noise, None, VelocityPolicy::Keep);
        let with = POLICIES.map(|policy| fan_error_at_the_end(noise, Some(&supports), policy));
        println!(
            "noise {noise}: none {:.4}% keep {:.4}% from-positions {:.4}% rigid {:.4}%",
            100.0 * without,
            100.0 * with[0],
            100.0 * with[1],
            100.0 * with[2]
        );
        for error in with {
            assert!(error < 0.002 + 0.5 * without, "{error} where {without} is found without alignment");
        }
    }
}

#[test]
fn kept_velocities_come_back_through_alignment_in_spite_of_noise() {
    for which in [1, 2, 3] {
        let motion = noisy(which, 0.1);
        let supports = Supports::nearest(&motion.start.q, 20);
        let error =
            cycle_error(&motion, &spec(0.01).aligned(&supports, VelocityPolicy::Keep), Reversal::Exact);
        assert!(error < 5e-4, "{}: {error}", motion.name);
    }
}

#[test]
fn starting_velocities_projected_again_and_again_lose_their_noise() {
    let mut motion = noisy(2, 0.1);
    let supports = Supports::nearest(&motion.start.q, 20);
    let error = |motion: &Motion| {
        let end = rollout(
            &motion.system,
            &motion.start,
            &RolloutSpec::new(0.01, 225).aligned(&supports, VelocityPolicy::Keep),
        )
        .pop()
        .unwrap();
        let clean = half_a_kick_behind(&motions()[2], 0.01);
        let expected = rollout(&clean.system, &clean.start, &RolloutSpec::new(0.01, 225)).pop().unwrap();
        end.q.iter().zip(&expected.q).map(|(&a, &b)| f64::from(norm(sub(a, b)))).sum::<f64>()
    };
    let before = error(&motion);
    // One projection averages over a support; repeated ones spread over the body.
    for _ in 0..30 {
        motion.start.v = rigid_velocities(&motion.start.q, &motion.start.v, &supports);
    }
    let after = error(&motion);
    println!("miss {before} with noisy starting velocities, {after} projected");
    assert!(after < 0.6 * before);
}
