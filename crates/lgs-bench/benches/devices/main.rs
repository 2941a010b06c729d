//! What training asks of a device and of the processor, in turns, each as a share of what it can do, as rows
//! of a Markdown table:
//!
//! `cargo bench -p lgs-bench --features gpu --bench devices -- NAME [--tiny]`, with a NAME as `lagrangegs
//! info --devices` lists them. `--tiny` takes seconds, on software drivers too; its figures say nothing.

mod dynamics;
#[path = "../speed/particles.rs"]
#[allow(dead_code, reason = "the other bench uses the rest")]
mod particles;
mod plain;
mod rasterizer;
mod rates;
mod rows;
#[path = "../speed/trained_scene.rs"]
#[allow(dead_code, reason = "the other bench uses the rest")]
mod trained_scene;
mod training;

use std::error::Error;

use lgs_train::DeviceName;
use rates::Rates;

/// Sizes of the measurements.
#[derive(Clone, Copy)]
struct Sizes {
    gaussians: usize,
    /// Width and height of images.
    pixels: u32,
    /// Training steps that are timed together.
    steps: usize,
    /// Particles of a rollout, and its steps.
    rolled: [usize; 2],
    /// Rows and columns of the matrices of products.
    matrix: usize,
    /// Numbers of an array in memory.
    array: usize,
    /// Passes over a tile's Gaussians.
    passes: u32,
}

/// Those of the paper's scenes.
const FULL: Sizes = Sizes {
    gaussians: 100_000,
    pixels: 800,
    steps: 50,
    rolled: [8192, 75],
    matrix: 4096,
    array: 1 << 25,
    passes: 200,
};

/// Those of a run that only goes through all of it.
const TINY: Sizes =
    Sizes { gaussians: 300, pixels: 32, steps: 4, rolled: [64, 4], matrix: 64, array: 1 << 12, passes: 1 };

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds an option of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let name: DeviceName = arguments.first().ok_or("usage: devices NAME [--tiny]")?.parse()?;
    let sizes = if arguments.iter().any(|a| a == "--tiny") { TINY } else { FULL };
    let devices = [name.open()?, DeviceName::Cpu.open()?];
    rows::head(name);
    let rates = Rates::of(&devices, &sizes);
    rates.print();
    rasterizer::run(&sizes, &devices, &rates);
    dynamics::run(&sizes, &devices, &rates);
    training::run(&sizes, &devices)
}
