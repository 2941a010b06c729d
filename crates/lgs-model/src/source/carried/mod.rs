//! Gaussians that known paths carry, beside what moves them otherwise: things that cross their own width
//! within a few moments, which images alone do not make a motion follow.
//!
//! A path carries the Gaussians whose canonical centres lie in a ball around its first place, each the
//! nearest. They are where the motion of their kind has them, shifted by the way along the path since then:
//! what is learned is how they turn and what the path is off by.

mod model;
mod motion;
mod path;
#[cfg(test)]
mod tests;

pub(super) use model::CarriedSource;
pub use motion::CarriedMotion;
pub use path::{CarryingPath, place_at};
