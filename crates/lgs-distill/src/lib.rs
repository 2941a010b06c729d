//! Stage 1: from trajectories of particles to Lagrangian systems. Nothing here knows of images.
//!
//! [`partition`] tells static particles from moving ones and groups these into objects; [`distill`] finds U,
//! Q and the initial state of one object; [`distill_scene`] does both. All are pure functions of
//! trajectories, configuration and seed, for any number of threads.
//!
//! ```
//! use lgs_distill::{DistillConfig, Trajectories, distill};
//! // A few points that fall from rest.
//! let times: Vec<f32> = (0..76).map(|i| 0.01 * i as f32).collect();
//! let corners = [[0.0, 0.0, 1.0], [0.2, 0.0, 1.0], [0.0, 0.2, 1.0], [0.0, 0.0, 1.2], [0.2, 0.2, 1.1]];
//! let positions = times.iter().map(|t| corners.map(|[x, y, z]| [x, y, z - t * t]).to_vec()).collect();
//! let found = distill(&Trajectories { times, positions }, None, &DistillConfig::default(), 0, &mut |_| {})?;
//! let gravity = found.report.law.map(|law| law.gravity[2]);
//! assert!((gravity.unwrap_or(0.0) + 2.0).abs() < 1e-3);
//! # Ok::<(), lgs_distill::DistillError>(())
//! ```
//!
//! What it refuses: contacts, explicit time dependence, and objects that share particles.

mod acceleration_match;
mod adam;
mod anchors;
mod balance;
mod chebyshev;
mod config;
mod dense;
mod distill;
mod error;
mod fitted_law;
mod k_means;
mod law;
mod law_fit;
mod law_select;
mod law_system;
mod linear_part;
mod network_fit;
mod network_training;
mod partition;
mod pose;
mod regroup;
mod report;
mod rigid_body;
mod scene;
mod seen;
mod shared_motion;
mod targets;
#[cfg(test)]
mod testing;
mod trajectories;

pub use config::{
    DistillConfig, MatchingConfig, PartitionConfig, PartitionMethod, RolloutConfig, SharedMotionKind,
};
pub use distill::{DistillProgress, DistillStage, Distilled, anchored_supports, distill};
pub use error::DistillError;
pub use law::{Law, Stiffness, Terms};
pub use linear_part::LinearPart;
pub use partition::{Partition, partition, typical_displacement};
pub use regroup::regroup;
pub use report::{DistillReport, PathKind};
pub use scene::{SceneConfig, SceneDistillation, distill_objects, distill_scene, find_objects};
pub use trajectories::Trajectories;
