//! Every hot operation as a fraction of what the machine can do, in one run: `cargo bench --workspace --bench
//! speed`.
//!
//! `-- SECTION...` runs only the sections named (the machine always). Times are medians. A section is a file
//! with one function that takes the machine's rates, measures, and prints its rows; `SECTIONS` lists them.

mod alignment;
mod deformation;
mod dynamics;
mod growth;
mod loss;
mod machine;
mod particles;
mod rasterize;
mod second_core;
mod trained_scene;

use lgs_bench::machine::Machine;
use lgs_bench::memory::Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Measures and prints the rows of one section.
type Section = fn(&Machine);

/// Sections in the order of the report.
const SECTIONS: [(&str, Section); 7] = [
    ("dynamics", dynamics::run),
    ("alignment", alignment::run),
    ("growth", growth::run),
    ("second-core", second_core::run),
    ("rasterize", rasterize::run),
    ("loss", loss::run),
    ("deformation", deformation::run),
];

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with('-')).collect();
    let cores = rayon::current_num_threads();
    let machine = Machine::measure(cores);
    machine::print(&machine);
    for (name, run) in SECTIONS {
        if chosen.is_empty() || chosen.iter().any(|c| c == name) {
            run(&machine);
        }
    }
}
