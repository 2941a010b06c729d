//! Physical invariants (method §4.3) and cycle errors (method §4.4) on motions with closed forms, realised
//! exactly by quadratic potentials.

mod support;

use lgs_core::linear::{add, dot, mat_vec, matrix_from_quat, norm, quat_normalize, scale, sub};
use lgs_dynamics::{
    Edit, ForceKind, PotentialKind, Reversal, RolloutSpec, State, StateCotangents, Supports, VelocityPolicy,
    align, rollout, rollout_reversed, rollout_vjp,
};
use support::motions::{
    Motion, POLICIES, TAU_MAX, body, cycle_error, half_a_kick_behind, motions, spec, twist_velocities,
};
use support::random_points;

#[test]
fn the_negated_step_misses_by_what_theory_predicts() {
    let all = motions();
    let error = |name: &str, dt| {
        cycle_error(all.iter().find(|m| m.name == name).unwrap(), &spec(dt), Reversal::NegatedStep)
    };
    for (name, dt, expected) in [
        ("free fall from rest", 0.01, 0.026),
        ("free fall from rest", 1.0 / 60.0, 0.043),
        ("fan, spin 2", 0.01, 0.013),
        ("fan, spin 6", 0.01, 0.013),
        ("fan, spin 2", 1.0 / 60.0, 0.0215),
    ] {
        let found = error(name, dt);
        assert!(
            (found / expected - 1.0).abs() < 0.06,
            "{name} at {dt}: {found} where {expected} is predicted"
        );
    }
}

#[test]
fn the_exact_reversal_returns_to_the_start() {
    for motion in motions() {
        let found = cycle_error(&motion, &spec(0.01), Reversal::Exact);
        assert!(found < 1e-5, "{}: {found}", motion.name);
    }
    for force in [ForceKind::Mlp, ForceKind::Structured] {
        let system = support::lively_system(PotentialKind::QuadraticMlp, force);
        let start = State::at_start(random_points(100, 0.5, 1), random_points(100, 0.5, 2));
        let found = cycle_error(
            &Motion { name: "network", system, start, lossy_bound: 0.0 },
            &spec(0.01),
            Reversal::Exact,
        );
        assert!(found < 1e-5, "{force:?}: {found}");
    }
}

#[test]
fn the_exact_reversal_with_alignment_returns_on_rigid_motions() {
    println!("{:22} {:14} {:>12} {:>12}", "motion", "policy", "negated step", "exact");
    for motion in motions() {
        let motion = half_a_kick_behind(&motion, 0.01);
        let supports = Supports::nearest(&motion.start.q, 20);
        for policy in POLICIES {
            let spec = spec(0.01).aligned(&supports, policy);
            let negated = cycle_error(&motion, &spec, Reversal::NegatedStep);
            let exact = cycle_error(&motion, &spec, Reversal::Exact);
            println!(
                "{:22} {:14} {:11.4}% {:11.5}%",
                motion.name,
                format!("{policy:?}"),
                100.0 * negated,
                100.0 * exact
            );
            // Only kept velocities carry what is not rigid through an alignment; the others lose it.
            let bound = if policy == VelocityPolicy::Keep { 1e-4 } else { motion.lossy_bound };
            assert!(exact < bound, "{} {policy:?}: {exact}", motion.name);
        }
    }
}

#[test]
fn uniform_gravity_gives_the_parabola_with_the_integrators_offset() {
    let motion = &motions()[0];
    let end = rollout(&motion.system, &motion.start, &spec(0.01)).pop().unwrap();
    let drop = 0.5 * 9.81 * TAU_MAX * (TAU_MAX + 0.01);
    for (q, q0) in end.q.iter().zip(&motion.start.q) {
        assert!((q[2] - (q0[2] - drop)).abs() < 1e-4, "{q:?}");
        assert_eq!((q[0], q[1]), (q0[0], q0[1]));
    }
}

#[test]
fn a_harmonic_potential_gives_circles() {
    let motion = half_a_kick_behind(&motions()[1], 0.01);
    let radius = |q: &[f32; 3]| q[0].hypot(q[1]);
    for state in rollout(&motion.system, &motion.start, &spec(0.01)) {
        for (q, q0) in state.q.iter().zip(&motion.start.q) {
            assert!((radius(q) - radius(q0)).abs() < 2e-4, "{q:?} {q0:?}");
        }
    }
}

