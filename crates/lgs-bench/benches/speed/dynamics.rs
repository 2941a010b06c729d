//! Rollouts without alignment: 8192 particles, 75 steps, U and Q of four layers of 128.

use crate::particles::{cotangents, operations, start, system};
use burn::tensor::{Device, Tensor, TensorData};
use lgs_bench::machine::Machine;
use lgs_bench::memory::peak_bytes;
use lgs_bench::table::{Row, percent, section};
use lgs_bench::{Beside, Panels, median_secs};
use lgs_dynamics::tensor::RolloutCall;
use lgs_dynamics::{
    Edit, ForceKind, RolloutSpec, State, System, SystemConfig, VelocityPolicy, reference, rollout,
    rollout_vjp,
};

const PARTICLES: usize = 8192;
const STEPS: usize = 75;

/// Particles of the smaller networks' rollouts.
const FEW: usize = 2048;

const DT: f32 = 0.01;

/// Steps of the reference, whose time is scaled to all of them: its tape of 75 would need several GB.
const REFERENCE_STEPS: usize = 5;

pub(crate) fn run(machine: &Machine) {
    section(&format!("dynamics ({PARTICLES} particles × {STEPS} steps, U and Q 4×128)"));
    let system = system();
    let start = start(PARTICLES);
    let spec = RolloutSpec::new(DT, STEPS);
    let work = operations(&system.config) * (PARTICLES * STEPS) as f64;
    let cotangents = cotangents(PARTICLES, STEPS + 1);
    let forward = || rollout(&system, &start, &spec);
    let both = || rollout_vjp(&system, &spec, &rollout(&system, &start, &spec), &cotangents);
    let measured = Beside::measure::<Panels, _>(machine.cores, forward);
    share("rollout, forward", measured, work, Some(0.6)).print();
    // A product of the forward pass has two in its backward pass; what is computed a second time is not
    // counted.
    let measured = Beside::measure::<Panels, _>(machine.cores, both);
    share("rollout, forward + backward (3 × the operations)", measured, 3.0 * work, Some(0.5)).print();
    against_reference(&system, &start, measured.secs);
    let (bytes, _) = peak_bytes(both);
    let mebibytes = bytes as f64 / f64::from(1 << 20);
    Row::figure("rollout, forward + backward, peak memory over inputs", format!("{mebibytes:.1} MiB"))
        .asked("≤ 64 MiB", mebibytes <= 64.0)
        .print();
    smaller_networks(machine);
}

/// Networks of fewer units and both kinds of force, forward + backward: what blocks lose when products are
/// small.
fn smaller_networks(machine: &Machine) {
    let start = start(FEW);
    let (spec, cotangents) = (RolloutSpec::new(DT, STEPS), cotangents(FEW, STEPS + 1));
    for hidden in [32, 64] {
        for force in [ForceKind::Mlp, ForceKind::Structured] {
            let system = System::init(SystemConfig { hidden, force, ..SystemConfig::paper() }, 1);
            let both = || rollout_vjp(&system, &spec, &rollout(&system, &start, &spec), &cotangents);
            let measured = Beside::measure::<Panels, _>(machine.cores, both);
            let work = 3.0 * operations(&system.config) * (FEW * STEPS) as f64;
            share(
                &format!("{FEW} particles, {hidden} units, {force:?} force, forward + backward"),
                measured,
                work,
                None,
            )
            .print();
        }
    }
}

/// A row with the operations of a second, their share of those of matrix products, and what share is asked.
pub(crate) fn share(name: &str, Beside { secs, rate: gemm }: Beside, work: f64, asked: Option<f64>) -> Row {
    let rate = work / secs;
    let row = Row::timed(name, secs)
        .with_rate(format!("{:.1} GFLOP/s", rate * 1e-9))
        .with_ratio(format!("{} of GEMM", percent(rate / gemm)));
    match asked {
        Some(asked) => row.asked(format!("≥ {}", percent(asked)), rate >= asked * gemm),
        None => row,
    }
}

fn against_reference(system: &System, start: &State, secs: f64) {
    let device = Device::flex().autodiff();
    let matrix = |rows: &[[f32; 3]]| {
        Tensor::<2>::from_data(TensorData::new(rows.as_flattened().to_vec(), [rows.len(), 3]), &device)
    };
    let params =
        Tensor::<1>::from_data(TensorData::new(system.params.clone(), [system.params.len()]), &device);
    let (edit, velocity_policy) = (Edit::default(), VelocityPolicy::Keep);
    let call = RolloutCall {
        config: system.config,
        dt: DT,
        steps: REFERENCE_STEPS,
        last_dt: None,
        edit,
        supports: None,
        velocity_policy,
    };
    let measured = median_secs(5, || {
        let (params, q, v) =
            (params.clone().require_grad(), matrix(&start.q).require_grad(), matrix(&start.v).require_grad());
        reference::rollout(&params, q, v, &call).sum().backward()
    });
    let scaled = measured * (STEPS as f64 / REFERENCE_STEPS as f64);
    let ratio = scaled / secs;
    Row::timed(format!("the same in tensor operations ({REFERENCE_STEPS} steps, scaled)"), scaled)
        .with_ratio(format!("{ratio:.2} × the fused time"))
        .asked("≥ 3 ×", ratio >= 3.0)
        .print();
}
