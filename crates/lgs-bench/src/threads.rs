//! Pools of threads for measurements.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A pool of so many threads.
///
/// # Panics
/// If the threads can't be started.
#[must_use]
pub fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap_or_else(|error| panic!("pool of {threads} threads: {error}"))
}
