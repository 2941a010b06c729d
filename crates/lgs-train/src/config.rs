//! Configuration of a run: preset, then a TOML file, then `key=value` overrides, merged as data and checked
//! key by key.
//!
//! The merge starts from the preset written out in full, so a key that is not there is a mistake, and so is a
//! value of another type; both errors name the dotted key. The resolved configuration is what `config.toml`
//! of a run holds.

use std::path::Path;

use lgs_data::dataset::DatasetFormat;
use lgs_distill::{DistillConfig, PartitionConfig};
use lgs_model::source::SourceKind;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

pub use crate::layers::ConfigError;

use crate::checkpoint::Stage;
use crate::layers::{merge, parse, set};
use crate::source::SourceConfig;
use crate::stages::{FitDynamicsConfig, MotionOptions, TuneDynamicsConfig, TuneGaussiansConfig};

/// Sets of defaults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Minutes on two CPU cores.
    #[default]
    Quick,
    /// As published: the defaults of the reference's table of gaps (G1–G63) wherever measurement has not
    /// found better.
    ///
    /// What differs from that table, and why:
    ///
    /// | key | here | reference | reason |
    /// |---|---|---|---|
    /// | `partition.smoothing_degree` | 6 | 0 (G12, G14) | a source's jitter makes walls move and cuts links of one body |
    /// | `partition.regroup_rounds` | 4 | 0 (G14) | the graph joins a body with what wobbles beside it, and parts it where nothing is seen |
    /// | `partition.unseen_motion` | 0.6 | 0 (G14) | plain surfaces of a source slide along themselves, which no image tells from rest |
    /// | `partition.negligible_motion` | 0.08 | 0 (G18) | surroundings of a trained source are never quite still |
    /// | `distill.shared_motion` | auto | none (G12) | particles of one body denoise each other |
    /// | `distill.matching.steps` | 3000 | 0 (G31) | every state teaches by itself what rollouts then refine; 0 is the paper's way (Eq. 7 alone) |
    /// | `distill.matching.force_penalty` | 1e-3 | 1e-4 (G30) | upper end of G30's sweep, as second differences are noisier than positions |
    /// | `distill.rollout.steps`, `.learning_rate`, `.particles` | 400, 1e-4, 512 | 10 000, 1e-3, 4 096 (G25, G31) | rollouts only refine what matching has found |
    /// | `distill.rollout.velocity_learning_rate` | 1e-3 | 1e-2 (G31) | one linear field corrects starting velocities, not one vector per particle (G29) |
    ///
    /// Not settings, because the reference leaves no choice or one form is all there is: G1–G3, G5–G7, G9,
    /// G11, G13, G19 (supports within an object), G21 (incremental), G22 (off), G24, G28, G34–G37, G40, G41.
    /// G38 is a flag of `render`, and G43–G48 are metrics.
    Paper,
}

/// The last of the method's three stages that runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LastStage {
    /// Stage 1 alone.
    Distill,
    /// Stage 2 as well.
    TuneDynamics,
    /// All, with the refinement before stage 2.
    #[default]
    TuneGaussians,
}

impl LastStage {
    /// All, in order: stages 1, 2 and 3.
    pub const ALL: [Self; 3] = [Self::Distill, Self::TuneDynamics, Self::TuneGaussians];

    /// Its name in configurations.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Distill => Stage::Distill.name(),
            Self::TuneDynamics => Stage::TuneDynamics.name(),
            Self::TuneGaussians => Stage::TuneGaussians.name(),
        }
    }

    /// Whether a part of training runs. The refinement before stage 2 goes with stage 3, since it is the same
    /// training of the Gaussians.
    #[must_use]
    pub fn includes(self, stage: Stage) -> bool {
        match stage {
            Stage::Source | Stage::Distill => true,
            Stage::FitDynamics | Stage::TuneDynamics => self >= Self::TuneDynamics,
            Stage::RefineGaussians | Stage::TuneGaussians => self == Self::TuneGaussians,
        }
    }
}

impl std::str::FromStr for LastStage {
    type Err = String;

    /// Reads a stage's name or its number.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbered = (1..).zip(Self::ALL);
        let mut found = numbered.filter(|(number, stage)| text == number.to_string() || text == stage.name());
        found.next().map(|(_, stage)| stage).ok_or_else(|| {
            let names = Self::ALL.map(|stage| format!("`{}`", stage.name())).join(", ");
            format!("{text} is none of {names}, nor 1, 2 or 3")
        })
    }
}

