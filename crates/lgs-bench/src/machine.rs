//! The rates that the machine reaches on the plainest form of what the kernels do.

use crate::matmul::Panels;
use crate::pairs::Tile;
use crate::timing::{REPEATS, median_secs};
use crate::triad::Triad;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Work of one measurement: matrix products, and passes of a tile over its list of Gaussians.
const PRODUCTS: usize = 400;
const PASSES: usize = 400;

/// What the machine reaches, on one core and on all of them together.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Cores of the run.
    pub cores: usize,
    /// Multiplications and additions in f32 per second, in products of 256×128 by 128×128 panels by the gemm library; each core has
    /// panels of its own, which stay in its cache.
    pub gemm: PerCore,
    /// Bytes per second of `a = b + s c` on arrays in memory: two reads and one write per element, in that count.
    pub bandwidth: PerCore,
    /// Pixel–Gaussian pairs evaluated and blended per second, on data in the first-level cache and without any control flow.
    pub pairs: PerCore,
}

/// A rate of one core and of all cores together.
#[derive(Clone, Copy, Debug)]
pub struct PerCore {
    /// With one core at work.
    pub single: f64,
    /// With all cores at work.
    pub all: f64,
}

impl Machine {
    /// Measures the machine with `cores` cores; takes seconds and about 1.6 GB of memory.
    #[must_use]
    pub fn measure(cores: usize) -> Self {
        let (one, all) = (pool(1), pool(cores));
        let both = |rate: &dyn Fn(&ThreadPool) -> f64| PerCore { single: rate(&one), all: rate(&all) };
        let mut triad = Triad::new(&all);
        let bandwidth = PerCore { single: triad.bytes_per_sec(&one), all: triad.bytes_per_sec(&all) };
        drop(triad);
        Self { cores, gemm: both(&gemm_rate), bandwidth, pairs: both(&pair_rate) }
    }
}

/// A pool of so many threads.
///
/// # Panics
/// If the threads can't be started.
#[must_use]
pub fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap_or_else(|error| panic!("pool of {threads} threads: {error}"))
}

/// Matrix products for the threads of a pool to share: what a second core brings where nothing is shared but the machine.
pub struct Products(Vec<Panels>);

impl Products {
    /// Panels for so many threads.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        Self((0..threads).map(|_| Panels::new()).collect())
    }

    /// Multiplications and additions of [`Self::multiply`].
    #[must_use]
    pub fn operations(&self) -> f64 {
        (self.share() * self.0.len()) as f64 * Panels::OPERATIONS
    }

    fn share(&self) -> usize {
        3 * PRODUCTS / self.0.len()
    }

    /// As many products for any number of threads, in a pool of so many.
    pub fn multiply(&mut self, pool: &ThreadPool) {
        let share = self.share();
        each_on_its_thread(pool, &mut self.0, |panels| (0..share).for_each(|_| panels.multiply()));
    }
}

/// Operations per second of matrix products.
fn gemm_rate(pool: &ThreadPool) -> f64 {
    let operations = (pool.current_num_threads() * PRODUCTS) as f64 * Panels::OPERATIONS;
    operations / on_every_thread(pool, Panels::new, |panels| (0..PRODUCTS).for_each(|_| panels.multiply()))
}

/// Pairs per second.
fn pair_rate(pool: &ThreadPool) -> f64 {
    let pairs = (pool.current_num_threads() * PASSES) as f64 * Tile::PAIRS;
    pairs / on_every_thread(pool, Tile::new, |tile| (0..PASSES).for_each(|_| tile.blend()))
}

/// Median seconds in which every thread of a pool does `work` on data of its own.
fn on_every_thread<T: Send>(pool: &ThreadPool, data: impl Fn() -> T + Sync, work: impl Fn(&mut T) + Sync) -> f64 {
    let mut all: Vec<T> = (0..pool.current_num_threads()).map(|_| data()).collect();
    median_secs(REPEATS, || each_on_its_thread(pool, &mut all, &work))
}

fn each_on_its_thread<T: Send>(pool: &ThreadPool, data: &mut [T], work: impl Fn(&mut T) + Sync) {
    pool.scope(|scope| {
        for own in data {
            let work = &work;
            scope.spawn(move |_| work(own));
        }
    });
}
