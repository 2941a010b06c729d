//! Stage 1: from trajectories of particles to Lagrangian systems. Nothing here knows of images.
//!
//! [`find_objects`] tells static particles from moving ones and groups these into objects; [`distill`] finds
//! U, Q and the initial state of one object, [`distill_objects`] of all. All are pure functions of
//! trajectories, configuration and seed, for any number of threads.
//!
//! ```
//! use lgs_distill::{DistillConfig, Trajectories, distill};
//! // A few points that fall from rest.
//! let times: Vec<f32> = (0..76).map(|i| 0.01 * i as f32).collect();
//! let corners = [[0.0, 0.0, 1.0], [0.2, 0.0, 1.0], [0.0, 0.2, 1.0], [0.0, 0.0, 1.2], [0.2, 0.2, 1.1]];
//! let positions = times.iter().map(|t| corners.map(|[x, y, z]| [x, y, z - t * t]).to_vec()).collect();
//! let trajectories = Trajectories::unweighted(times, positions);
//! let found = distill(&trajectories, &DistillConfig::default(), 0, &mut |_| {})?;
//! let law = found.report().generalised.as_ref().map(|found| &found.law);
//! assert_eq!(law.map(|law| law.terms[0].kind.name()), Some("uniform-field"));
//! assert!(law.is_some_and(|law| (law.parameters[2] + 2.0).abs() < 1e-3));
//! # Ok::<(), lgs_distill::DistillError>(())
//! ```
//!
//! Bodies collide with planes, not with each other. The crate refuses explicit time dependence, and objects
//! that share particles.

mod config;
mod couple;
mod distilled;
mod error;
mod handled;
mod laws;
mod motion;
mod networks;
mod object;
mod particles;
mod poses;
mod progress;
mod report;
mod scene;
mod segmentation;
mod shared_support;
#[cfg(test)]
mod testing;
mod thresholds;
mod trajectories;

pub use config::{
    Alignment, CoordinatesKind, DistillConfig, DynamicsKind, MatchingConfig, PartitionConfig,
    PartitionMethod, RolloutConfig, SharedMotionKind, TargetKind,
};
pub use couple::may_be_a_pair;
pub use distilled::{Distilled, DistilledLaw, DistilledParticles};
pub use error::DistillError;
pub use handled::{distill_handled, is_handled};
pub use laws::linear::law::Law;
pub use laws::linear::part::LinearPart;
pub use laws::linear::terms::{Stiffness, Terms};
pub use motion::object_motion::PathKind;
pub use object::{distill, known_impacts};
pub use poses::{BodyPoses, couple_of_poses, law_of_poses, part_laws_of_poses};
pub use progress::{DistillObserver, DistillProgress, DistillStage, LawSearch};
pub use report::{DistillReport, GeneralisedReport, PartLaw, PartLaws};
pub use scene::{SceneDistillation, distill_objects};
pub use segmentation::partition::Partition;
pub use segmentation::{find_objects, find_objects_beside, partition};
pub use thresholds::{FEWEST_SAMPLES, MOST_REACH};
pub use trajectories::Trajectories;
