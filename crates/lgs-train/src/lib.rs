//! Training, from images to a Lagrangian scene: configuration, stages, densification, checkpoints, events and
//! run folders.
//!
//! [`train`] drives four stages, each a state machine that can be stopped and resumed at any step with the
//! same result: the source model ([`source`]), distillation (stage 1, `lgs_distill`), photometric tuning of
//! the dynamics (stage 2) and refinement of the Gaussians (stage 3, both in [`stages`]).
//!
//! The crate prints nothing: progress goes to a callback, the training curve to `events.jsonl`.

mod adam;
mod budget;
pub mod cameras;
pub mod checkpoint;
mod clock;
mod cloud_rates;
mod cloud_tensors;
pub mod config;
mod contact;
mod data_summary;
pub mod device;
mod driver;
mod error;
mod estimate;
pub mod events;
mod figures;
mod import;
mod layers;
mod lighting;
mod pipeline;
mod preset;
mod resolve;
mod run_folder;
pub mod schedule;
mod shadows;
pub mod source;
pub mod stages;
mod thresholds;
pub mod tracks;
mod trainable_cloud;
mod training_loop;
mod turned_colors;
mod view;
mod window;

pub use checkpoint::Stage;
pub use clock::Clock;
pub use config::{Preset, TrainConfig};
pub use data_summary::DataSummary;
pub use device::DeviceName;
pub use driver::{Control, Glance, Onlooker, Progress, SceneTrainer, Status, Trainer};
pub use error::TrainError;
pub use estimate::{Estimate, estimate};
pub use figures::{Figures, StepReport};
pub use import::imported_source;
pub use pipeline::{Trained, train};
pub use resolve::Difference;
pub use run_folder::{RunDataset, RunFolder};
pub use window::{check_window, learns_no_motion};
