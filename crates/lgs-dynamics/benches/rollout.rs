//! Rollouts of 75 steps, forward and with gradients, and one alignment step.

use lgs_dynamics::{
    ForceKind, Normalisation, PotentialKind, RolloutSpec, State, StateCotangents, Supports, System, SystemConfig, VelocityPolicy, align,
    align_vjp, rollout, rollout_vjp,
};
use rand::RngExt;

fn main() {
    divan::main();
}

fn points(n: usize, half: f32, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = lgs_core::stream(seed, "points", 0);
    (0..n).map(|_| std::array::from_fn(|_| half * (2.0 * rng.random::<f32>() - 1.0))).collect()
}

fn system(hidden: usize, force: ForceKind) -> System {
    let normalisation = Normalisation::identity();
    System::init(SystemConfig { potential: PotentialKind::QuadraticMlp, force, hidden, hidden_layers: 3, normalisation }, 1)
}

fn forward(bencher: divan::Bencher, hidden: usize, force: ForceKind) {
    let system = system(hidden, force);
    let start = State::at_start(points(2048, 1.0, 1), points(2048, 1.0, 2));
    bencher.bench(|| rollout(&system, &start, &RolloutSpec::new(0.01, 75)));
}

fn forward_and_backward(bencher: divan::Bencher, hidden: usize, force: ForceKind) {
    let system = system(hidden, force);
    let start = State::at_start(points(2048, 1.0, 1), points(2048, 1.0, 2));
    let spec = RolloutSpec::new(0.01, 75);
    let cotangent = StateCotangents { q: points(2048, 1.0, 3), ..StateCotangents::default() };
    let cotangents = vec![cotangent; 76];
    bencher.bench(|| rollout_vjp(&system, &spec, &rollout(&system, &start, &spec), &cotangents));
}

#[divan::bench(args = [32, 64, 128], max_time = 4)]
fn rollout_mlp(bencher: divan::Bencher, hidden: usize) {
    forward(bencher, hidden, ForceKind::Mlp);
}

#[divan::bench(args = [32, 64, 128], max_time = 4)]
fn rollout_and_gradient_mlp(bencher: divan::Bencher, hidden: usize) {
    forward_and_backward(bencher, hidden, ForceKind::Mlp);
}

#[divan::bench(args = [32, 64, 128], max_time = 4)]
fn rollout_and_gradient_structured(bencher: divan::Bencher, hidden: usize) {
    forward_and_backward(bencher, hidden, ForceKind::Structured);
}

fn alignment_case() -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Supports) {
    let position = points(3000, 1.0, 1);
    let (s, c) = 0.02_f32.sin_cos();
    let noise = points(3000, 1e-3, 2);
    let turned = |(p, n): (&[f32; 3], &[f32; 3])| [c * p[0] - s * p[1] + n[0], s * p[0] + c * p[1] + n[1], p[2] + n[2]];
    let candidate = position.iter().zip(&noise).map(turned).collect();
    let supports = Supports::nearest(&position, 20);
    (position, candidate, supports)
}

#[divan::bench(max_time = 2)]
fn alignment_3000_by_20(bencher: divan::Bencher) {
    let (position, candidate, supports) = alignment_case();
    bencher.bench(|| align(&position, &candidate, &supports));
}

#[divan::bench(max_time = 2)]
fn alignment_vjp_3000_by_20(bencher: divan::Bencher) {
    let (position, candidate, supports) = alignment_case();
    let alignment = align(&position, &candidate, &supports);
    let v = points(3000, 1.0, 3);
    bencher.bench(|| align_vjp(&supports, &alignment, &v, &[]));
}

#[divan::bench(max_time = 4)]
fn aligned_rollout_and_gradient_3000_by_20_15_steps(bencher: divan::Bencher) {
    let (position, _, supports) = alignment_case();
    let system = system(64, ForceKind::Structured);
    let spec = RolloutSpec::new(0.01, 15).aligned(&supports, VelocityPolicy::Rigid);
    let start = State::at_start(position, points(3000, 1.0, 2));
    let cotangents = vec![StateCotangents { q: points(3000, 1.0, 3), ..StateCotangents::default() }; 16];
    bencher.bench(|| rollout_vjp(&system, &spec, &rollout(&system, &start, &spec), &cotangents));
}
