//! Local rigid alignment: 50 000 particles in no order, supports of 20.

use crate::particles::points;
use lgs_bench::machine::Machine;
use lgs_bench::table::{Row, section};
use lgs_bench::{REPEATS, median_secs};
use lgs_dynamics::{Supports, align, align_vjp};

const PARTICLES: usize = 50_000;

/// Members of a support.
pub(crate) const K: usize = 20;

/// Positions, the same turned a little and disturbed, and their supports.
pub(crate) fn case(n: usize) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Supports) {
    let position = points(n, 1.0, 1);
    let (s, c) = 0.02_f32.sin_cos();
    let noise = points(n, 1e-3, 2);
    let turned = |(p, n): (&[f32; 3], &[f32; 3])| [c * p[0] - s * p[1] + n[0], s * p[0] + c * p[1] + n[1], p[2] + n[2]];
    let candidate = position.iter().zip(&noise).map(turned).collect();
    let supports = Supports::nearest(&position, K);
    (position, candidate, supports)
}

pub(crate) fn run(machine: &Machine) {
    section(&format!("alignment ({PARTICLES} particles, supports of {K})"));
    let (position, candidate, supports) = case(PARTICLES);
    let forward = median_secs(REPEATS, || align(&position, &candidate, &supports));
    let rate = (PARTICLES * K) as f64 / forward / machine.cores as f64;
    Row::timed("alignment, forward", forward)
        .with_rate(format!("{:.1} M members/s/core", rate * 1e-6))
        .asked("≥ 25 M", rate >= 25e6)
        .print();
    let aligned = align(&position, &candidate, &supports);
    let v = points(PARTICLES, 1.0, 3);
    let backward = median_secs(REPEATS, || align_vjp(&supports, &aligned, &v, &[]));
    let ratio = backward / forward;
    Row::timed("alignment, backward", backward).with_ratio(format!("{ratio:.2} × forward")).asked("≤ 3 ×", ratio <= 3.0).print();
}