#[test]
fn energy_oscillates_without_a_trend_where_there_is_no_force_and_falls_under_drag() {
    let energy = |motion: &Motion, state: &State| -> f64 {
        let kinetic = |v: &[f32; 3]| 0.5 * f64::from(dot(*v, *v));
        let potentials = motion.system.potentials(&state.q);
        state.v.iter().zip(potentials).map(|(v, u)| kinetic(v) + f64::from(u)).sum()
    };
    let all = motions();
    let turns = rollout(&all[2].system, &all[2].start, &RolloutSpec::new(0.01, 900));
    let start = energy(&all[2], &turns[0]);
    let worst = |states: &[State]| {
        states.iter().map(|s| (energy(&all[2], s) / start - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(
        worst(&turns[..300]) < 0.1 && worst(&turns[600..]) < 1.05 * worst(&turns[..300]),
        "energy drifts"
    );
    let sled = rollout(&all[4].system, &all[4].start, &spec(0.01));
    for pair in sled.windows(2) {
        assert!(energy(&all[4], &pair[1]) < energy(&all[4], &pair[0]), "drag must dissipate");
    }
    let rate = f64::from(norm(sled[75].v[0]) / norm(sled[0].v[0])).ln() / 0.75;
    assert!((rate + 1.2).abs() < 0.02, "damping rate {rate}");
}

#[test]
fn alignment_returns_rigid_motions_exactly_whatever_the_support() {
    let q = body([0.4, -0.2, 1.0], 0.3);
    let turn = quat_normalize([0.9, 0.2, -0.3, 0.1]);
    let r = matrix_from_quat(turn);
    let moved: Vec<[f32; 3]> = q.iter().map(|&p| add(mat_vec(&r, p), [0.1, 0.2, -0.4])).collect();
    for k in [5, 20, 400] {
        let result = align(&q, &moved, &Supports::nearest(&q, k));
        for ((aligned, expected), quaternion) in result.aligned.iter().zip(&moved).zip(&result.quaternions) {
            assert!(norm(sub(*aligned, *expected)) < 5e-6);
            assert!((0..4).all(|i| (quaternion[i] - turn[i]).abs() < 1e-5), "{quaternion:?} {turn:?}");
        }
    }
}

#[test]
fn one_support_of_the_whole_object_keeps_every_distance_while_the_motion_alone_does_not() {
    let system = support::lively_system(PotentialKind::QuadraticMlp, ForceKind::Mlp);
    let q = body([0.0; 3], 0.5);
    let start = State::at_start(q.clone(), vec![[0.5, 0.0, 0.2]; q.len()]);
    let supports = Supports::nearest(&q, q.len());
    let stretch = |spec: &RolloutSpec| {
        let end = rollout(&system, &start, spec).pop().unwrap();
        let distance = |q: &[[f32; 3]], i: usize| norm(sub(q[i], q[i + 1]));
        (0..q.len() - 1).map(|i| (distance(&end.q, i) - distance(&q, i)).abs()).fold(0.0, f32::max)
    };
    assert!(stretch(&spec(0.01).aligned(&supports, VelocityPolicy::Keep)) < 2e-5);
    assert!(stretch(&spec(0.01)) > 0.05);
}

#[test]
fn a_body_that_moves_as_one_returns_exactly_under_any_law() {
    for force in [ForceKind::None, ForceKind::Structured, ForceKind::Mlp] {
        let system = support::lively_system(PotentialKind::QuadraticMlp, force);
        let q = body([0.2, 0.1, 0.0], 0.5)[..50].to_vec();
        let start =
            State::at_start(q.clone(), twist_velocities(&q, [0.4, -0.8, 2.0], [0.0; 3], [0.3, 0.1, -0.2]));
        let n = q.len() as u32;
        let supports = Supports::from_rows((0..n * n).map(|i| i % n).collect(), q.len()).unwrap();
        let motion = Motion { name: "one body", system, start, lossy_bound: 0.0 };
        let found =
            cycle_error(&motion, &spec(0.01).aligned(&supports, VelocityPolicy::Rigid), Reversal::Exact);
        assert!(found < 5e-5, "{force:?}: {found}");
    }
}

#[test]
fn rotations_accumulate_the_spin_and_return() {
    let motion = half_a_kick_behind(&motions()[1], 0.01);
    let supports = Supports::nearest(&motion.start.q, 20);
    let spec = spec(0.01).aligned(&supports, VelocityPolicy::Keep);
    let end = rollout(&motion.system, &motion.start, &spec).pop().unwrap();
    let back = rollout_reversed(&motion.system, &end, &spec, Reversal::Exact).pop().unwrap();
    for (r, b) in end.rotation.iter().zip(&back.rotation) {
        let angle = 2.0 * r[3].atan2(r[0]);
        assert!((angle - 1.5).abs() < 2e-3, "{angle}");
        assert!(b[0] > 1.0 - 1e-6);
    }
}

#[test]
fn edits_scale_what_they_name_and_ones_change_no_bit() {
    let system = support::lively_system(PotentialKind::QuadraticMlp, ForceKind::Structured);
    let (q, v) = (random_points(70, 0.5, 1), random_points(70, 0.5, 2));
    let start = State::at_start(q.clone(), v.clone());
    let ones = Edit { velocity_scale: 1.0, potential_scale: 1.0, force_scale: 1.0 };
    assert_eq!(rollout(&system, &start, &spec(0.01)), rollout(&system, &start, &spec(0.01).edited(ones)));
    let edit = Edit { velocity_scale: 0.5, potential_scale: 2.0, force_scale: 0.25 };
    let (gradient, force) = (system.potential_gradients(&q), system.forces(&q, &v));
    for (i, a) in system.accelerations(&q, &v, &edit).into_iter().enumerate() {
        let expected = sub(scale(force[i], 0.25), scale(gradient[i], 2.0));
        assert!(norm(sub(a, expected)) < 1e-5 * (1.0 + norm(expected)));
    }
    assert_eq!(
        rollout(&system, &start, &spec(0.01).edited(edit))[0].v,
        v.iter().map(|&v| scale(v, 0.5)).collect::<Vec<_>>()
    );
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let system = support::lively_system(PotentialKind::QuadraticMlp, ForceKind::Structured);
    let (q, v) = (random_points(1500, 0.5, 1), random_points(1500, 0.5, 2));
    let supports = Supports::nearest(&q, 12);
    let start = State::at_start(q, v);
    for spec in
        [RolloutSpec::new(0.01, 10), RolloutSpec::new(0.01, 10).aligned(&supports, VelocityPolicy::Rigid)]
    {
        let run = || {
            let states = rollout(&system, &start, &spec);
            let cotangents: Vec<_> = states
                .iter()
                .map(|s| StateCotangents { q: s.v.clone(), ..StateCotangents::default() })
                .collect();
            let gradients = rollout_vjp(&system, &spec, &states, &cotangents);
            (rollout_reversed(&system, &states[10], &spec, Reversal::Exact), states, gradients)
        };
        let threads = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(run);
        let (one, two) = (threads(1), threads(2));
        assert!(one == two && one == threads(5));
    }
}