/// How images are read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataConfig {
    /// Format of the dataset; `auto`: detected from the folder's contents.
    #[serde(with = "lgs_data::dataset::format_or_auto")]
    pub format: Option<DatasetFormat>,
    /// White rather than black behind transparent pixels.
    pub white_background: bool,
    /// Width that images are resized to, pixels; 0: as they are.
    pub resolution: u32,
    /// Truncated window: the source and all stages see only training frames with a time below this, and τ_max
    /// is the last of these (G10, G53); 0: all frames. Other splits stay whole.
    pub train_before: f32,
}

impl Default for DataConfig {
    fn default() -> Self {
        Self { format: None, white_background: true, resolution: 0, train_before: 0.0 }
    }
}

/// Everything a run depends on beside the dataset.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// Where the defaults came from.
    pub preset: Preset,
    /// Seed of every random stream.
    pub seed: u64,
    /// Seconds between checkpoints.
    pub checkpoint_secs: u64,
    /// Stages after this one are left out (ablation): `distill` (or 1), `tune-dynamics` (2), `tune-gaussians`
    /// (3, all).
    pub last_stage: LastStage,
    /// Images.
    pub data: DataConfig,
    /// Source model.
    pub source: SourceConfig,
    /// Integration and alignment of the learned motion.
    pub motion: MotionOptions,
    /// Split into static Gaussians and objects.
    pub partition: PartitionConfig,
    /// Stage 1.
    pub distill: DistillConfig,
    /// Refinement of the Gaussians before stage 2 as well (paper: none); left out with stage 3.
    pub refine_gaussians: TuneGaussiansConfig,
    /// Stage 2, first part.
    pub fit_dynamics: FitDynamicsConfig,
    /// Stage 2.
    pub tune_dynamics: TuneDynamicsConfig,
    /// Stage 3.
    pub tune_gaussians: TuneGaussiansConfig,
}

impl TrainConfig {
    /// The defaults of a preset, with a DefGS source.
    #[must_use]
    pub fn preset(preset: Preset) -> Self {
        Self::of(preset, SourceKind::Defgs)
    }

    /// The defaults of a preset with a kind of source.
    #[must_use]
    pub fn of(preset: Preset, source: SourceKind) -> Self {
        let quick = Self {
            preset,
            seed: 0,
            checkpoint_secs: 60,
            last_stage: LastStage::default(),
            data: DataConfig::default(),
            source: SourceConfig::preset(source, preset),
            motion: MotionOptions::default(),
            partition: PartitionConfig::default(),
            distill: DistillConfig::default(),
            refine_gaussians: TuneGaussiansConfig::default(),
            fit_dynamics: FitDynamicsConfig::default(),
            tune_dynamics: TuneDynamicsConfig::default(),
            tune_gaussians: TuneGaussiansConfig::default(),
        };
        match preset {
            Preset::Quick => quick,
            Preset::Paper => Self {
                motion: MotionOptions::paper(),
                distill: DistillConfig::paper(),
                refine_gaussians: TuneGaussiansConfig { iterations: 0, ..TuneGaussiansConfig::paper() },
                fit_dynamics: FitDynamicsConfig::paper(),
                tune_dynamics: TuneDynamicsConfig::paper(),
                tune_gaussians: TuneGaussiansConfig::paper(),
                ..quick
            },
        }
    }

    /// Merges a preset, an optional file and overrides such as `source.iterations=500`, and checks the
    /// result.
    ///
    /// # Errors
    /// If the file cannot be read or parsed, or a key or value is wrong; the error names the key.
    pub fn resolve(preset: Preset, file: Option<&Path>, overrides: &[String]) -> Result<Self, ConfigError> {
        let mut given = Table::new();
        if let Some(path) = file {
            let text = std::fs::read_to_string(path)
                .map_err(|reason| ConfigError::Read { path: path.to_owned(), reason })?;
            given = parse(&text, &path.display().to_string())?;
        }
        for text in overrides {
            set(&mut given, text)?;
        }
        Self::from_table(preset, &given)
    }

    /// Reads a resolved configuration, such as a run's `config.toml`.
    ///
    /// # Errors
    /// As [`Self::resolve`].
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ConfigError> {
        Self::from_table(Preset::Quick, &parse(text, origin)?)
    }

