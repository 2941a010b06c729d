//! Time per Gaussian from 5 000 to 500 000 of them.

use crate::alignment::case;
use crate::particles::{cotangents, points, system};
use lgs_bench::machine::Machine;
use lgs_bench::median_secs;
use lgs_bench::table::{Row, section};
use lgs_dynamics::{Alignment, AlignmentVjp, RolloutSpec, State, rollout, rollout_vjp};

pub(crate) const COUNTS: [usize; 3] = [5_000, 50_000, 500_000];

/// Largest over smallest time per Gaussian.
const FLAT: f64 = 1.25;

/// Steps of the rollouts.
const STEPS: usize = 4;

pub(crate) fn run(_: &Machine) {
    section("growth (5 k, 50 k, 500 k Gaussians)");
    let cases = COUNTS.map(case);
    let (mut aligned, mut pulled) = (Alignment::default(), AlignmentVjp::default());
    print(
        "alignment, forward",
        [0, 1, 2].map(|i| {
            let (position, candidate, supports) = &cases[i];
            per_gaussian(COUNTS[i], || aligned.update(position, candidate, supports))
        }),
    );
    print(
        "alignment, backward",
        [0, 1, 2].map(|i| {
            let (position, candidate, supports) = &cases[i];
            aligned.update(position, candidate, supports);
            let v = points(COUNTS[i], 1.0, 3);
            per_gaussian(COUNTS[i], || pulled.update(supports, &aligned, &v, &[]))
        }),
    );
    let system = system();
    let spec = RolloutSpec::new(0.01, STEPS);
    let start = |n: usize| State::at_start(points(n, 1.0, 1), points(n, 1.0, 2));
    print(
        &format!("rollout of {STEPS} steps, forward"),
        COUNTS.map(|n| {
            let start = start(n);
            per_gaussian(n, || rollout(&system, &start, &spec))
        }),
    );
    print(
        &format!("rollout of {STEPS} steps, forward + backward"),
        COUNTS.map(|n| {
            let (start, cotangents) = (start(n), cotangents(n, STEPS + 1));
            per_gaussian(n, || rollout_vjp(&system, &spec, &rollout(&system, &start, &spec), &cotangents))
        }),
    );
}

/// Median seconds per Gaussian. A measurement repeats `run` for a tenth of a second at least: where other work takes the processor now and
/// then, it does so within the measurements of every count, and not of the largest alone.
pub(crate) fn per_gaussian<T>(n: usize, mut run: impl FnMut() -> T) -> f64 {
    let runs = (0.1 / median_secs(1, &mut run)).ceil().max(1.0) as usize;
    let repeated = || (0..runs).for_each(|_| drop(std::hint::black_box(run())));
    median_secs(5, repeated) / (n * runs) as f64
}

/// Prints the times per Gaussian of every count.
pub(crate) fn print(name: &str, secs: [f64; 3]) {
    let spread = secs.iter().copied().fold(0.0, f64::max) / secs.iter().copied().fold(f64::INFINITY, f64::min);
    let times = secs.map(|s| format!("{:.0}", s * 1e9)).join(", ");
    Row::figure(name, format!("{times} ns")).with_ratio(format!("{spread:.2} × between them")).asked("≤ 1.25 ×", spread <= FLAT).print();
}
