//! The photometric loss with its gradient, in passes over memory.

use lgs_bench::machine::{Machine, pool};
use lgs_bench::table::{Row, section};
use lgs_bench::triad::Triad;
use lgs_bench::{REPEATS, medians_in_turns};
use lgs_render::{PhotometricVjp, photometric, photometric_vjp};
use std::hint::black_box;

const EDGE: usize = 800;
const LAMBDA: f32 = 0.2;
/// Calls of a turn, which then takes about as long as a turn of memory.
const CALLS: usize = 20;

/// Measured in turns with the memory that it is compared with: other users of a machine slow the two
/// differently.
pub(crate) fn run(machine: &Machine) {
    section(&format!("photometric loss ({EDGE}×{EDGE}; a pass reads or writes the image once)"));
    let image = |phase: usize| -> Vec<[f32; 3]> {
        (0..EDGE * EDGE)
            .map(|i| [0, 1, 2].map(|c| ((i * 31 + i / EDGE + c + phase) % 97) as f32 / 97.0))
            .collect()
    };
    let (rendered, target, mut pulled) = (image(0), image(5), PhotometricVjp::default());
    let mut triad = Triad::new(&pool(machine.cores));
    let [memory, forward, both, anew] = medians_in_turns(
        REPEATS,
        [
            &mut || triad.run(),
            &mut || calls(|| photometric(&rendered, &target, [EDGE, EDGE], LAMBDA)),
            &mut || calls(|| pulled.update(&rendered, &target, [EDGE, EDGE], LAMBDA)),
            &mut || calls(|| photometric_vjp(&rendered, &target, [EDGE, EDGE], LAMBDA)),
        ],
    );
    let pass = size_of_val(&rendered[..]) as f64 * memory / Triad::BYTES;
    Row::figure("memory, in turns with the loss", format!("{:.2} GB/s", Triad::BYTES / memory * 1e-9))
        .print();
    let row = |name: &str, secs: f64| {
        let passes = secs / CALLS as f64 / pass;
        (passes, Row::timed(name, secs / CALLS as f64).with_ratio(format!("{passes:.1} passes")))
    };
    row("L1 + SSIM, forward", forward).1.print();
    let (passes, both) = row("L1 + SSIM, forward + backward", both);
    both.asked("≤ 12 passes", passes <= 12.0).print();
    row("the same, the gradient allocated anew", anew).1.print();
}

fn calls<T>(mut call: impl FnMut() -> T) {
    for _ in 0..CALLS {
        black_box(call());
    }
}
