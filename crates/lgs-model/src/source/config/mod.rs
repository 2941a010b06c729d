//! Settings of the motions that source models learn: networks, velocity fields and their training.

mod advection;
mod deformation;
mod heads;
mod nodes;
mod ranges;
mod velocity;

pub use advection::AdvectionConfig;
pub use deformation::{DeformationConfig, NetworkLayout};
pub use heads::{DELTAS, HeadInit, MotionHead, ScaleMode};
pub(super) use nodes::MAX_NEIGHBORS;
pub use nodes::NodesConfig;
pub use velocity::{RotationForm, VelocityConfig};
