//! The slice kernels against every conformance vector.
#![expect(clippy::unwrap_used, reason = "a test stops at what it did not expect")]

mod support;

use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_dynamics::{
    Edit, RolloutSpec, State, StateCotangents, Supports, System, VelocityPolicy, align, align_vjp, rollout,
    rollout_vjp,
};
use support::{Vector, points, system_of, vectors};

fn supports_of(vector: &Vector) -> Supports {
    let (indices, k) = vector.indices("neighbours");
    Supports::from_rows(indices, k).unwrap()
}

fn edit_of(vector: &Vector) -> Edit {
    let edit = &vector.constants["edit"];
    let number = |name: &str| edit[name].as_f64().unwrap() as f32;
    Edit { velocity_scale: number("alpha"), potential_scale: number("beta"), force_scale: number("gamma") }
}

fn positions(states: &[State]) -> Vec<f32> {
    states.iter().flat_map(|s| s.q.as_flattened()).copied().collect()
}

#[test]
fn rollouts_and_their_gradients_pass_conformance() {
    vectors("dynamics").iter().for_each(check_rollout);
}

fn check_rollout(vector: &Vector) {
    let system = system_of(vector);
    let start = State::at_start(vector.points("position"), vector.points("velocity"));
    let supports = vector.constants["lra"].as_bool().unwrap().then(|| supports_of(vector));
    let plain = RolloutSpec::new(vector.number("dt") as f32, vector.number("steps") as usize);
    let spec = supports.as_ref().map_or(plain, |s| plain.aligned(s, VelocityPolicy::Keep));
    let check = |name: &str, found: &[f32], relative| {
        assert_values_close(name, found, &vector.floats(name), 2e-4, relative);
    };
    let accelerations = system.accelerations(&start.q, &start.v, &Edit::default());
    check("acceleration", accelerations.as_flattened(), 1e-5);
    let states = rollout(&system, &start, &spec);
    check("trajectory", &positions(&states), 1e-4);
    let edited = rollout(&system, &start, &spec.edited(edit_of(vector)));
    check("trajectory_edited", &positions(&edited), 1e-4);
    check_gradients(vector, &system, &spec, &states);
}

fn check_gradients(vector: &Vector, system: &System, spec: &RolloutSpec, states: &[State]) {
    let cotangents: Vec<_> = vector
        .points("loss_weight")
        .chunks(states[0].len())
        .map(|q| StateCotangents { q: q.to_vec(), ..StateCotangents::default() })
        .collect();
    let gradients = rollout_vjp(system, spec, states, &cotangents);
    assert_gradient_close("position", gradients.q0.as_flattened(), &vector.floats("grad_position"));
    assert_gradient_close("velocity", gradients.v0.as_flattened(), &vector.floats("grad_velocity"));
    for entry in system.layout() {
        let expected = vector.floats(&format!("grad_{}", entry.name));
        let what = format!("{} {}", vector.name, entry.name);
        assert_gradient_close(&what, &gradients.params[entry.range], &expected);
    }
}

#[test]
fn alignment_and_its_gradient_pass_conformance() {
    for vector in vectors("local_rigid_alignment") {
        let (position, candidate) = (vector.points("position"), vector.points("candidate"));
        let supports = supports_of(&vector);
        let alignment = align(&position, &candidate, &supports);
        assert_values_close(
            "aligned",
            alignment.aligned.as_flattened(),
            &vector.floats("aligned"),
            2e-4,
            1e-5,
        );
        let rotations = alignment.rotations();
        assert_values_close(
            "rotation",
            rotations.as_flattened().as_flattened(),
            &vector.floats("rotation"),
            2e-4,
            1e-5,
        );
        let v_rotations = vector.points("loss_weight_rotation").as_chunks::<3>().0.to_vec();
        let v_aligned = points(&vector.floats("loss_weight_aligned"));
        let (v_position, v_candidate) = align_vjp(&supports, &alignment, &v_aligned, &v_rotations);
        assert_gradient_close("position", v_position.as_flattened(), &vector.floats("grad_position"));
        assert_gradient_close("candidate", v_candidate.as_flattened(), &vector.floats("grad_candidate"));
    }
}
