//! Rollouts of the paper's networks, with their gradients.

use burn::tensor::{Device, Tensor};
use lgs_dynamics::tensor::{RolloutCall, rollout};
use lgs_dynamics::{Edit, Supports, System, VelocityPolicy};

use crate::Sizes;
use crate::particles::{operations, points, system};
use crate::rasterizer::leaf;
use crate::rates::Rates;
use crate::rows::{least, row, share, wait_for};

/// Members of a support.
const MEMBERS: usize = 16;

/// Rolls particles and pulls back; waits for the end.
fn roll(system: &System, points: &[[f32; 3]], call: &RolloutCall, device: &Device) {
    let n = points.len();
    let params = leaf(&system.params, [system.params.len()], device);
    let q = leaf(points.as_flattened(), [n, 3], device);
    let states = rollout(params.clone(), q, Tensor::zeros([n, 3], device), call.clone());
    let gradients = states.sum().backward();
    wait_for(params.grad(&gradients).expect("a gradient").sum());
}

/// Measures and prints.
pub(crate) fn run(sizes: &Sizes, devices: &[Device; 2], rates: &Rates) {
    let [n, steps] = sizes.rolled;
    let (points, system) = (points(n, 1.0, 1), system());
    let free = RolloutCall {
        config: system.config,
        dt: 0.01,
        steps,
        last_dt: None,
        edit: Edit::default(),
        supports: None,
        velocity_policy: VelocityPolicy::Keep,
    };
    let aligned = RolloutCall { supports: Some(Supports::nearest(&points, MEMBERS).into()), ..free.clone() };
    let [one, other] = devices.each_ref().map(|device| device.clone().autodiff());
    let seconds = |call: &RolloutCall| {
        let run = |device: &Device| roll(&system, &points, call, device);
        least([&mut || run(&one), &mut || run(&other)])
    };
    // A product of the forward pass has two in its backward pass.
    let work = 3.0 * operations(&system.config) * (n * steps) as f64;
    let per_second = seconds(&free).map(|secs| work / secs);
    let of = format!("{n} particles, {steps} steps");
    row(&format!("rollout, forward and backward ({of}), GFLOP/s"), per_second.map(|rate| rate * 1e-9));
    share("the rate of products", per_second, rates.products);
    let per_second = seconds(&aligned).map(|secs| (n * steps) as f64 / secs);
    row("the same with alignment, M particle steps/s", per_second.map(|rate| rate * 1e-6));
}
