//! Gain by a second core.

use crate::alignment::case;
use crate::particles::{cotangents, points, start, system};
use lgs_bench::machine::{Machine, pool};
use lgs_bench::table::{Row, section};
use lgs_bench::{OnThreads, Panels, REPEATS, medians_in_turns, times_in_turn};
use lgs_dynamics::{Alignment, AlignmentVjp, RolloutSpec, align, rollout, rollout_vjp};
use rayon::ThreadPool;
use std::sync::Mutex;

const PARTICLES: usize = 8192;
const STEPS: usize = 15;

/// Matrix products of a turn.
const PRODUCTS: usize = 1200;

/// Particles of the alignments, in arrays that are kept.
const ALIGNED: usize = 50_000;

pub(crate) fn run(_: &Machine) {
    section(&format!("second core (rollouts of {PARTICLES} particles × {STEPS} steps)"));
    let system = system();
    let spec = RolloutSpec::new(0.01, STEPS);
    let start = start(PARTICLES);
    let cotangents = cotangents(PARTICLES, STEPS + 1);
    compare("rollout, forward", 1.8, || rollout(&system, &start, &spec));
    compare("rollout, forward + backward", 1.8, || {
        rollout_vjp(&system, &spec, &rollout(&system, &start, &spec), &cotangents)
    });
    let (position, candidate, supports) = case(ALIGNED);
    let (aligned, v) = (align(&position, &candidate, &supports), points(ALIGNED, 1.0, 3));
    let (forward, backward) = (Mutex::new(Alignment::default()), Mutex::new(AlignmentVjp::default()));
    compare("alignment, forward", 1.8, || {
        forward.lock().expect("one at a time").update(&position, &candidate, &supports)
    });
    compare("alignment, backward", 1.8, || {
        backward.lock().expect("one at a time").update(&supports, &aligned, &v, &[])
    });
}

/// Prints how much faster two threads are than one, and how much faster they are at matrix products of their
/// own: on a machine that others use as well, a second core is not a whole one. All take turns, each for a
/// tenth of a second: threads need a while to fall asleep, and until then they are in the way of the other
/// pool's.
pub(crate) fn compare<T: Send>(name: &str, asked: f64, run: impl Fn() -> T + Sync) {
    let [one, two] = [pool(1), pool(2)];
    let times = two.install(|| times_in_turn(0.1, || drop(std::hint::black_box(run()))));
    let on = |pool: &ThreadPool| pool.install(|| (0..times).for_each(|_| drop(std::hint::black_box(run()))));
    let [mut alone, mut shared] = [1, 2].map(OnThreads::<Panels>::new);
    let turns: [&mut dyn FnMut(); 4] =
        [&mut || on(&one), &mut || on(&two), &mut || alone.run(&one, PRODUCTS), &mut || {
            shared.run(&two, PRODUCTS / 2)
        }];
    let secs = medians_in_turns(REPEATS, turns);
    let gain = secs[0] / secs[1];
    Row::timed(format!("{name}, 2 threads"), secs[1] / times as f64)
        .with_ratio(format!("{gain:.2} × 1 thread (GEMM {:.2} ×)", secs[2] / secs[3]))
        .asked(format!("≥ {asked} ×"), gain >= asked)
        .print();
}
