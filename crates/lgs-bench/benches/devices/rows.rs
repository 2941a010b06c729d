//! Rows of the table, and times of a device and of the processor.

use std::time::Instant;

use burn::tensor::Tensor;
use lgs_train::DeviceName;

/// Times that each is measured; the least counts.
const TURNS: usize = 3;

/// The heading.
pub(crate) fn head(name: DeviceName) {
    println!("| | {name} | processor | ratio |\n|---|---|---|---|");
}

/// A row: figures of the device and of the processor.
pub(crate) fn row(name: &str, [device, processor]: [f64; 2]) {
    println!("| {name} | {device:.3} | {processor:.3} | {:.2} × |", device / processor);
}

/// A row of shares of rates, in percent.
pub(crate) fn share(name: &str, rates: [f64; 2], of: [f64; 2]) {
    let [device, processor] = [0, 1].map(|i| 100.0 * rates[i] / of[i]);
    println!("| – in percent of {name} | {device:.1} | {processor:.1} | |");
}

/// Calls so many times; gives what the last call made.
pub(crate) fn last_of<T>(calls: usize, mut call: impl FnMut() -> T) -> T {
    (1..calls).for_each(|_| drop(call()));
    call()
}

/// Waits for a device to have made a tensor `[1]`: its data come only when they are read.
pub(crate) fn wait_for(tensor: Tensor<1>) {
    let values = tensor.into_data().try_to_vec::<f32>().expect("a number");
    assert!(values[0].is_finite(), "{values:?}");
}

/// The least seconds of two measurements, taken in turns; the first turn, in which kernels are compiled and
/// tile lists find their room, does not count.
pub(crate) fn least(mut runs: [&mut dyn FnMut(); 2]) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for turn in 0..=TURNS {
        for (run, least) in runs.iter_mut().zip(&mut least) {
            let begun = Instant::now();
            run();
            if turn > 0 {
                *least = least.min(begun.elapsed().as_secs_f64());
            }
        }
    }
    least
}
