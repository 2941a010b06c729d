//! The folder of a run: its configuration, checkpoints, training curve and models.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use lgs_data::dataset::{Dataset, DatasetFormat};
use lgs_data::files::{FileError, write_atomically, write_with_parents};
use lgs_data::{cameras, ply};
use lgs_model::source::{SourceKind, SourceModel};
use serde::{Deserialize, Serialize};

use crate::budget::Budget;
use crate::cameras::RefinedCameras;
use crate::checkpoint::{Checkpoints, RunIdentity};
use crate::config::{ConfigError, Preset, TrainConfig};
use crate::error::TrainError;
use crate::events::EventLog;
use crate::layers::parse;

/// Name of the table of `config.toml` that says what a run is trained on.
const DATASET: &str = "dataset";

/// Further names in a run's folder than those of configuration and checkpoints, by which a run is known.
const OWN_NAMES: &str = "source source-rows.safetensors lagrangian.safetensors distillation.json \
    events.jsonl schedule.json cost.json metrics.json report.html figures renders";

/// The dataset of a run, as `config.toml` records it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunDataset {
    /// Folder that training read.
    pub path: PathBuf,
    /// Fingerprint of its contents.
    pub fingerprint: String,
}

/// The folder of a run.
#[derive(Clone, Debug)]
pub struct RunFolder {
    root: PathBuf,
}

impl RunFolder {
    /// Starts a run: writes `config.toml` into a folder that holds no run yet.
    ///
    /// # Errors
    /// If there is a run already or the folder cannot be written.
    pub fn create(root: &Path, config: &TrainConfig, dataset: &Dataset) -> Result<Self, TrainError> {
        Self::check_free(root)?;
        let folder = Self { root: root.to_owned() };
        let text = config.to_toml()? + &dataset_table(dataset)?;
        write_with_parents(&folder.config_path(), |w| w.write_all(text.as_bytes()))?;
        write_atomically(&folder.events_path(), |_| Ok(()))?;
        Ok(folder)
    }

    /// Opens an existing run and reads its configuration.
    ///
    /// # Errors
    /// If there is none or it does not parse.
    pub fn open(root: &Path) -> Result<(Self, TrainConfig), TrainError> {
        let folder = Self { root: root.to_owned() };
        let mut table = folder.read_config()?;
        table.remove(DATASET);
        // Every run writes all keys; without these it is no file of a run, or it has lost its contents.
        let absent = ["preset", "seed"].into_iter().find(|key| !table.contains_key(*key));
        let config = match absent {
            Some(key) => Err(ConfigError::Absent { key: key.to_owned() }),
            None => TrainConfig::from_table(Preset::Quick, table),
        };
        let wrong = |error| TrainError::RunConfig { path: folder.config_path(), error };
        let config = config.map_err(wrong)?;
        Ok((folder, config))
    }

    /// Refuses a folder that a run cannot be started in: one that holds a run, a dataset, or files and
    /// folders whose names a run would give to its own.
    ///
    /// # Errors
    /// If it is such a folder.
    pub fn check_free(root: &Path) -> Result<(), TrainError> {
        let folder = Self { root: root.to_owned() };
        if folder.config_path().exists() || folder.checkpoints_path().exists() {
            return Err(TrainError::Occupied(root.to_owned()));
        }
        let taken = OWN_NAMES.split_whitespace().find(|name| root.join(name).exists());
        let dataset = DatasetFormat::detect(root).map(|_| "a dataset");
        match taken.or(dataset) {
            Some(found) => Err(TrainError::Foreign { path: root.to_owned(), found }),
            None => Ok(()),
        }
    }

