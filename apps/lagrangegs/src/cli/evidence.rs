//! What a run is measured with beside its scene.

use std::path::Path;

use anyhow::Result;
use lgs_data::dataset::Dataset;
use lgs_data::synth::GroundTruth;
use lgs_eval::Subject;
use lgs_eval::laws::ObjectLaw;
use lgs_model::source::SourceModel;

use super::failure::At;
use super::laws::laws_with_edits;
use super::run::Run;

/// The models and data that a run is measured with beside its scene: its source model, its dataset, and the
/// ground truth that the dataset ships.
pub(crate) struct Evidence {
    source: Option<Box<dyn SourceModel>>,
    dataset: Option<Dataset>,
    /// Fingerprint of the dataset, where the run was trained on another one.
    pub(crate) other: Option<String>,
    truth: Option<GroundTruth>,
    laws: Vec<Option<ObjectLaw>>,
}

impl Evidence {
    /// Reads what there is: all images of the dataset in a folder.
    pub(crate) fn load(run: &Run, root: Option<&Path>) -> Result<Self> {
        let dataset = root.map(|root| run.images(root, None)).transpose()?;
        let other = dataset.as_ref().map(|dataset| run.other_dataset(dataset)).transpose()?.flatten();
        let truth = root.map(|root| GroundTruth::load(root).at(root)).transpose()?.flatten();
        Ok(Self { source: run.source()?, dataset, other, truth, laws: laws_with_edits(run)? })
    }

    /// The run's scene beside it, as evaluation and report take both.
    pub(crate) fn subject<'a>(&'a self, run: &'a Run) -> Subject<'a> {
        Subject {
            scene: &run.scene,
            source: self.source.as_deref(),
            dataset: self.dataset.as_ref(),
            truth: self.truth.as_ref(),
            laws: &self.laws,
        }
    }
}
