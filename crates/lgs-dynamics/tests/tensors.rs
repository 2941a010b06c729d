//! The Burn operations and their plain twins: conformance vectors, and agreement with each other under every
//! kind and policy.
#![expect(clippy::unwrap_used, reason = "a test stops at what it did not expect")]

mod support;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_dynamics::tensor::{self, RolloutCall};
use lgs_dynamics::{Edit, ForceKind, PotentialKind, Supports, System, reference};
use std::sync::Arc;
use support::rollouts::{call_of, cases, weights};
use support::{Vector, lively_system, random_points, system_of, vectors};

fn device() -> Device {
    Device::flex().autodiff()
}

fn matrix(points: &[[f32; 3]]) -> Tensor<2> {
    Tensor::from_data(TensorData::new(points.as_flattened().to_vec(), [points.len(), 3]), &device())
}

fn vector(values: &[f32]) -> Tensor<1> {
    Tensor::from_data(TensorData::new(values.to_vec(), [values.len()]), &device())
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().unwrap()
}

/// A rollout as an operation or as its twin.
type Rollout = fn(Tensor<1>, Tensor<2>, Tensor<2>, RolloutCall) -> Tensor<3>;

const ROLLOUTS: [(&str, Rollout); 2] =
    [("operation", tensor::rollout), ("twin", |p, q, v, call| reference::rollout(&p, q, v, &call))];

/// Values of a rollout and the gradients of `Σ states · weight` by parameters, positions and velocities.
fn run(
    rollout: Rollout,
    system: &System,
    [q, v]: [&[[f32; 3]]; 2],
    call: &RolloutCall,
    weight: &[f32],
) -> (Vec<f32>, [Vec<f32>; 3]) {
    let (params, q, v) =
        (vector(&system.params).require_grad(), matrix(q).require_grad(), matrix(v).require_grad());
    let states = rollout(params.clone(), q.clone(), v.clone(), call.clone());
    let weight = Tensor::<3>::from_data(TensorData::new(weight.to_vec(), states.dims()), &device());
    let grads = (states.clone() * weight).sum().backward();
    let gradients = [
        values(params.grad(&grads).unwrap()),
        values(q.grad(&grads).unwrap()),
        values(v.grad(&grads).unwrap()),
    ];
    (values(states), gradients)
}

#[test]
fn rollouts_of_tensors_pass_conformance() {
    for vector in vectors("dynamics") {
        for (name, rollout) in ROLLOUTS {
            check_rollout(name, rollout, &vector);
        }
    }
}

