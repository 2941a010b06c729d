//! The plainest form of what the kernels do, on every thread of a pool, and operations that take turns with it.

use crate::machine::pool;
use crate::timing::{REPEATS, median_secs, medians_in_turns};
use rayon::ThreadPool;

/// Rounds of a measurement, per thread.
const ROUNDS: usize = 400;

/// Work on data that stay in a core's cache.
pub trait Plain: Send {
    /// What a round counts.
    const WORK: f64;

    /// The data.
    fn new() -> Self;

    /// One round.
    fn round(&mut self);
}

/// Plain work on data of every thread's own: nothing is shared but the machine.
pub struct OnThreads<P>(Vec<P>);

impl<P: Plain> OnThreads<P> {
    /// Data for so many threads.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        Self((0..threads).map(|_| P::new()).collect())
    }

    /// So many rounds in all, a multiple of the threads, in a pool of as many threads.
    pub fn run(&mut self, pool: &ThreadPool, rounds: usize) {
        let share = rounds / self.0.len();
        pool.scope(|scope| {
            for own in &mut self.0 {
                scope.spawn(move |_| (0..share).for_each(|_| own.round()));
            }
        });
    }

    /// Work per second in a pool of as many threads: the median of some measurements.
    pub(crate) fn rate(mut self, pool: &ThreadPool) -> f64 {
        let rounds = ROUNDS * self.0.len();
        rounds as f64 * P::WORK / median_secs(REPEATS, || self.run(pool, rounds))
    }
}

/// The median seconds of an operation on all cores, and the rate of plain work that takes turns with it.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// Of the operation.
    pub secs: f64,
    /// Plain work per second.
    pub rate: f64,
}

impl Beside {
    /// Measures an operation and plain work in one pool, in turns that last equally long, so that other users of the machine slow both.
    pub fn measure<P: Plain, T: Send>(cores: usize, run: impl Fn() -> T + Sync) -> Self {
        let (pool, mut plain) = (pool(cores), OnThreads::<P>::new(cores));
        let mut run = || drop(std::hint::black_box(pool.install(&run)));
        let some = ROUNDS * cores;
        let per_round = median_secs(1, || plain.run(&pool, some)) / some as f64;
        // Turns of the operation are repeated to a twentieth of a second at least.
        let once = median_secs(1, &mut run);
        let times = (0.05 / once).ceil().max(1.0);
        let share = (times * once / per_round / cores as f64).ceil();
        let rounds = share as usize * cores;
        let [secs, plain_secs] =
            medians_in_turns(REPEATS, [&mut || (0..times as usize).for_each(|_| run()), &mut || plain.run(&pool, rounds)]);
        Self { secs: secs / times, rate: rounds as f64 * P::WORK / plain_secs }
    }
}
