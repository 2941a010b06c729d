//! An opened run folder: its configuration, its models, and the dataset that it was trained on.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use lgs_core::Camera;
use lgs_data::cameras::read_cameras_json;
use lgs_data::dataset::{AbsentImages, Dataset, DatasetFormat, LoadOptions, NearPlanes};
use lgs_data::files::{read_bytes, write_atomically};
use lgs_distill::DistillReport;
use lgs_eval::{CameraCorrections, Cost};
use lgs_model::source::{SourceModel, load_source};
use lgs_model::{LagrangianScene, load_scene};
use lgs_report::read_metrics;
use lgs_train::{RunFolder, TrainConfig};
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::failure::At;
use super::output::{refuse_inside_dataset, refuse_inside_input, warn_of_absent};
use super::progress::{Task, warn_once};

/// File of the time and memory that training took, beside the models.
const COST: &str = "cost.json";
/// File of a run's metrics.
pub(crate) const METRICS: &str = "metrics.json";

/// A run, ready to be rendered or measured.
pub(crate) struct Run {
    pub(crate) folder: RunFolder,
    pub(crate) config: TrainConfig,
    pub(crate) scene: LagrangianScene,
}

impl Run {
    /// Reads a run's configuration and Lagrangian scene.
    pub(crate) fn open(root: &Path) -> Result<Self> {
        let (folder, config) = open_folder(root)?;
        if !folder.scene_path().exists() {
            bail!("training is not finished; continue it with `train … --resume`: {}", root.display());
        }
        let scene = load_scene(&folder.scene_path()).at(&folder.scene_path())?;
        Ok(Self { folder, config, scene })
    }

    /// Refuses an output among the frames that the run took its source from.
    pub(crate) fn refuse_inside_frames(&self, out: &Path) -> Result<()> {
        let frames = Path::new(&self.config.source.import);
        if frames.as_os_str().is_empty() { Ok(()) } else { refuse_inside_input(out, frames) }
    }

    /// The source model; nothing if the run has none.
    pub(crate) fn source(&self) -> Result<Option<Box<dyn SourceModel>>> {
        let path = self.folder.source_path(self.config.source.kind);
        if path.exists() { load_source(&path).at(&path).map(Some) } else { Ok(None) }
    }

    /// The dataset's folder: the one given, or the one that training read; nothing for a run without images.
    pub(crate) fn dataset_path(&self, given: Option<&Path>) -> Result<Option<PathBuf>> {
        match given {
            Some(path) => Ok(Some(path.to_owned())),
            None => {
                let recorded = self.folder.dataset().at(&self.folder.config_path())?;
                Ok(recorded.map(|dataset| dataset.path))
            }
        }
    }

    /// The images of a dataset in some splits (default: all), seen through the cameras that the run has
    /// refined.
    pub(crate) fn images(&self, root: &Path, splits: Option<Vec<String>>) -> Result<Dataset> {
        let dataset = load_dataset(root, &load_options(&self.config, splits))?;
        let path = self.folder.refined_cameras_path();
        let refined = self.folder.refined_cameras().at(&path)?;
        Ok(refined.map(|cameras| cameras.applied_to(&dataset)).unwrap_or(dataset))
    }

    /// The sizes of the corrections of the training cameras; nothing where they are taken as they are.
    pub(crate) fn camera_corrections(&self) -> Result<Option<CameraCorrections>> {
        let refined = self.folder.refined_cameras().at(&self.folder.refined_cameras_path())?;
        let sizes = refined.map(|cameras| cameras.sizes());
        Ok(sizes.map(|sizes| CameraCorrections {
            cameras: sizes.cameras,
            pose_rms_pixels: sizes.pose_rms,
            pose_max_pixels: sizes.pose_max,
            exposure_rms: sizes.exposure_rms,
            exposure_max: sizes.exposure_max,
        }))
    }

    /// Training cameras by image name; none if the run does not list them.
    pub(crate) fn cameras(&self) -> Result<Vec<(String, Camera)>> {
        let path = self.folder.root().join("source").join("cameras.json");
        let mut cameras = if path.exists() { read_cameras_json(&path).at(&path)? } else { Vec::new() };
        let all: Vec<Camera> = cameras.iter().map(|(_, camera)| *camera).collect();
        let planes = NearPlanes::of(&all);
        cameras.iter_mut().for_each(|(_, camera)| *camera = self.as_trained(*camera, &planes));
        Ok(cameras)
    }

    /// A camera with the near plane and the pixel filter that the run was trained with; `planes` are those of
    /// its training cameras.
    pub(crate) fn as_trained(&self, camera: Camera, planes: &NearPlanes) -> Camera {
        let source = &self.config.source;
        let near = if source.near == 0.0 { planes.at(&camera) } else { source.near };
        Camera { near, filter: source.antialias.filter(), ..camera }
    }