    /// The dataset that the run is trained on; nothing for a run without images.
    ///
    /// # Errors
    /// If `config.toml` cannot be read or its table `[dataset]` is of another form.
    pub fn dataset(&self) -> Result<Option<RunDataset>, TrainError> {
        let table = self.read_config()?.remove(DATASET);
        let read = table.map(toml::Value::try_into).transpose();
        read.map_err(|e: toml::de::Error| {
            let error = ConfigError::Invalid { key: DATASET.to_owned(), reason: e.message().to_owned() };
            TrainError::RunConfig { path: self.config_path(), error }
        })
    }

    fn read_config(&self) -> Result<toml::Table, TrainError> {
        let path = self.config_path();
        let text = std::fs::read_to_string(&path).map_err(|e| FileError::new("read file", &path, e))?;
        Ok(parse(&text, &path)?)
    }

    /// The folder itself.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The file of the resolved configuration.
    #[must_use]
    pub fn config_path(&self) -> PathBuf {
        self.root.join("config.toml")
    }

    /// The file of the training curve.
    #[must_use]
    pub fn events_path(&self) -> PathBuf {
        self.root.join("events.jsonl")
    }

    /// The folder of checkpoints.
    #[must_use]
    pub fn checkpoints_path(&self) -> PathBuf {
        self.root.join("checkpoints")
    }

    /// The file of the paces by which a run keeps to its time budget.
    #[must_use]
    pub fn schedule_path(&self) -> PathBuf {
        self.root.join("schedule.json")
    }

    /// The run's time budget, if it has one, with the schedule so far.
    pub(crate) fn budget(&self, config: &TrainConfig) -> Result<Option<RefCell<Budget>>, TrainError> {
        let secs = Some(config.time_budget_secs).filter(|&secs| secs > 0.0);
        secs.map(|secs| Ok(RefCell::new(Budget::open(secs, &self.schedule_path())?))).transpose()
    }

    /// The report of stage 1, a list of what it found for each object.
    #[must_use]
    pub fn distillation_path(&self) -> PathBuf {
        self.root().join("distillation.json")
    }

    /// The file that says which of the source's Gaussians each Gaussian of the scene is.
    pub(crate) fn source_rows_path(&self) -> PathBuf {
        self.root.join("source-rows.safetensors")
    }

    /// The file of the cameras as source training has refined them.
    #[must_use]
    pub fn refined_cameras_path(&self) -> PathBuf {
        self.root.join("source").join("refined-cameras.safetensors")
    }

