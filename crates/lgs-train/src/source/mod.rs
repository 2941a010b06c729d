//! Training of a source model, DefGS or FreeGave (`reference-systems.md` §2 to §4), as a state machine that
//! can be stopped and resumed at any step.
//!
//! [`SourceTrainer::step`] is one iteration: pick a frame, draw the deformed Gaussians, go back through loss,
//! rasterizer and network, densify, and take one step of Adam per parameter group.

mod advection;
mod config;
mod densify;
mod guide;
mod initial;
mod motion;
mod order;
mod params;
mod presets;
mod rigidity;
mod schedule;
mod static_regulariser;
mod trainer;

pub use advection::AdvectionConfig;
pub(crate) use config::stretch_factor;
pub use config::{
    DensifyConfig, GuideConfig, InitialPoints, LearningRates, RigidityConfig, SourceConfig, WarmupFrames,
};
pub use densify::{Attributes, DensifyPlan, DensifyStatistics};
pub use initial::initial_cloud;
pub use schedule::log_linear;
pub use trainer::{SourceTrainer, StepReport};
