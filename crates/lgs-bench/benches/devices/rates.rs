//! What a device and the processor can do: the plainest form of what kernels do, by themselves.

use burn::tensor::Device;
use lgs_bench::machine::Machine;
use lgs_tensor::cube::is_cube;

use crate::rows::row;
use crate::{Sizes, plain};

/// Rates of the device and of the processor, on all its cores.
pub(crate) struct Rates {
    /// Multiplications and additions in f32 per second, in products of matrices.
    pub(crate) products: [f64; 2],
    /// Bytes per second of `a = b + s c`, two reads and a write counted.
    pub(crate) memory: [f64; 2],
    /// Pixel–Gaussian pairs evaluated and blended per second, without lists, bounds and early exit.
    pub(crate) pairs: [f64; 2],
}

impl Rates {
    /// Measures both.
    pub(crate) fn of([device, _]: &[Device; 2], sizes: &Sizes) -> Self {
        let machine = Machine::measure(rayon::current_num_threads());
        let processor = [machine.gemm.all, machine.bandwidth.all, machine.pairs.all];
        let has_kernels = is_cube(device);
        let device = if has_kernels {
            [plain::products(device, sizes), plain::memory(device, sizes), plain::pairs(device, sizes)]
        } else {
            processor
        };
        let [products, memory, pairs] = [0, 1, 2].map(|i| [device[i], processor[i]]);
        Self { products, memory, pairs }
    }

    /// Prints them.
    pub(crate) fn print(&self) {
        row("products of matrices in f32, GFLOP/s", self.products.map(|rate| rate * 1e-9));
        row("memory, a = b + s c, GB/s", self.memory.map(|rate| rate * 1e-9));
        row("pairs of pixel and Gaussian, blended without lists, G pairs/s", self.pairs.map(|r| r * 1e-9));
    }
}
