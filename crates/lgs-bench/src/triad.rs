//! Memory bandwidth.

use crate::timing::{REPEATS, median_secs};
use rayon::ThreadPool;
use rayon::prelude::*;

/// Elements of an array: 512 MiB each, so that no last-level cache of today holds a part worth mentioning.
const ELEMENTS: usize = 1 << 27;

/// Elements of a task.
const CHUNK: usize = 1 << 18;

/// Three arrays in memory, for `a = b + s c`.
pub struct Triad {
    a: Vec<f32>,
    b: Vec<f32>,
    c: Vec<f32>,
}

impl Triad {
    /// Arrays whose pages have been touched by `pool`.
    #[must_use]
    pub fn new(pool: &ThreadPool) -> Self {
        let filled = |value: f32| {
            pool.install(|| {
                (0..ELEMENTS).into_par_iter().with_min_len(CHUNK).map(|_| value).collect::<Vec<_>>()
            })
        };
        Self { a: filled(0.0), b: filled(1.0), c: filled(2.0) }
    }

    /// Bytes per second of `a = b + s c`.
    pub(crate) fn bytes_per_sec(&mut self, pool: &ThreadPool) -> f64 {
        Self::BYTES / median_secs(REPEATS, || pool.install(|| self.run()))
    }

    /// Bytes that [`Triad::run`] reads and writes, both counted.
    pub const BYTES: f64 = (3 * ELEMENTS * size_of::<f32>()) as f64;

    /// `a = b + s c` once, in the current pool.
    pub fn run(&mut self) {
        self.a.par_chunks_mut(CHUNK).zip(self.b.par_chunks(CHUNK)).zip(self.c.par_chunks(CHUNK)).for_each(
            |((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 3.0 * c;
                }
            },
        );
    }
}
