//! Local rigid alignment: 50 000 particles, supports of 20; and rollouts that align after every step.

use crate::particles::{cotangents, points, system};
use lgs_bench::machine::Machine;
use lgs_bench::memory::allocations;
use lgs_bench::table::{Row, section};
use lgs_bench::{REPEATS, median_secs, medians_in_turns};
use lgs_core::spatial_order;
use lgs_dynamics::{
    Alignment, AlignmentVjp, RolloutSpec, State, Supports, VelocityPolicy, align, rollout, rollout_vjp,
};

const PARTICLES: usize = 50_000;

/// Calls of a turn, which then takes about a tenth of a second.
const CALLS: usize = 30;

/// Particles and steps of the rollouts.
const ROLLED: usize = 3000;
const STEPS: usize = 15;

/// Members of a support.
pub(crate) const K: usize = 20;

/// Positions in spatial order, as scenes have them, the same turned a little and disturbed, and their
/// supports.
pub(crate) fn case(n: usize) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Supports) {
    let points = points(n, 1.0, 1);
    case_of(spatial_order(&points).into_iter().map(|i| points[i as usize]).collect())
}

/// The same, in whatever order the positions come.
pub(crate) fn case_of(position: Vec<[f32; 3]>) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Supports) {
    let (s, c) = 0.02_f32.sin_cos();
    let noise = points(position.len(), 1e-3, 2);
    let turned = |(p, n): (&[f32; 3], &[f32; 3])| {
        [c * p[0] - s * p[1] + n[0], s * p[0] + c * p[1] + n[1], p[2] + n[2]]
    };
    let candidate = position.iter().zip(&noise).map(turned).collect();
    let supports = Supports::nearest(&position, K);
    (position, candidate, supports)
}

pub(crate) fn run(machine: &Machine) {
    section(&format!("alignment ({PARTICLES} particles, supports of {K})"));
    let (position, candidate, supports) = case(PARTICLES);
    let (kept, v) = (align(&position, &candidate, &supports), points(PARTICLES, 1.0, 3));
    let (mut aligned, mut pulled) = (Alignment::default(), AlignmentVjp::default());
    let [forward, backward] = medians_in_turns(
        REPEATS,
        [&mut || (0..CALLS).for_each(|_| aligned.update(&position, &candidate, &supports)), &mut || {
            (0..CALLS).for_each(|_| pulled.update(&supports, &kept, &v, &[]))
        }],
    )
    .map(|secs| secs / CALLS as f64);
    let rate = (PARTICLES * K) as f64 / forward / machine.cores as f64;
    Row::timed("alignment, forward", forward)
        .with_rate(format!("{:.1} M members/s/core", rate * 1e-6))
        .asked("≥ 25 M", rate >= 25e6)
        .print();
    let ratio = backward / forward;
    Row::timed("alignment, backward", backward)
        .with_ratio(format!("{ratio:.2} × forward"))
        .asked("≤ 3 ×", ratio <= 3.0)
        .print();
    rollouts();
}

/// Rollouts with the velocity policy that does most, and what a step of theirs allocates beyond the three
/// arrays of its state.
fn rollouts() {
    let (position, _, supports) = case(ROLLED);
    let (system, start) = (system(), State::at_start(position, points(ROLLED, 1.0, 2)));
    let spec = |steps| RolloutSpec::new(0.01, steps).aligned(&supports, VelocityPolicy::Rigid);
    let name = format!("rollout of {ROLLED} particles × {STEPS} steps with alignment");
    Row::timed(format!("{name}, forward"), median_secs(REPEATS, || rollout(&system, &start, &spec(STEPS))))
        .print();
    let cotangents = cotangents(ROLLED, 2 * STEPS + 1);
    let both = |steps| {
        rollout_vjp(&system, &spec(steps), &rollout(&system, &start, &spec(steps)), &cotangents[..=steps])
    };
    Row::timed(format!("{name}, forward + backward"), median_secs(REPEATS, || both(STEPS))).print();
    let beyond_states =
        |counted: &dyn Fn(usize) -> usize| (counted(2 * STEPS) - counted(STEPS)) as f64 / STEPS as f64 - 3.0;
    let forward = beyond_states(&|steps| allocations(|| rollout(&system, &start, &spec(steps))));
    let backward = beyond_states(&|steps| allocations(|| both(steps)));
    // The thread pool's queues grow by a block now and then.
    for (pass, found) in [("forward", forward), ("forward + backward", backward)] {
        Row::figure(format!("{name}, {pass}, allocations"), format!("{found:.1} per step"))
            .asked("< 1", found < 1.0)
            .print();
    }
}
