//! Training of a source model, DefGS or FreeGave (method §3), as a state machine that can be stopped and
//! resumed at any step.
//!
//! A step of [`SourceTrainer`] is one iteration: pick a frame, draw the deformed Gaussians, go back through
//! loss, rasterizer and network, densify, and take one step of Adam per parameter group.

mod config;
mod config_groups;
mod densify;
mod density;
mod guide;
mod initial;
mod lacking;
mod motion;
mod noise;
mod order;
mod presets;
mod priors;
mod proposals;
mod relocation;
mod rigidity;
mod schedule;
mod smoothing;
mod snapshot;
mod static_regulariser;
mod statistics;
mod trainer;
mod validate;

pub use config::SourceConfig;
pub(crate) use config::stretch_factor;
pub use config_groups::{
    Antialias, DensifyConfig, DensifyMethod, GuideConfig, InitialPoints, LearningRates, McmcConfig,
    RigidityConfig, WarmupFrames,
};
pub use trainer::SourceTrainer;
