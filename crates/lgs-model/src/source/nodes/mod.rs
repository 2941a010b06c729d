//! Gaussians that follow sparse control nodes (method §3.6), in the spirit of SC-GS.
//!
//! A network moves and turns a few hundred nodes; every Gaussian follows the few of them that weigh most at
//! its place, with weights that are learned, so that a time costs a network for the nodes and next to nothing
//! per Gaussian. Gaussians and nodes carry features, at first their colours, which keep apart in motion what
//! is near in space only. The blend is one fused operation on slices ([`blend`]), differentiable inside Burn
//! ([`tensor`]); [`mod@reference`] is its twin in plain tensor operations.

pub mod blend;
mod choose;
#[cfg(feature = "gpu")]
mod cube;
mod mixture;
mod model;
mod motion;
pub mod neighbors;
pub mod node;
mod priors;
pub mod reference;
mod structure;
mod sums;
pub mod tensor;
#[cfg(test)]
mod tests;

pub use model::ControlNodes;
pub(super) use motion::KIND;
