//! Everything of LagrangeGS that touches a user's files, checkpoints excepted: splat files, camera lists,
//! image sets, point tracks and synthetic scenes.
//!
//! ```no_run
//! use lgs_data::dataset::{Dataset, LoadOptions};
//! let dataset = Dataset::load("scenes/fan".as_ref(), &LoadOptions::default(), &|_, _| {})?;
//! println!("{} training images", dataset.splits["train"].len());
//! # Ok::<(), lgs_data::dataset::DatasetError>(())
//! ```
//!
//! Invariants: a reader returns plain core values or one error that names the file, the field, what was
//! expected and what was found, and checks sizes before it allocates. A writer leaves either the whole file
//! or none. Nothing is ever written into a dataset folder that already holds something. The crate knows
//! nothing of training, and its synthetic scenes share no code with the rasterizer or the integrators, so
//! that they can judge both.

pub mod cameras;
pub mod dataset;
pub mod edit;
mod error;
pub mod files;
pub mod frames;
pub mod hash;
mod names;
pub mod ply;
pub mod pth;
pub mod splats;
mod staged;
pub mod synth;
pub mod testing;
mod thresholds;
pub mod tracks;
mod unfinished;

pub use error::ReadError;
pub use staged::StagedFolder;
pub use unfinished::{Abandoned, Kept, abandon};