    /// What stage 1 found for each object; nothing if the run does not say, or as another version does.
    pub(crate) fn distillation(&self) -> Result<Vec<DistillReport>> {
        let path = self.folder.distillation_path();
        let Some(found) = read_json::<Value>(&path)? else { return Ok(Vec::new()) };
        Ok(serde_json::from_value(found).unwrap_or_else(|error| {
            warn_of_version(&path, &error);
            Vec::new()
        }))
    }

    /// The splits whose scores the run has, in metrics of any version; nothing if it has not been evaluated.
    pub(crate) fn scored_splits(&self) -> Result<Option<Vec<String>>> {
        let root = self.folder.root();
        let error = match read_metrics(root) {
            Ok(metrics) => return Ok(metrics.map(|metrics| metrics.splits.into_keys().collect())),
            Err(error) => error,
        };
        let path = root.join(METRICS);
        let found: Value = read_json(&path)?.unwrap_or_default();
        let Some(splits) = found["splits"].as_object() else { return Err(error).at(root) };
        warn_of_version(&path, &error);
        Ok(Some(splits.keys().cloned().collect()))
    }

    /// The time and memory that training took.
    pub(crate) fn cost(&self) -> Result<Cost> {
        read_cost(self.folder.root())
    }

    /// Refuses to write into the run's folder where that lies inside of a dataset or of imported frames.
    pub(crate) fn check_writable(&self) -> Result<()> {
        refuse_inside_dataset(self.folder.root())?;
        self.refuse_inside_frames(self.folder.root())
    }

    /// Says if a dataset is not the one that the run was trained on; returns its fingerprint then.
    pub(crate) fn other_dataset(&self, dataset: &Dataset) -> Result<Option<String>> {
        let recorded = self.folder.dataset().at(&self.folder.config_path())?;
        let expected = recorded.map(|recorded| recorded.fingerprint);
        if expected.as_deref().is_none_or(|expected| expected == dataset.fingerprint) {
            return Ok(None);
        }
        tracing::warn!(
            "the run was trained on another dataset (fingerprint {}) than this one ({}): {}",
            expected.unwrap_or_default(),
            dataset.fingerprint,
            dataset.root.display()
        );
        Ok(Some(dataset.fingerprint.clone()))
    }
}

/// The folder of a run and its configuration.
pub(crate) fn open_folder(root: &Path) -> Result<(RunFolder, TrainConfig)> {
    RunFolder::open(root).at(root).context("this is not a run")
}

/// The cost of earlier sessions of a run; none if nothing is recorded.
pub(crate) fn read_cost(root: &Path) -> Result<Cost> {
    Ok(read_json(&root.join(COST))?.unwrap_or_default())
}

/// The contents of a file that a run may have.
fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    if !path.exists() {
        return Ok(None);
    }
    let wrong = |e: serde_json::Error| anyhow!("the file is damaged: {e}: {}", path.display());
    serde_json::from_slice(&read_bytes(path)?).map(Some).map_err(wrong)
}

/// Says that a file is read in part, as another version of the program wrote it.
fn warn_of_version(path: &Path, error: &dyn std::fmt::Display) {
    warn_once(&format!("another version wrote this, and not all is read: {error}: {}", path.display()));
}

/// Writes the time and memory that training took.
pub(crate) fn write_cost(root: &Path, cost: &Cost) -> Result<()> {
    let path = root.join(COST);
    write_atomically(&path, |w| serde_json::to_writer_pretty(w, cost).map_err(Into::into)).at(&path)
}

/// The name of a run: that of its folder.
pub(crate) fn name_of(root: &Path) -> String {
    root.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Parses the name of a dataset's format.
pub(crate) fn dataset_format(name: &str) -> Result<DatasetFormat, String> {
    let names = || DatasetFormat::ALL.iter().map(|format| format.name()).collect::<Vec<_>>().join(", ");
    DatasetFormat::named(name).ok_or_else(|| format!("expected one of: {}", names()))
}

/// The options by which a configuration loads images.
pub(crate) fn load_options(config: &TrainConfig, splits: Option<Vec<String>>) -> LoadOptions {
    let resolution = Some(config.data.resolution).filter(|&width| width > 0);
    let train_before = Some(config.data.train_before).filter(|&limit| limit > 0.0);
    LoadOptions {
        format: config.data.format,
        white_background: config.data.white_background,
        resolution,
        splits,
        train_before,
        near: config.source.near,
        filter: config.source.antialias.filter(),
        absent: absent_images(config.data.skip_missing),
        cache_bytes: (config.data.cache as usize) << 20,
    }
}

/// What `--skip-missing` says of images that are listed but absent.
pub(crate) fn absent_images(skip_missing: bool) -> AbsentImages {
    if skip_missing { AbsentImages::Skip } else { AbsentImages::Refuse }
}

/// Loads a dataset behind a progress bar.
pub(crate) fn load_dataset(root: &Path, options: &LoadOptions) -> Result<Dataset> {
    let _span = tracing::trace_span!("load images").entered();
    let task = Task::new("images", 0);
    let set = Dataset::load(root, options, &|done, total| task.count(done, total)).at(root)?;
    drop(task);
    warn_of_absent(set.absent.len(), root);
    Ok(set)
}
