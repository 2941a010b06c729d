//! Settings of the motions that source models learn: networks, velocity fields and their training.

mod advection;
mod deformation;
mod heads;
mod ranges;
mod velocity;

pub use advection::AdvectionConfig;
pub use deformation::{DeformationConfig, NetworkLayout};
pub use heads::{DELTAS, HeadInit, MotionHead, ScaleMode};
pub use velocity::{RotationForm, VelocityConfig};
