//! Checkpoints of a run: one tensor file each, named by stage and step, written atomically, the last two
//! kept.
//!
//! Random numbers need no state of their own: every draw comes from a stream of seed, purpose and step
//! ([`lgs_core::stream`]).

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_model::TensorFile;

use crate::error::TrainError;
use crate::thresholds::KEPT_CHECKPOINTS;

/// Format name and version of every checkpoint.
pub const CHECKPOINT_FORMAT: &str = "lagrangegs-checkpoint/1";

/// Part of a training run, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The source model.
    Source,
    /// Stage 1: distillation of U, Q and v0.
    Distill,
    /// Between stages 1 and 2: refinement of the Gaussians in the distilled motion.
    RefineGaussians,
    /// Stage 2, first part: least squares on the images for starts and laws.
    FitDynamics,
    /// Stage 2: photometric tuning of the dynamics.
    TuneDynamics,
    /// Stage 3: refinement of the Gaussians.
    TuneGaussians,
    /// Stage 3 once more, where the last choice of laws has changed the motion, or objects play their
    /// source's tracks that had a law before.
    RetuneGaussians,
}

impl Stage {
    /// All stages.
    pub const ALL: [Self; 7] = [
        Self::Source,
        Self::Distill,
        Self::RefineGaussians,
        Self::FitDynamics,
        Self::TuneDynamics,
        Self::TuneGaussians,
        Self::RetuneGaussians,
    ];

    /// The stage's name in files and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Source => "source",
            Self::Distill => "distill",
            Self::RefineGaussians => "refine-gaussians",
            Self::FitDynamics => "fit-dynamics",
            Self::TuneDynamics => "tune-dynamics",
            Self::TuneGaussians => "tune-gaussians",
            Self::RetuneGaussians => "retune-gaussians",
        }
    }

    /// The stage's place in the order of stages, from 0.
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }

    fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
}

/// The configuration and dataset that all checkpoints of a run share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunIdentity {
    /// Hash of the resolved configuration.
    pub config: String,
    /// Fingerprint of the dataset.
    pub dataset: String,
}

/// A checkpoint that was read.
pub struct Checkpoint {
    /// The stage that was running.
    pub stage: Stage,
    /// Steps of the stage done.
    pub step: usize,
    /// The stage's tensors and metadata.
    pub file: TensorFile,
    /// The file.
    pub path: PathBuf,
}

/// The folder of a run's checkpoints.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    folder: PathBuf,
    identity: RunIdentity,
}

impl Checkpoints {
    /// The checkpoints of a folder, which need not exist yet.
    #[must_use]
    pub fn new(folder: PathBuf, identity: RunIdentity) -> Self {
        Self { folder, identity }
    }

    /// An empty checkpoint to be filled and saved.
    #[must_use]
    pub fn start() -> TensorFile {
        TensorFile::new(CHECKPOINT_FORMAT)
    }

    /// Writes a checkpoint and removes all but the last two.
    ///
    /// # Errors
    /// If the folder cannot be written or the disk is full; earlier checkpoints stay.
    pub fn save(&self, stage: Stage, step: usize, mut file: TensorFile) -> Result<PathBuf, TrainError> {
        let _span = tracing::trace_span!("checkpoint").entered();
        file.set_metadata("stage", stage.name());
        file.set_metadata("step", step.to_string());
        file.set_metadata("config", &self.identity.config);
        file.set_metadata("dataset", &self.identity.dataset);
        std::fs::create_dir_all(&self.folder)
            .map_err(|e| FileError::new("create folder", &self.folder, e))?;
        let path = self.folder.join(format!("{}-{}-{step:07}.safetensors", stage.index(), stage.name()));
        file.save(&path)?;
        let names = self.paths()?;
        for old in names.iter().rev().skip(KEPT_CHECKPOINTS) {
            std::fs::remove_file(old).map_err(|e| FileError::new("remove file", old, e))?;
        }
        Ok(path)
    }

    /// The checkpoint of the latest stage and step, if there is any.
    ///
    /// # Errors
    /// If it is damaged, of another version, or belongs to another configuration or dataset.
    pub fn latest(&self) -> Result<Option<Checkpoint>, TrainError> {
        let Some(path) = self.paths()?.pop() else { return Ok(None) };
        let checkpoint = read_checkpoint(&path)?;
        for (what, key, expected) in [
            ("configuration", "config", &self.identity.config),
            ("dataset", "dataset", &self.identity.dataset),
        ] {
            let found = checkpoint.file.metadata(key)?;
            if found != expected {
                return Err(TrainError::Mismatch {
                    path,
                    what,
                    expected: expected.clone(),
                    found: found.to_owned(),
                });
            }
        }
        Ok(Some(checkpoint))
    }

    /// Paths in the order of stage and step.
    fn paths(&self) -> Result<Vec<PathBuf>, TrainError> {
        let entries = match std::fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(FileError::new("read folder", &self.folder, e).into()),
        };
        let mut paths = Vec::new();
        for entry in entries {
            let path = entry.map_err(|e| FileError::new("read folder", &self.folder, e))?.path();
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            if name.ends_with(".safetensors") && !name.starts_with('.') {
                paths.push(path);
            }
        }
        paths.sort();
        Ok(paths)
    }
}

/// Reads any checkpoint.
///
/// # Errors
/// If it cannot be read, is damaged, of another version, or of no known stage.
pub fn read_checkpoint(path: &Path) -> Result<Checkpoint, TrainError> {
    let file = TensorFile::load(path, CHECKPOINT_FORMAT)?;
    let name = file.metadata("stage")?;
    let stage =
        Stage::of_name(name).ok_or_else(|| file.field("stage", "a stage of training", name.to_owned()))?;
    let step = file.metadata_json("step")?;
    Ok(Checkpoint { stage, step, file, path: path.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(config: &str) -> RunIdentity {
        RunIdentity { config: config.into(), dataset: "d".into() }
    }

    fn sample() -> TensorFile {
        let mut file = Checkpoints::start();
        file.insert("means", &[1, 3], &[1.0, 2.0, 3.0]);
        file
    }

    #[test]
    fn the_last_two_are_kept_and_the_latest_is_found() {
        let folder = tempfile::tempdir().expect("folder");
        let checkpoints = Checkpoints::new(folder.path().join("checkpoints"), identity("a"));
        assert!(checkpoints.latest().expect("empty").is_none());
        for (stage, step) in [(Stage::Source, 90), (Stage::Source, 100), (Stage::TuneDynamics, 5)] {
            checkpoints.save(stage, step, sample()).expect("save");
        }
        let names: Vec<String> =
            checkpoints.paths().expect("paths").iter().map(|p| p.display().to_string()).collect();
        assert_eq!(names.len(), 2);
        let latest = checkpoints.latest().expect("read").expect("some");
        assert_eq!((latest.stage, latest.step), (Stage::TuneDynamics, 5));
        let other = Checkpoints::new(folder.path().join("checkpoints"), identity("b"));
        assert!(other.latest().err().expect("mismatch").to_string().contains("configuration"));
    }

    #[test]
    fn a_checkpoint_cut_at_any_byte_is_an_error_that_names_it() {
        let folder = tempfile::tempdir().expect("folder");
        let checkpoints = Checkpoints::new(folder.path().to_owned(), identity("a"));
        let path = checkpoints.save(Stage::Source, 1, sample()).expect("save");
        let whole = std::fs::read(&path).expect("bytes");
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).expect("cut");
            let error = checkpoints.latest().err().expect("damaged").to_string();
            assert!(error.contains("0-source-0000001.safetensors"), "{error}");
        }
    }
}
