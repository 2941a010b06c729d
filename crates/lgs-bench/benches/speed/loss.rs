//! The photometric loss with its gradient, in passes over memory.

use lgs_bench::machine::Machine;
use lgs_bench::table::{Row, section};
use lgs_bench::{REPEATS, median_secs};
use lgs_render::{PhotometricVjp, photometric, photometric_vjp};

const EDGE: usize = 800;
const LAMBDA: f32 = 0.2;

pub(crate) fn run(machine: &Machine) {
    section(&format!("photometric loss ({EDGE}×{EDGE}; a pass reads or writes the image once)"));
    let image = |phase: usize| -> Vec<[f32; 3]> {
        (0..EDGE * EDGE).map(|i| [0, 1, 2].map(|c| ((i * 31 + i / EDGE + c + phase) % 97) as f32 / 97.0)).collect()
    };
    let (rendered, target) = (image(0), image(5));
    let pass = size_of_val(&rendered[..]) as f64 / machine.bandwidth.all;
    let forward = median_secs(REPEATS, || photometric(&rendered, &target, EDGE, EDGE, LAMBDA));
    Row::timed("L1 + SSIM, forward", forward).with_ratio(format!("{:.1} passes", forward / pass)).print();
    let mut pulled = PhotometricVjp::default();
    let both = median_secs(REPEATS, || pulled.update(&rendered, &target, EDGE, EDGE, LAMBDA));
    let passes = both / pass;
    Row::timed("L1 + SSIM, forward + backward", both)
        .with_ratio(format!("{passes:.1} passes"))
        .asked("≤ 12 passes", passes <= 12.0)
        .print();
    let anew = median_secs(REPEATS, || photometric_vjp(&rendered, &target, EDGE, EDGE, LAMBDA));
    Row::timed("the same, the gradient allocated anew", anew).with_ratio(format!("{:.1} passes", anew / pass)).print();
}
