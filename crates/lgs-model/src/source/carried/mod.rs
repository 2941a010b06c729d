//! Gaussians that known paths carry, beside what moves them otherwise: things that cross their own width
//! within a few moments, and balls that turn far within the window, which images alone do not make a motion
//! follow.
//!
//! A path carries the Gaussians whose canonical centres lie in a ball around its first place, each the
//! nearest. They are where the motion of their kind has them, then turned about that place as far as the
//! thing is known to have turned, and shifted by the way along the path since then: what is learned is what
//! path and spin are off by.

mod model;
mod motion;
mod path;
#[cfg(test)]
mod tests;

pub(super) use model::CarriedSource;
pub use motion::CarriedMotion;
pub use path::{CarryingPath, place_at};