    fn from_table(preset: Preset, given: &Table) -> Result<Self, ConfigError> {
        let invalid = |key: &str, reason: String| ConfigError::Invalid { key: key.to_owned(), reason };
        let whole = |e: &dyn std::fmt::Display| invalid("configuration", e.to_string());
        // A preset and a kind of source that are named decide the defaults that the rest is laid over.
        let preset = match given.get("preset") {
            Some(value) => value
                .clone()
                .try_into()
                .map_err(|_| invalid("preset", format!("{value} is not `quick` or `paper`")))?,
            None => preset,
        };
        let kind = match given.get("source").and_then(|source| source.get("kind")) {
            Some(value) => value
                .clone()
                .try_into()
                .map_err(|_| invalid("source.kind", format!("{value} is not {}", known_kinds())))?,
            None => SourceKind::default(),
        };
        let base = Self::of(preset, kind);
        let mut merged = Table::try_from(&base).map_err(|e| whole(&e))?;
        let mut given = given.clone();
        if let Some(stage) = given.get_mut("last_stage") {
            let named = match &*stage {
                Value::String(text) => text.parse::<LastStage>(),
                other => other.to_string().parse(),
            };
            *stage = Value::String(named.map_err(|reason| invalid("last_stage", reason))?.name().to_owned());
        }
        merge(&mut merged, &given, "")?;
        let config: Self =
            Value::Table(merged).try_into().map_err(|e: toml::de::Error| whole(&e.message()))?;
        config
            .source
            .validate()
            .map_err(|(key, reason)| ConfigError::Invalid { key: format!("source.{key}"), reason })?;
        config
            .distill
            .validate()
            .map_err(|e| ConfigError::Invalid { key: "distill".to_owned(), reason: e.to_string() })?;
        config
            .partition
            .validate()
            .map_err(|(key, reason)| ConfigError::Invalid { key: format!("partition.{key}"), reason })?;
        config
            .motion
            .validate()
            .map_err(|(key, reason)| ConfigError::Invalid { key: format!("motion.{key}"), reason })?;
        let stages = [
            ("refine_gaussians", config.refine_gaussians.validate()),
            ("tune_dynamics", config.tune_dynamics.validate()),
            ("tune_gaussians", config.tune_gaussians.validate()),
        ];
        for (stage, checked) in stages {
            checked
                .map_err(|(key, reason)| ConfigError::Invalid { key: format!("{stage}.{key}"), reason })?;
        }
        if !(config.data.train_before >= 0.0 && config.data.train_before.is_finite()) {
            return Err(invalid(
                "data.train_before",
                format!("{} is negative or not finite", config.data.train_before),
            ));
        }
        if config.checkpoint_secs == 0 {
            return Err(invalid("checkpoint_secs", "0 is not an interval".to_owned()));
        }
        Ok(config)
    }

    /// The configuration as TOML, in the order of its fields.
    ///
    /// # Errors
    /// Never in practice: every field has a TOML form (tested).
    pub fn to_toml(&self) -> Result<String, ConfigError> {
        toml::to_string_pretty(self)
            .map_err(|e| ConfigError::Invalid { key: "configuration".to_owned(), reason: e.to_string() })
    }

    /// A hash of everything that results depend on: 16 hexadecimal digits.
    #[must_use]
    pub fn hash(&self) -> String {
        let relevant = Self { checkpoint_secs: 0, ..self.clone() };
        let text = toml::to_string(&relevant).unwrap_or_default();
        let hash = text
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
        format!("{hash:016x}")
    }
}

