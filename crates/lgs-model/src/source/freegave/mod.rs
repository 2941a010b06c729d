//! FreeGave (method §3.2): a deformation network up to a time T*, and beyond it a velocity
//! field that carries every Gaussian on.
//!
//! A Gaussian's code is a function of its canonical position; it mixes K motion bases, each a rigid twist
//! that changes with time, into the twist that moves this Gaussian ([`twist`]). The networks run as one fused
//! operation on slices ([`network`]), which [`tensor`] makes differentiable inside Burn; [`mod@reference`] is
//! its twin in plain tensor operations.

mod advection;
mod call;
mod config;
#[cfg(feature = "gpu")]
mod cube;
mod file;
mod inflated;
pub mod input;
mod model;
mod motion;
pub mod network;
pub mod reference;
pub mod tensor;
pub mod twist;

pub use config::{FreeGaveConfig, FreeGaveLayout};
pub use input::{Advection, Learns};
pub use model::FreeGave;
pub(super) use motion::KIND;
pub use network::FreeGaveNetworks;
