//! Time per Gaussian from 5 000 to 500 000 of them.

use crate::alignment::{case, case_of};
use crate::particles::{cotangents, points, start, system};
use lgs_bench::machine::Machine;
use lgs_bench::table::{Row, section};
use lgs_bench::{medians_in_turns, times_in_turn};
use lgs_dynamics::{
    Alignment, AlignmentVjp, RolloutSpec, State, StateCotangents, Supports, rollout, rollout_vjp,
};

pub(crate) const COUNTS: [usize; 3] = [5_000, 50_000, 500_000];

/// Largest over smallest time per Gaussian.
const FLAT: f64 = 1.25;

/// Steps of the rollouts.
const STEPS: usize = 4;

pub(crate) fn run(_: &Machine) {
    section("growth (5 k, 50 k, 500 k Gaussians)");
    let mut cases = COUNTS.map(|n| Aligned::new(case(n)));
    print("alignment, forward", per_gaussian(cases.each_mut().map(|case| || case.forward())));
    print("alignment, backward", per_gaussian(cases.each_mut().map(|case| || case.backward())));
    let mut cases = COUNTS.map(|n| Aligned::new(case_of(points(n, 1.0, 1))));
    let both = |case: &mut Aligned| {
        case.forward();
        case.backward();
    };
    let secs = per_gaussian(cases.each_mut().map(|case| || both(case)));
    Row::figure("both, particles in no order", times(secs)).print();
    let system = system();
    let spec = RolloutSpec::new(0.01, STEPS);
    let starts = COUNTS.map(start);
    print(
        &format!("rollout of {STEPS} steps, forward"),
        per_gaussian(starts.each_ref().map(|start| || drop(rollout(&system, start, &spec)))),
    );
    let pulled = starts.each_ref().map(|start| (start, cotangents(start.q.len(), STEPS + 1)));
    let both = |start: &State, v: &[StateCotangents]| {
        drop(rollout_vjp(&system, &spec, &rollout(&system, start, &spec), v))
    };
    print(
        &format!("rollout of {STEPS} steps, forward + backward"),
        per_gaussian(pulled.each_ref().map(|(start, v)| || both(start, v))),
    );
}

/// An alignment, its backward pass, and what goes into them.
struct Aligned {
    position: Vec<[f32; 3]>,
    candidate: Vec<[f32; 3]>,
    supports: Supports,
    v: Vec<[f32; 3]>,
    aligned: Alignment,
    pulled: AlignmentVjp,
}

impl Aligned {
    fn new((position, candidate, supports): (Vec<[f32; 3]>, Vec<[f32; 3]>, Supports)) -> Self {
        let v = points(position.len(), 1.0, 3);
        Self {
            position,
            candidate,
            supports,
            v,
            aligned: Alignment::default(),
            pulled: AlignmentVjp::default(),
        }
    }

    fn forward(&mut self) {
        self.aligned.update(&self.position, &self.candidate, &self.supports);
    }

    fn backward(&mut self) {
        self.pulled.update(&self.supports, &self.aligned, &self.v, &[]);
    }
}

/// Median seconds per Gaussian of the runs for each count, which take turns. A measurement repeats a run for
/// a tenth of a second at least: where other work takes the processor now and then, it does so within the
/// measurements of every count, and not of the largest alone. Threads are woken once per measurement, as by a
/// rollout.
pub(crate) fn per_gaussian<F: FnMut() + Send>(runs: [F; 3]) -> [f64; 3] {
    let mut repeated = runs.map(|mut run| {
        let times = times_in_turn(0.1, &mut run);
        (times, move || rayon::scope(|_| (0..times).for_each(|_| run())))
    });
    let times = repeated.each_ref().map(|(times, _)| *times);
    let secs = medians_in_turns(9, repeated.each_mut().map(|(_, run)| run as &mut dyn FnMut()));
    [0, 1, 2].map(|i| secs[i] / (COUNTS[i] * times[i]) as f64)
}

/// Prints the times per Gaussian of every count.
pub(crate) fn print(name: &str, secs: [f64; 3]) {
    let spread =
        secs.iter().copied().fold(0.0, f64::max) / secs.iter().copied().fold(f64::INFINITY, f64::min);
    Row::figure(name, times(secs))
        .with_ratio(format!("{spread:.2} × between them"))
        .asked("≤ 1.25 ×", spread <= FLAT)
        .print();
}

/// Nanoseconds per Gaussian.
pub(crate) fn times(secs: [f64; 3]) -> String {
    format!("{} ns", secs.map(|s| format!("{:.0}", s * 1e9)).join(", "))
}
