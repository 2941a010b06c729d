//! Motion of a source model's Gaussians as training learns it: the part of a trainer that a kind of source
//! model brings.

use burn::tensor::Tensor;
use lgs_core::GaussianCloud;

use super::config::{AdvectionConfig, DeformationConfig, NodesConfig, ScaleMode, VelocityConfig};
use super::input::InputFrame;
use super::model::SourceModel;
use crate::tensor_file::{TensorFile, TensorFileError};

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
///
/// A kind may also learn features of every Gaussian, and change what it is made of while it trains: the
/// trainer asks it before every iteration whether [`Self::adapt`] is due, tells it when Gaussians are
/// replaced, and puts what it keeps beside its parameters into checkpoints. Kinds that do neither leave these
/// alone.
pub trait SourceMotion {
    /// Fresh parameters.
    fn init(&self, seed: u64) -> Vec<f32>;

    /// Number of parameters, as of the last [`Self::adapt`].
    fn parameters(&self) -> usize;

    /// Features that every Gaussian has for the motion.
    fn features(&self) -> usize {
        0
    }

    /// Features of Gaussians that have not been trained yet, row by row.
    fn fresh_features(&self, _cloud: &GaussianCloud) -> Vec<f32> {
        Vec::new()
    }

    /// Pose rows `[n, DELTAS]` of Gaussians as they are drawn in training.
    fn poses(&self, network: Tensor<1>, canonical: Canonical, at: Moment) -> Tensor<2>;

    /// A cost of the motion beside the photometric loss, for canonical Gaussians that are constants; nothing
    /// where the kind has none.
    fn prior(&self, _network: &Tensor<1>, _canonical: &Canonical, _at: Moment) -> Option<Tensor<1>> {
        None
    }

    /// Whether the motion has to be adapted to the Gaussians before an iteration in which they move.
    fn is_due(&self, _iteration: usize) -> bool {
        false
    }

    /// Adapts the motion to what has been learned; nothing if parameters and features stay.
    fn adapt(&mut self, _learned: &Learned, _at: Moment) -> Option<Remade> {
        None
    }

    /// Learns that Gaussians have been replaced, so that rows of before mean others now.
    fn forget_gaussians(&mut self) {}

    /// Learns the gradients `[n, 3]` by the canonical centres that an iteration has found.
    fn observe(&mut self, _gradients: &Tensor<2>) {}

    /// Whether [`Self::observe`] is to be called.
    fn observes(&self) -> bool {
        false
    }

    /// Adds to a checkpoint what the motion keeps beside its parameters.
    fn insert_into(&self, _file: &mut TensorFile) {}

    /// Reads what [`Self::insert_into`] wrote, for a number of Gaussians.
    ///
    /// # Errors
    /// If something is absent or does not fit.
    fn restore(&mut self, _file: &TensorFile, _gaussians: usize) -> Result<(), TensorFileError> {
        Ok(())
    }

    /// The meaning of the scale part of pose rows.
    fn scale_mode(&self) -> ScaleMode;

    /// The model of what has been learned.
    fn model(&self, learned: Learned) -> Box<dyn SourceModel>;
}

/// Everything that training a motion has learned so far.
#[derive(Clone, Debug)]
pub struct Learned {
    /// Canonical Gaussians.
    pub cloud: GaussianCloud,
    /// Their features, row by row.
    pub features: Vec<f32>,
    /// Parameters of the motion.
    pub parameters: Vec<f32>,
}

/// What becomes of parameters and features when a motion has been adapted.
#[derive(Clone, Debug)]
pub struct Remade {
    /// Parameters that stay, by number, the first ones of those to come.
    pub kept: Vec<usize>,
    /// Parameters after them, which start without moments.
    pub added: Vec<f32>,
    /// Features that replace those of the Gaussians, row by row.
    pub features: Option<Vec<f32>>,
}

/// Canonical Gaussians as far as their motion needs them, as constants in a prior.
pub struct Canonical {
    /// Positions `[n, 3]`, world units.
    pub means: Tensor<2>,
    /// Quaternions `[n, 4]`, w first.
    pub rotations: Tensor<2>,
    /// Features `[n, F]`, where the motion has any.
    pub features: Option<Tensor<2>>,
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
    /// Control nodes, of the kind `nodes` alone.
    pub nodes: Option<&'a NodesConfig>,
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

    /// Refuses settings of control nodes, for kinds that have none.
    ///
    /// # Errors
    /// If there are any, as (key, reason).
    pub fn without_nodes(&self) -> Result<(), (String, String)> {
        match self.nodes {
            None => Ok(()),
            Some(_) => Err(("kind".to_owned(), "`nodes` belongs to the source `nodes` alone".to_owned())),
        }
    }

    /// Refuses settings of anything but a deformation network.
    ///
    /// # Errors
    /// If there are any, as (key, reason).
    pub fn deformation_only(&self) -> Result<(), (String, String)> {
        self.without_velocity()?;
        self.without_nodes()
    }
}