fn check_rollout(name: &str, rollout: Rollout, vector: &Vector) {
    let system = system_of(vector);
    let (q, v) = (vector.points("position"), vector.points("velocity"));
    let weights = vector.points("loss_weight");
    let weight: Vec<f32> =
        weights.iter().flat_map(|w| [w[0], w[1], w[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
    let (states, [v_params, v_q, v_v]) = run(rollout, &system, [&q, &v], &call_of(vector, &system), &weight);
    let trajectory: Vec<f32> = states.as_chunks::<10>().0.iter().flat_map(|s| [s[0], s[1], s[2]]).collect();
    let what = format!("{name} trajectory");
    assert_values_close(&what, &trajectory, &vector.floats("trajectory"), 2e-4, 1e-4);
    assert_gradient_close(&format!("{name} position"), &v_q, &vector.floats("grad_position"));
    assert_gradient_close(&format!("{name} velocity"), &v_v, &vector.floats("grad_velocity"));
    for entry in system.layout() {
        let (what, expected) =
            (format!("{name} {} {}", vector.name, entry.name), format!("grad_{}", entry.name));
        assert_gradient_close(&what, &v_params[entry.range], &vector.floats(&expected));
    }
}

#[test]
fn accelerations_of_tensors_pass_conformance() {
    for vector in vectors("dynamics") {
        let system = system_of(&vector);
        let (params, q, v) = (&system.params, vector.points("position"), vector.points("velocity"));
        let found = tensor::acceleration(
            system.config,
            Edit::default(),
            self::vector(params),
            matrix(&q),
            matrix(&v),
        );
        assert_values_close("acceleration", &values(found), &vector.floats("acceleration"), 2e-4, 1e-5);
    }
}

type Align = fn(Tensor<2>, Tensor<2>, Arc<Supports>) -> (Tensor<2>, Tensor<3>);

#[expect(clippy::needless_pass_by_value, reason = "takes what the operation takes")]
fn align_twin(position: Tensor<2>, candidate: Tensor<2>, supports: Arc<Supports>) -> (Tensor<2>, Tensor<3>) {
    let fitted = reference::align(&position, &candidate, &supports);
    (fitted.aligned, fitted.rotations)
}

#[test]
fn alignment_of_tensors_passes_conformance() {
    for vector in vectors("local_rigid_alignment") {
        let (indices, k) = vector.indices("neighbours");
        let supports = Arc::new(Supports::from_rows(indices, k).unwrap());
        let n = supports.particles();
        let w_aligned = matrix(&vector.points("loss_weight_aligned"));
        let w_rotation = Tensor::<3>::from_data(
            TensorData::new(vector.floats("loss_weight_rotation"), [n, 3, 3]),
            &device(),
        );
        for (name, align) in [("operation", tensor::align as Align), ("twin", align_twin)] {
            let position = matrix(&vector.points("position")).require_grad();
            let candidate = matrix(&vector.points("candidate")).require_grad();
            let (aligned, rotations) = align(position.clone(), candidate.clone(), supports.clone());
            assert_values_close(name, &values(aligned.clone()), &vector.floats("aligned"), 2e-4, 1e-5);
            assert_values_close(name, &values(rotations.clone()), &vector.floats("rotation"), 2e-4, 1e-5);
            let grads =
                ((aligned * w_aligned.clone()).sum() + (rotations * w_rotation.clone()).sum()).backward();
            assert_gradient_close(
                name,
                &values(position.grad(&grads).unwrap()),
                &vector.floats("grad_position"),
            );
            assert_gradient_close(
                name,
                &values(candidate.grad(&grads).unwrap()),
                &vector.floats("grad_candidate"),
            );
        }
    }
}

#[test]
fn operation_and_twin_agree_for_every_kind_and_policy() {
    let (q, v) = (random_points(70, 0.6, 1), random_points(70, 0.5, 2));
    let weight = weights(6 * 70 * 10, 9);
    for case in cases(&q) {
        let (name, system) = (case.name(), lively_system(case.potential, case.force));
        let call = case.call(&system);
        let (fast, fast_gradients) = run(ROLLOUTS[0].1, &system, [&q, &v], &call, &weight);
        let (plain, plain_gradients) = run(ROLLOUTS[1].1, &system, [&q, &v], &call, &weight);
        assert_values_close(&name, &fast, &plain, 2e-4, 1e-5);
        for ((what, fast), plain) in
            ["params", "q0", "v0"].into_iter().zip(&fast_gradients).zip(&plain_gradients)
        {
            assert_gradient_close(&format!("{name} {what}"), fast, plain);
        }
    }
}

#[test]
fn the_acceleration_operation_and_its_twin_agree() {
    let (q, v) = (random_points(70, 0.6, 1), random_points(70, 0.5, 2));
    let edit = Edit { velocity_scale: 1.0, potential_scale: 1.2, force_scale: 0.8 };
    let system = lively_system(PotentialKind::QuadraticMlp, ForceKind::Structured);
    let weight = matrix(&random_points(70, 1.0, 4));
    let run = |twin: bool| {
        let inputs =
            (vector(&system.params).require_grad(), matrix(&q).require_grad(), matrix(&v).require_grad());
        let (p, q, v) = inputs.clone();
        let a = if twin {
            reference::acceleration(&system.config, &edit, p, q, v)
        } else {
            tensor::acceleration(system.config, edit, p, q, v)
        };
        let grads = (a.clone() * weight.clone()).sum().backward();
        let of_points = |x: &Tensor<2>| values(x.grad(&grads).unwrap());
        [values(a), values(inputs.0.grad(&grads).unwrap()), of_points(&inputs.1), of_points(&inputs.2)]
    };
    let (fast, plain) = (run(false), run(true));
    assert_values_close("a", &fast[0], &plain[0], 2e-4, 1e-5);
    for (fast, plain) in fast.iter().zip(&plain).skip(1) {
        assert_gradient_close("a", fast, plain);
    }
}