    /// Writes the cameras as source training has refined them.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(crate) fn write_refined_cameras(&self, cameras: &RefinedCameras) -> Result<(), TrainError> {
        let path = self.refined_cameras_path();
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|e| FileError::new("create folder", parent, e))?;
        }
        Ok(cameras.save(&path)?)
    }

    /// The training cameras as the run has refined them; nothing where it takes them as they are.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged.
    pub fn refined_cameras(&self) -> Result<Option<RefinedCameras>, TrainError> {
        let path = self.refined_cameras_path();
        Ok(path.exists().then(|| RefinedCameras::load(&path)).transpose()?)
    }

    /// The file of the source model: of the kind that was asked for, or, where the run has one of a still
    /// scene, of that.
    #[must_use]
    pub fn source_path(&self, kind: SourceKind) -> PathBuf {
        let at_rest = self.source_path_of(SourceKind::Linear);
        let asked = self.source_path_of(kind);
        if !asked.exists() && at_rest.exists() { at_rest } else { asked }
    }

    fn source_path_of(&self, kind: SourceKind) -> PathBuf {
        self.root.join("source").join(format!("{}.safetensors", kind.name()))
    }

    /// The file of the Lagrangian scene.
    #[must_use]
    pub fn scene_path(&self) -> PathBuf {
        self.root.join("lagrangian.safetensors")
    }

    /// The run's checkpoints, tied to its configuration and dataset.
    #[must_use]
    pub fn checkpoints(&self, config: &TrainConfig, dataset: &Dataset) -> Checkpoints {
        let identity = RunIdentity { config: config.hash(), dataset: dataset.fingerprint.clone() };
        Checkpoints::new(self.checkpoints_path(), identity)
    }

    /// Writes the source model, and its Gaussians at t = 0 in the layout that splat viewers open.
    ///
    /// # Errors
    /// If something cannot be written.
    pub fn write_source(
        &self,
        model: &dyn SourceModel,
        iteration: usize,
        dataset: &Dataset,
    ) -> Result<(), TrainError> {
        let folder = self.root.join("source");
        let cloud = folder.join("point_cloud").join(format!("iteration_{iteration}")).join("point_cloud.ply");
        if let Some(parent) = cloud.parent() {
            std::fs::create_dir_all(parent).map_err(|e| FileError::new("create folder", parent, e))?;
        }
        ply::write_ply(&cloud, &model.cloud_at(0.0))?;
        let views: Vec<(String, lgs_core::Camera)> =
            dataset.cameras("train").iter().map(|f| (f.name.clone(), f.camera)).collect();
        cameras::write_cameras_json(&folder.join("cameras.json"), &views)?;
        Ok(model.save(&self.source_path_of(model.kind()))?)
    }

    /// Takes over the trained source of another run of the same dataset, seed, image and source settings:
    /// model, splat file, cameras and training curve. Training then goes on with stage 1. Nothing happens
    /// where this run has a source.
    ///
    /// # Errors
    /// If the other run was made with other settings, or a file cannot be read or written.
    pub fn adopt_source(&self, config: &TrainConfig, from: &Path) -> Result<(), TrainError> {
        if self.source_path(config.source.kind).exists() {
            return Ok(());
        }
        let (other, found) = Self::open(from)?;
        let of_source = |c: &TrainConfig| TrainConfig {
            seed: c.seed,
            data: c.data.clone(),
            source: c.source.clone(),
            ..TrainConfig::default()
        };
        if of_source(config) != of_source(&found) {
            let (expected, found) = (of_source(config).hash(), of_source(&found).hash());
            return Err(TrainError::Mismatch {
                path: other.config_path(),
                what: "source settings",
                expected,
                found,
            });
        }
        let (own, partial) = (self.root.join("source"), self.root.join(".source-partial"));
        for folder in [&own, &partial].into_iter().filter(|folder| folder.exists()) {
            std::fs::remove_dir_all(folder).map_err(|e| FileError::new("remove folder", folder, e))?;
        }
        link_tree(&other.root.join("source"), &partial)?;
        EventLog::adopt_source(&other.events_path(), &self.events_path())?;
        std::fs::rename(&partial, &own).map_err(|e| FileError::new("rename folder", &own, e))?;
        Ok(())
    }
}

/// The table `[dataset]` of a run's `config.toml`; empty without images.
fn dataset_table(dataset: &Dataset) -> Result<String, TrainError> {
    if dataset.splits.is_empty() {
        return Ok(String::new());
    }
    let recorded = RunDataset { path: dataset.root.clone(), fingerprint: dataset.fingerprint.clone() };
    let table = toml::to_string_pretty(&recorded)
        .map_err(|e| ConfigError::Invalid { key: DATASET.to_owned(), reason: e.to_string() })?;
    Ok(format!("\n[{DATASET}]\n{table}"))
}

/// Puts the files of a folder into a new one: links where the file system can, which is safe as files are
/// never written in place, else copies.
fn link_tree(from: &Path, to: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(to).map_err(|e| FileError::new("create folder", to, e))?;
    let entries = std::fs::read_dir(from).map_err(|e| FileError::new("read folder", from, e))?;
    for entry in entries {
        let path = entry.map_err(|e| FileError::new("read folder", from, e))?.path();
        let copy = to.join(path.file_name().unwrap_or_default());
        if path.is_dir() {
            link_tree(&path, &copy)?;
        } else if std::fs::hard_link(&path, &copy).is_err() {
            std::fs::copy(&path, &copy).map_err(|e| FileError::new("copy file", &path, e))?;
        }
    }
    Ok(())
}
