//! Multilayer perceptrons on slices: values, gradients by parameters and inputs, and, for smooth
//! activations, the gradient of a scalar output by the inputs with its own backward pass.
//!
//! ```
//! use lgs_nn::{Activation, MlpLayout, MlpShape, MlpSizes, init_uniform};
//! use lgs_nn::{CallArrays, Keep, Mlp, Scratch, Tape};
//! let sizes = MlpSizes { inputs: 3, depth: 2, width: 32, outputs: 4, skip_layer: MlpSizes::NO_SKIP };
//! let layout = MlpLayout::new(sizes, &mut 0);
//! let mut params = vec![0.0; layout.end()];
//! init_uniform(layout.linears(), &mut params, &mut lgs_core::stream(7, "example", 0));
//! let mlp = Mlp::new(MlpShape::new(layout, Activation::Silu), &params);
//! let rows = 5;
//! let (mut tape, mut scratch) = (Tape::new(&mlp, rows), Scratch::new(&mlp, rows));
//! let mut y = vec![0.0; 4 * rows];
//! let arrays = CallArrays { tape: &mut tape, scratch: &mut scratch };
//! mlp.output(&[&vec![0.5; 3 * rows]], arrays, Keep::Result, &mut y);
//! ```
//!
//! A call works on a block of rows (particles, Gaussians or times) on one thread; callers run blocks in
//! parallel. Inputs and outputs are feature-major, `[features, rows]`; hidden layers lie row by row,
//! `[rows, units]`, so that every matrix product reads both operands as they lie. All parameters of a model
//! are one vector in which [`LinearRange`] tells the place of a layer and [`ParamRange`] the name of an
//! array.
//!
//! Invariants: the crate knows neither Gaussians nor mechanics nor tensors. Every sum has an order that
//! depends on the shapes alone, so the bits of a result depend neither on the width of the processor's
//! vectors nor on the number of threads.

mod activation;
mod buffer;
pub mod encoding;
mod epilogue;
mod gradients;
mod init;
mod layer;
mod layout;
mod mlp;
mod network;
mod packed;
mod product;
mod second_order;
mod sums;
mod tape;

pub use gradients::MlpGradients;
pub use init::init_uniform;
pub use layout::{Activation, LinearRange, MlpLayout, MlpShape, MlpSizes, NamedLayers, ParamRange};
pub use mlp::Mlp;
pub use network::OutputCotangents;
pub use tape::{CallArrays, Keep, Scratch, Tape};
