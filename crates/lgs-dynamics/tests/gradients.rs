//! Every backward pass against finite differences along random directions.

mod support;

use lgs_dynamics::{
    Edit, ForceKind, PotentialKind, RolloutSpec, State, StateCotangents, Supports, System, VelocityPolicy,
    acceleration_vjp, align, align_vjp, rollout, rollout_vjp,
};
use rand::RngExt;
use support::{inner, lively_system, random_points};

const KINDS: [(PotentialKind, ForceKind); 4] = [
    (PotentialKind::Mlp, ForceKind::None),
    (PotentialKind::Mlp, ForceKind::Mlp),
    (PotentialKind::QuadraticMlp, ForceKind::Structured),
    (PotentialKind::QuadraticMlp, ForceKind::Mlp),
];

const EDIT: Edit = Edit { velocity_scale: 0.8, potential_scale: 1.3, force_scale: 0.7 };

fn direction(len: usize, seed: u64) -> Vec<f32> {
    let mut rng = lgs_core::stream(seed, "direction", 0);
    (0..len).map(|_| 2.0 * rng.random::<f32>() - 1.0).collect()
}

fn moved(values: &[f32], direction: &[f32], by: f32) -> Vec<f32> {
    values.iter().zip(direction).map(|(v, d)| v + by * d).collect()
}

/// Step of the differences. f32 leaves noise of about 1e-6 of the loss over the step (velocities from
/// positions: ten times that).
const STEP: f32 = 2e-2;

/// The derivative of `loss` along `direction` by a difference of fourth order, compared with `gradient`.
fn check(what: &str, at: &[f32], gradient: &[f32], tolerance: f64, loss: impl Fn(&[f32]) -> f64) {
    for seed in 0..3 {
        let d = direction(at.len(), seed);
        let difference = |by: f32| loss(&moved(at, &d, by)) - loss(&moved(at, &d, -by));
        let expected = (8.0 * difference(STEP) - difference(2.0 * STEP)) / (12.0 * f64::from(STEP));
        let found = inner(gradient, &d);
        let scale = inner(gradient, gradient).sqrt() * inner(&d, &d).sqrt() / (at.len() as f64).sqrt();
        assert!(
            (found - expected).abs() <= tolerance * scale.max(expected.abs()),
            "{what}, direction {seed}: {found} where {expected} is expected"
        );
        assert!(scale > 0.0, "{what}: no gradient");
    }
}

fn points(values: &[f32]) -> Vec<[f32; 3]> {
    support::points(values)
}

#[test]
fn accelerations_of_every_kind() {
    let (q, v, weight) = (random_points(70, 1.0, 1), random_points(70, 1.0, 2), random_points(70, 1.0, 3));
    for (potential, force) in KINDS {
        let system = lively_system(potential, force);
        let gradients = acceleration_vjp(&system, &q, &v, &EDIT, &weight);
        let loss = |system: &System, q: &[[f32; 3]], v: &[[f32; 3]]| {
            inner(system.accelerations(q, v, &EDIT).as_flattened(), weight.as_flattened())
        };
        let what = format!("{potential:?} {force:?}");
        check(&format!("{what} q"), q.as_flattened(), gradients.q.as_flattened(), 1e-3, |x| {
            loss(&system, &points(x), &v)
        });
        if force != ForceKind::None {
            check(&format!("{what} v"), v.as_flattened(), gradients.v.as_flattened(), 1e-3, |x| {
                loss(&system, &q, &points(x))
            });
        }
        for entry in system.layout() {
            let own = &gradients.params[entry.range.clone()];
            let shifts_u_only = entry.name == "potential.2.bias";
            if shifts_u_only {
                assert!(own.iter().all(|&g| g == 0.0));
                continue;
            }
            check(&format!("{what} {}", entry.name), &system.params[entry.range.clone()], own, 1e-3, |x| {
                let mut other = system.clone();
                other.params[entry.range.clone()].copy_from_slice(x);
                loss(&other, &q, &v)
            });
        }
    }
}

#[test]
fn the_gradient_of_the_potential_is_its_derivative() {
    let q = random_points(70, 1.0, 1);
    for (potential, force) in KINDS {
        let system = lively_system(potential, force);
        let gradient = system.potential_gradients(&q);
        let ones = vec![1.0; q.len()];
        check("U", q.as_flattened(), gradient.as_flattened(), 1e-3, |x| {
            inner(&system.potentials(&points(x)), &ones)
        });
    }
}

#[test]
fn alignment() {
    let position = random_points(40, 0.5, 1);
    let noise = random_points(40, 0.1, 2);
    let turned = |p: [f32; 3]| [0.8 * p[0] - 0.6 * p[1] + 0.3, 0.6 * p[0] + 0.8 * p[1], p[2] - 0.2];
    let candidate: Vec<[f32; 3]> =
        position.iter().zip(&noise).map(|(&p, n)| std::array::from_fn(|i| turned(p)[i] + n[i])).collect();
    let supports = Supports::nearest(&position, 8);
    let (w_aligned, w_rotation) = (random_points(40, 1.0, 4), random_points(120, 1.0, 5));
    let v_rotations = w_rotation.as_chunks::<3>().0.to_vec();
    let alignment = align(&position, &candidate, &supports);
    let (v_position, v_candidate) = align_vjp(&supports, &alignment, &w_aligned, &v_rotations);
    let loss = |position: &[[f32; 3]], candidate: &[[f32; 3]]| {
        let result = align(position, candidate, &supports);
        let rotations = result.rotations();
        inner(result.aligned.as_flattened(), w_aligned.as_flattened())
            + inner(rotations.as_flattened().as_flattened(), w_rotation.as_flattened())
    };
    check("position", position.as_flattened(), v_position.as_flattened(), 2e-3, |x| {
        loss(&points(x), &candidate)
    });
    check("candidate", candidate.as_flattened(), v_candidate.as_flattened(), 2e-3, |x| {
        loss(&position, &points(x))
    });
}

