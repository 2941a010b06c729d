//! Training of a source model, DefGS or FreeGave (method §3), as a state machine that can be stopped and
//! resumed at any step.
//!
//! A step of [`SourceTrainer`] is one iteration: pick a frame, draw the deformed Gaussians, go back through
//! loss, rasterizer and network, densify, and take one step of Adam per parameter group.

mod background;
mod config;
mod config_groups;
mod densify;
mod density;
mod first_window;
mod flown;
mod following;
mod guide;
mod image_levels;
mod initial;
mod lacking;
mod motion;
mod noise;
mod order;
mod presets;
mod priors;
mod proposals;
mod relocation;
mod resolve;
mod rigidity;
mod schedule;
mod shading;
mod smoothing;
mod snapshot;
mod standard;
mod static_regulariser;
mod statistics;
mod trainer;
mod validate;

pub use config::SourceConfig;
pub use config_groups::{
    Antialias, DensifyConfig, DensifyMethod, GuideConfig, InitialPoints, LearningRates, McmcConfig,
    RigidityConfig, ShadingConfig, WarmupFrames,
};
pub(crate) use resolve::{position_unit, stretch_factor};
pub use trainer::SourceTrainer;
