//! The Lagrangian stages: distillation and the initial scene (1), photometric tuning of the dynamics (2),
//! refinement of the Gaussians (3).
//!
//! Stages 2 and 3 are trainers ([`crate::Trainer`]), which the pipeline drives.

mod bands_of_views;
mod body;
mod body_displacements;
mod config;
mod continuation;
mod counterfactual;
mod displacement;
mod drawn;
mod fit_dynamics;
mod frame_states;
mod held_to_source;
mod image_couples;
mod image_displacement;
mod image_hits;
mod image_laws;
mod image_poses;
mod initial_pose;
mod initialise_scene;
mod joined_objects;
mod law_choice;
mod light;
mod motion_options;
mod newton;
mod normal_equations;
mod object_tensors;
mod observation;
mod observed_motion;
mod opacity_prior;
mod pose_search;
mod recorded_bodies;
mod recorder;
mod rest_retuned;
mod scene_request;
mod shown_motions;
mod spread;
mod subset;
mod things;
mod thresholds;
mod tune_dynamics;
mod tune_gaussians;

pub use config::{FitDynamicsConfig, InitialVelocity, TuneDynamicsConfig, TuneGaussiansConfig};
pub use fit_dynamics::FitDynamics;
pub use held_to_source::{HeldToSource, Outcome, SourceOfScene, WorseThanSource, held_to_source};
pub(crate) use held_to_source::{load_rows, save_rows};
pub use initialise_scene::{InitialScene, initialise_scene};
pub use motion_options::MotionOptions;
pub use scene_request::InitialSceneRequest;
pub use tune_dynamics::TuneDynamics;
pub use tune_gaussians::TuneGaussians;

use burn::tensor::Device;
use lgs_data::dataset::Frame;
use lgs_model::{TensorFile, TensorFileError};

/// What a stage trains on, and where.
#[derive(Clone, Copy, Debug)]
pub struct TrainingData<'a> {
    /// Training frames.
    pub frames: &'a [Frame],
    /// Distance of the cameras from what they look at, world units.
    pub viewing_distance: f32,
    /// Seed of the run.
    pub seed: u64,
    /// Device without autodiff.
    pub device: &'a Device,
}

/// Rows of a checkpoint, one per dynamic Gaussian of a scene.
fn rows_of_gaussians<const D: usize>(
    file: &TensorFile,
    name: &str,
    expected: usize,
) -> Result<Vec<[f32; D]>, TensorFileError> {
    let rows: Vec<[f32; D]> = file.rows(name)?;
    if rows.len() == expected {
        Ok(rows)
    } else {
        Err(file.field(name, &format!("{expected} rows"), rows.len().to_string()))
    }
}