/// Random cotangents for every state of a rollout.
fn cotangents(states: &[State]) -> Vec<StateCotangents> {
    (0..states.len() as u64)
        .map(|step| StateCotangents {
            q: random_points(states[0].len(), 1.0, 100 + step),
            v: random_points(states[0].len(), 0.3, 200 + step),
            rotation: direction(4 * states[0].len(), 300 + step).as_chunks::<4>().0.to_vec(),
        })
        .collect()
}

fn rollout_loss(states: &[State], weights: &[StateCotangents]) -> f64 {
    let of = |(state, w): (&State, &StateCotangents)| {
        inner(state.q.as_flattened(), w.q.as_flattened())
            + inner(state.v.as_flattened(), w.v.as_flattened())
            + inner(state.rotation.as_flattened(), w.rotation.as_flattened())
    };
    states.iter().zip(weights).map(of).sum()
}

fn check_rollout(what: &str, system: &System, q: &[[f32; 3]], v: &[[f32; 3]], spec: &RolloutSpec) {
    let states = rollout(system, &State::at_start(q.to_vec(), v.to_vec()), spec);
    let weights = cotangents(&states);
    let gradients = rollout_vjp(system, spec, &states, &weights);
    let loss = |system: &System, q: &[[f32; 3]], v: &[[f32; 3]]| {
        rollout_loss(&rollout(system, &State::at_start(q.to_vec(), v.to_vec()), spec), &weights)
    };
    check(&format!("{what} q0"), q.as_flattened(), gradients.q0.as_flattened(), 3e-3, |x| {
        loss(system, &points(x), v)
    });
    check(&format!("{what} v0"), v.as_flattened(), gradients.v0.as_flattened(), 3e-3, |x| {
        loss(system, q, &points(x))
    });
    for entry in system.layout() {
        if entry.name == "potential.2.bias" {
            continue;
        }
        let name = format!("{what} {}", entry.name);
        check(
            &name,
            &system.params[entry.range.clone()],
            &gradients.params[entry.range.clone()],
            3e-3,
            |x| {
                let mut other = system.clone();
                other.params[entry.range.clone()].copy_from_slice(x);
                loss(&other, q, v)
            },
        );
    }
}

#[test]
fn rollouts_of_independent_particles_with_a_shorter_last_step() {
    let (q, v) = (random_points(66, 0.6, 1), random_points(66, 0.5, 2));
    for (potential, force) in KINDS {
        let system = lively_system(potential, force);
        let spec = RolloutSpec { last_dt: Some(0.02), ..RolloutSpec::new(0.05, 5) }.edited(EDIT);
        check_rollout(&format!("{potential:?} {force:?}"), &system, &q, &v, &spec);
    }
}

#[test]
fn rollouts_with_alignment_under_every_velocity_policy() {
    let (q, v) = (random_points(66, 0.6, 1), random_points(66, 0.5, 2));
    let supports = Supports::nearest(&q, 7);
    let system = lively_system(PotentialKind::QuadraticMlp, ForceKind::Structured);
    for policy in [VelocityPolicy::Keep, VelocityPolicy::FromPositions, VelocityPolicy::Rigid] {
        let spec = RolloutSpec { last_dt: Some(0.02), ..RolloutSpec::new(0.05, 4) }
            .edited(EDIT)
            .aligned(&supports, policy);
        check_rollout(&format!("{policy:?}"), &system, &q, &v, &spec);
    }
}

#[test]
fn degenerate_supports_give_finite_values_and_gradients() {
    let line: Vec<[f32; 3]> = (0..12).map(|i| [0.1 * i as f32, 0.0, 0.0]).collect();
    let shapes = [
        line,
        vec![[0.3, 0.2, 0.1]; 12],
        random_points(2, 1.0, 1),
        random_points(1, 1.0, 1),
        random_points(3, 1.0, 1),
    ];
    let system = lively_system(PotentialKind::Mlp, ForceKind::Structured);
    for q in shapes {
        let supports = Supports::nearest(&q, 6);
        for policy in [VelocityPolicy::Keep, VelocityPolicy::FromPositions, VelocityPolicy::Rigid] {
            let spec = RolloutSpec::new(0.02, 6).aligned(&supports, policy);
            let states = rollout(&system, &State::at_start(q.clone(), vec![[0.4, 0.1, 0.0]; q.len()]), &spec);
            let gradients = rollout_vjp(&system, &spec, &states, &cotangents(&states));
            let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
            for state in &states {
                assert!(
                    finite(state.q.as_flattened())
                        && finite(state.v.as_flattened())
                        && finite(state.rotation.as_flattened()),
                    "{policy:?}"
                );
            }
            assert!(
                finite(&gradients.params)
                    && finite(gradients.q0.as_flattened())
                    && finite(gradients.v0.as_flattened()),
                "{policy:?}"
            );
        }
    }
}

#[test]
fn no_particles_are_no_error() {
    let system = lively_system(PotentialKind::Mlp, ForceKind::Mlp);
    let supports = Supports::nearest(&[], 5);
    for spec in [RolloutSpec::new(0.1, 2), RolloutSpec::new(0.1, 2).aligned(&supports, VelocityPolicy::Rigid)]
    {
        let states = rollout(&system, &State::default(), &spec);
        assert_eq!(states.len(), 3);
        assert!(rollout_vjp(&system, &spec, &states, &[]).params.iter().all(|&g| g == 0.0));
    }
}
