//! Tools of the benchmarks: clocks and medians, the rates of the machine they run on, a table, and a
//! count of allocated bytes.
//!
//! `cargo bench --workspace --bench speed` measures the machine first and everything else after it, in one
//! run, so that each figure is a ratio of two numbers taken side by side. Nothing here is for use outside of
//! benchmarks, and no test asserts a time.

pub mod machine;
mod matmul;
pub mod memory;
mod pairs;
mod plain;
pub mod table;
mod threads;
mod timing;
pub mod triad;

pub use matmul::Panels;
pub use pairs::Tile;
pub use plain::{Beside, OnThreads, Plain};
pub use timing::{REPEATS, median_secs, medians_in_turns, times_in_turn};
