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
    /// The same by this project's kernel on the device.
    pub(crate) own_products: f64,
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
        if !is_cube(device) {
            let [products, memory, pairs] = processor.map(|rate| [rate; 2]);
            return Self { products, own_products: products[0], memory, pairs };
        }
        let [by_library, own_products] = plain::products(device, sizes);
        let device = [by_library, plain::memory(device, sizes), plain::pairs(device, sizes)];
        let [products, memory, pairs] = [0, 1, 2].map(|i| [device[i], processor[i]]);
        Self { products, own_products, memory, pairs }
    }

    /// Prints them.
    pub(crate) fn print(&self) {
        row("products of matrices in f32, GFLOP/s", self.products.map(|rate| rate * 1e-9));
        row("the same by the kernel of layers", [self.own_products * 1e-9, self.products[1] * 1e-9]);
        row("memory, a = b + s c, GB/s", self.memory.map(|rate| rate * 1e-9));
        row("pairs of pixel and Gaussian, blended without lists, G pairs/s", self.pairs.map(|r| r * 1e-9));
    }
}
