//! The machine's own rates.

use lgs_bench::machine::{Machine, PerCore};
use lgs_bench::table::{Row, section};

pub(crate) fn print(machine: &Machine) {
    section(&format!("machine ({} cores)", machine.cores));
    print_rate("f32 products 256×128×128 of the gemm library", machine.gemm, "GFLOP/s");
    print_rate("memory, a = b + s c on 3 × 512 MiB", machine.bandwidth, "GB/s");
    print_rate("pixel–Gaussian pairs, blended in L1", machine.pairs, "G pairs/s");
}

fn print_rate(name: &str, rate: PerCore, unit: &str) {
    let row = |name: String, rate: f64| Row::figure(name, format!("{:.2} {unit}", rate * 1e-9));
    row(format!("{name}, 1 core"), rate.single).print();
    row(format!("{name}, all cores"), rate.all)
        .with_ratio(format!("{:.2} × 1 core", rate.all / rate.single))
        .print();
}
