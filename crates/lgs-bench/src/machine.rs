//! The rates that the machine reaches on the plainest form of what the kernels do.

use crate::matmul::Panels;
use crate::pairs::Tile;
use crate::plain::OnThreads;
use crate::triad::Triad;

pub use crate::threads::pool;

/// Rates that the machine reaches, on one core and on all of them together.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Cores of the run.
    pub cores: usize,
    /// Multiplications and additions in f32 per second, in products of 256×128 by 128×128 panels by the gemm
    /// library; each core has panels of its own, which stay in its cache.
    pub gemm: PerCore,
    /// Bytes per second of `a = b + s c` on arrays in memory: two reads and one write per element, in that
    /// count.
    pub bandwidth: PerCore,
    /// Pixel–Gaussian pairs evaluated and blended per second, on data in the first-level cache and without
    /// any control flow.
    pub pairs: PerCore,
}

/// A rate of one core and of all cores together.
#[derive(Clone, Copy, Debug)]
pub struct PerCore {
    /// Rate with one core at work.
    pub single: f64,
    /// Rate with all cores at work.
    pub all: f64,
}

impl Machine {
    /// Measures the machine with `cores` cores; takes seconds and about 1.6 GB of memory.
    #[must_use]
    pub fn measure(cores: usize) -> Self {
        let (one, all) = (pool(1), pool(cores));
        let mut triad = Triad::new(&all);
        let bandwidth = PerCore { single: triad.bytes_per_sec(&one), all: triad.bytes_per_sec(&all) };
        drop(triad);
        let gemm = PerCore {
            single: OnThreads::<Panels>::new(1).rate(&one),
            all: OnThreads::<Panels>::new(cores).rate(&all),
        };
        let pairs = PerCore {
            single: OnThreads::<Tile>::new(1).rate(&one),
            all: OnThreads::<Tile>::new(cores).rate(&all),
        };
        Self { cores, gemm, bandwidth, pairs }
    }
}