/// Names of all kinds of source models.
fn known_kinds() -> String {
    SourceKind::ALL.map(|kind| format!("`{}`", kind.name())).join(" or ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quick(overrides: &[&str]) -> Result<TrainConfig, ConfigError> {
        let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
        TrainConfig::resolve(Preset::Quick, None, &overrides)
    }

    #[test]
    fn presets_round_trip_through_toml() {
        let all = [Preset::Quick, Preset::Paper]
            .into_iter()
            .flat_map(|preset| SourceKind::ALL.map(|kind| (preset, kind)));
        for (preset, kind) in all {
            let mut config = TrainConfig::of(preset, kind);
            if kind == SourceKind::Frames {
                config.source.import = "frames".to_owned();
            }
            assert_eq!((config.preset, config.source.kind), (preset, kind));
            let back =
                TrainConfig::from_toml(&config.to_toml().expect("toml"), "config.toml").expect("parse");
            assert_eq!(back, config);
            assert_eq!(back.hash(), config.hash());
        }
        assert_ne!(TrainConfig::preset(Preset::Quick).hash(), TrainConfig::preset(Preset::Paper).hash());
    }

    #[test]
    fn overrides_reach_nested_values_of_every_type() {
        let config = quick(&[
            "seed=7",
            "source.iterations = 12",
            "source.learning_rates.sh=1",
            "source.deformation.scale_mode=additive",
            "data.white_background=false",
        ])
        .expect("config");
        assert_eq!((config.seed, config.source.iterations), (7, 12));
        assert_eq!(config.source.learning_rates.sh, 1.0);
        assert_eq!(config.source.deformation.scale_mode, lgs_model::source::ScaleMode::Additive);
        assert!(!config.data.white_background);
        assert_eq!(quick(&["preset=paper"]).expect("paper").source, SourceConfig::paper());
    }

    #[test]
    fn every_mistake_names_its_key() {
        for (given, key) in [
            ("source.iteration=12", "source.iteration"),
            ("source.iterations=many", "source.iterations"),
            ("source.iterations=-3", "source.iterations"),
            ("source.iterations=0", "source.iterations"),
            ("source.ssim_weight=1.5", "source.ssim_weight"),
            ("source.deformation.depth=0", "source.deformation.depth"),
            ("source.deformation.depth.x=0", "source.deformation.depth"),
            ("source.deformation.scale_mode=big", "big"),
            ("preset=slow", "preset"),
            ("source.kind=magic", "source.kind"),
            ("source.velocity.width=8", "source.velocity"),
            ("source.deformation.code=8", "source.deformation.code"),
            ("last_stage=0", "last_stage"),
            ("data.train_before=-0.5", "data.train_before"),
            ("partition.method=guess", "guess"),
            ("partition.clusters=0", "partition.clusters"),
            ("nothing", "nothing"),
        ] {
            let error = quick(&[given]).expect_err(given).to_string();
            assert!(error.contains(key), "{given}: {error}");
        }
    }

    #[test]
    fn a_kind_of_source_brings_its_own_keys_and_defaults() {
        let config =
            quick(&["source.kind=freegave", "source.velocity.max_time=0.5", "preset=paper"]).expect("config");
        assert_eq!(config.source.velocity.as_ref().map(|v| (v.max_time, v.width)), Some((0.5, 128)));
        assert_eq!((config.source.densify.min_opacity, config.source.window_steps), (0.05, 8));
        for given in [
            "source.deformation.code=0",
            "source.velocity.fps=0",
            "source.velocity.max_time=-1",
            "source.advection.length=0",
            "source.advection.share=2",
        ] {
            let (key, _) = given.split_once('=').expect("a setting");
            let error = quick(&["source.kind=freegave", given]).expect_err(given).to_string();
            assert!(error.contains(key), "{given}: {error}");
        }
    }

    #[test]
    fn the_published_scenes_have_their_settings() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/freegave");
        for (scene, max_time, bases) in
            [("fan", 0.72, 16), ("bat", 0.75, 16), ("chessboard", 0.70, 32), ("factory", 0.70, 32)]
        {
            let config =
                TrainConfig::resolve(Preset::Quick, Some(&folder.join(format!("{scene}.toml"))), &[])
                    .expect(scene);
            assert_eq!(config.preset, Preset::Paper);
            assert_eq!(config.source.velocity.map(|v| v.max_time), Some(max_time));
            assert_eq!(config.source.deformation.code, bases);
        }
        let files = std::fs::read_dir(folder)
            .expect("folder")
            .map(|entry| entry.expect("entry").path())
            .collect::<Vec<_>>();
        assert_eq!(files.len(), 10);
        files.iter().for_each(|path| {
            assert!(TrainConfig::resolve(Preset::Quick, Some(path), &[]).is_ok(), "{}", path.display())
        });
    }

    #[test]
    fn files_that_are_absent_or_not_toml_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("c.toml");
        let resolve = || TrainConfig::resolve(Preset::Quick, Some(&path), &["seed=3".to_owned()]);
        assert!(resolve().expect_err("absent").to_string().contains("c.toml"));
        std::fs::write(&path, "seed = = 1").expect("write");
        assert!(resolve().expect_err("syntax").to_string().contains("c.toml"));
        std::fs::write(&path, "seed = 1\n[source]\nsh_degree = 2").expect("write");
        let config = resolve().expect("file");
        assert_eq!((config.seed, config.source.sh_degree), (3, 2), "overrides win over the file");
    }
}
