//! The plainest form of what the kernels do, on every thread of a pool, and operations that take turns with
//! it.

use crate::threads::pool;
use crate::timing::{REPEATS, median_secs, medians_in_turns, times_in_turn};
use rayon::ThreadPool;

/// Rounds of a measurement.
const ROUNDS: usize = 400;

/// Work on data that stay in a core's cache.
pub trait Plain: Send {
    /// Operations or bytes of a round.
    const WORK: f64;

    /// The data.
    fn new() -> Self;

    /// Runs one round.
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

    /// So many rounds on every thread of a pool of as many threads.
    pub fn run(&mut self, pool: &ThreadPool, rounds: usize) {
        pool.scope(|scope| {
            for own in &mut self.0 {
                scope.spawn(move |_| (0..rounds).for_each(|_| own.round()));
            }
        });
    }

    /// Work per second in a pool of as many threads: the median of some measurements.
    pub(crate) fn rate(mut self, pool: &ThreadPool) -> f64 {
        self.work(ROUNDS) / median_secs(REPEATS, || self.run(pool, ROUNDS))
    }

    /// Operations or bytes of a number of rounds on every thread.
    fn work(&self, rounds: usize) -> f64 {
        (rounds * self.0.len()) as f64 * P::WORK
    }
}

/// Seconds that a turn lasts at least.
const TURN: f64 = 0.05;

/// The median seconds of an operation on all cores, and the rate of plain work that takes turns with it.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// Rate of the operation.
    pub secs: f64,
    /// Plain work per second.
    pub rate: f64,
}

impl Beside {
    /// Measures an operation and plain work in one pool, in turns that last equally long, so that other users
    /// of the machine slow both.
    pub fn measure<P: Plain, T: Send>(cores: usize, run: impl Fn() -> T + Sync) -> Self {
        let (pool, mut plain) = (pool(cores), OnThreads::<P>::new(cores));
        let mut run = || drop(std::hint::black_box(pool.install(&run)));
        let times = times_in_turn(TURN, &mut run);
        let turn = times as f64 * median_secs(1, &mut run);
        let rounds = ROUNDS * times_in_turn(turn, || plain.run(&pool, ROUNDS));
        let [secs, plain_secs] = medians_in_turns(
            REPEATS,
            [&mut || (0..times).for_each(|_| run()), &mut || plain.run(&pool, rounds)],
        );
        Self { secs: secs / times as f64, rate: plain.work(rounds) / plain_secs }
    }
}
