//! Motion of a source model's Gaussians as training learns it: the part of a trainer that a kind of source
//! model brings.

use burn::tensor::Tensor;
use lgs_core::GaussianCloud;

use super::config::{AdvectionConfig, DeformationConfig, ScaleMode, VelocityConfig};
use super::input::InputFrame;
use super::model::SourceModel;

/// A frame's time and the state of the training schedule.
#[derive(Clone, Copy)]
pub struct Moment {
    /// Time of the frame.
    pub time: f32,
    /// Iteration of the training.
    pub iteration: usize,
    /// Last time that training has come to.
    pub window_end: f32,
}

/// Networks that move Gaussians, without their parameters, which a trainer keeps as one flat vector.
pub trait SourceMotion {
    /// Fresh parameters.
    fn init(&self, seed: u64) -> Vec<f32>;

    /// Number of parameters.
    fn parameters(&self) -> usize;

    /// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, as they are drawn
    /// in training.
    fn poses(&self, network: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, at: Moment) -> Tensor<2>;

    /// A cost of the motion beside the photometric loss, for canonical Gaussians that are constants; nothing
    /// where the kind has none.
    fn prior(&self, _network: &Tensor<1>, _canonical: &Canonical, _at: Moment) -> Option<Tensor<1>> {
        None
    }

    /// The meaning of the scale part of pose rows.
    fn scale_mode(&self) -> ScaleMode;

    /// The model of canonical Gaussians and parameters.
    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel>;
}

/// Canonical positions `[n, 3]` and quaternions `[n, 4]`, as constants.
pub struct Canonical {
    /// Positions `[n, 3]`, world units.
    pub means: Tensor<2>,
    /// Quaternions `[n, 4]`, w first.
    pub rotations: Tensor<2>,
}

/// Properties of the captured sequence that training a kind of source model needs beside its settings.
#[derive(Clone, Copy)]
pub struct Captured {
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Last time of the training images.
    pub time_window: f32,
    /// Seed of the run.
    pub seed: u64,
}

/// Settings of motions; each kind reads those that it has.
#[derive(Clone, Copy)]
pub struct MotionConfig<'a> {
    /// The deformation network.
    pub deformation: &'a DeformationConfig,
    /// The velocity field, of FreeGave alone.
    pub velocity: Option<&'a VelocityConfig>,
    /// Training of the velocity field.
    pub advection: Option<&'a AdvectionConfig>,
}

impl MotionConfig<'_> {
    /// Refuses settings of a velocity field, for kinds that have none.
    ///
    /// # Errors
    /// If there are any, as (key, reason).
    pub fn without_velocity(&self) -> Result<(), (String, String)> {
        if self.velocity.is_none() && self.advection.is_none() {
            return Ok(());
        }
        let reason = "`velocity` and `advection` belong to the source `freegave`, and to no other";
        Err(("kind".to_owned(), reason.to_owned()))
    }
}
