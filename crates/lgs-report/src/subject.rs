//! A run as a report sees it.

use lgs_core::Camera;
use lgs_data::dataset::Dataset;
use lgs_data::synth::GroundTruth;
use lgs_eval::Metrics;
use lgs_model::LagrangianScene;
use lgs_model::source::SourceModel;

/// The models, data and figures of a run.
#[derive(Clone, Copy)]
pub struct RunSubject<'a> {
    /// Title of the page.
    pub title: &'a str,
    /// The Lagrangian scene.
    pub scene: &'a LagrangianScene,
    /// The model it was distilled from.
    pub source: Option<&'a dyn SourceModel>,
    /// True images; without them there is no strip of extrapolation.
    pub dataset: Option<&'a Dataset>,
    /// True motion.
    pub truth: Option<&'a GroundTruth>,
    /// Views to draw from where there is no dataset.
    pub cameras: &'a [Camera],
    /// Figures of the run.
    pub metrics: &'a Metrics,
    /// PSNR by step of every stage that renders.
    pub training: &'a [Curve],
    /// Contents of `config.toml`.
    pub config: &'a str,
}

/// PSNR of training images in one stage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Name of the stage.
    pub stage: String,
    /// Pairs of a step of the stage and the PSNR of its images, dB.
    pub points: Vec<(f64, f64)>,
}
