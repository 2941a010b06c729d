//! Configuration of a run: all settings and their presets. How files and overrides are laid over a preset is
//! in `resolve`.

use lgs_data::dataset::DatasetFormat;
use lgs_data::hash::ContentHash;
use lgs_distill::{DistillConfig, DynamicsKind, PartitionConfig};
use lgs_model::source::SourceKind;
use serde::{Deserialize, Serialize};

pub use crate::layers::ConfigError;
pub use crate::preset::Preset;

use crate::checkpoint::Stage;
use crate::source::SourceConfig;
use crate::stages::{FitDynamicsConfig, MotionOptions, TuneDynamicsConfig, TuneGaussiansConfig};

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

    /// The stage's name in configurations.
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
            Stage::RefineGaussians | Stage::TuneGaussians | Stage::RetuneGaussians => {
                self == Self::TuneGaussians
            }
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
    /// Truncated window: the source and all stages see only training frames, images or imported tracks, with
    /// a time below this, and τ_max is the last of these; 0: all frames. Other splits stay whole.
    pub train_before: f32,
    /// Images that are listed and absent are left out instead of refused.
    pub skip_missing: bool,
    /// MiB of decoded images that are held in memory; what is beyond lies decoded in a temporary file.
    pub cache: u32,
}

impl Default for DataConfig {
    fn default() -> Self {
        Self {
            format: None,
            white_background: true,
            resolution: 0,
            train_before: 0.0,
            skip_missing: false,
            cache: 2048,
        }
    }
}

/// Everything a run depends on beside the dataset.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// The set of defaults.
    pub preset: Preset,
    /// Seed of every random stream.
    pub seed: u64,
    /// Seconds between checkpoints.
    pub checkpoint_secs: u64,
    /// Seconds that source and stages may take together; schedules are stretched or shortened to keep to them
    /// (`schedule.json`). 0: they are as long as configured.
    pub time_budget_secs: f64,
    /// Stages after this one are left out (ablation): `distill` (or 1), `tune-dynamics` (2), `tune-gaussians`
    /// (3, all).
    pub last_stage: LastStage,
    /// Reading of images.
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
    /// First part of stage 2: least squares on the images.
    pub fit_dynamics: FitDynamicsConfig,
    /// Second part of stage 2: descent of the photometric loss.
    pub tune_dynamics: TuneDynamicsConfig,
    /// Stage 3.
    pub tune_gaussians: TuneGaussiansConfig,
}

impl TrainConfig {
    /// The defaults of a preset, with its own kinds of source and dynamics.
    #[must_use]
    pub fn preset(preset: Preset) -> Self {
        Self::of(preset, preset.source(), preset.dynamics())
    }

    /// The defaults of a preset with a kind of source and of dynamics.
    #[must_use]
    pub fn of(preset: Preset, source: SourceKind, dynamics: DynamicsKind) -> Self {
        let quick = Self {
            preset,
            seed: 0,
            checkpoint_secs: 60,
            time_budget_secs: 0.0,
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
        let chosen = match dynamics {
            DynamicsKind::Terms => quick,
            DynamicsKind::Networks => quick.with_networks(),
        };
        match preset {
            Preset::Quick | Preset::Standard => chosen.for_any_world(),
            Preset::Paper => chosen.trained_long(),
        }
    }

    /// The paper's networks in the place of laws: nothing but the paper's own three stages.
    fn with_networks(self) -> Self {
        Self {
            motion: MotionOptions::paper(),
            distill: DistillConfig::networks(),
            refine_gaussians: self.refine_gaussians.left_out(),
            fit_dynamics: FitDynamicsConfig::paper(),
            tune_dynamics: TuneDynamicsConfig::networks(),
            ..self
        }
    }

    /// Rates of positions that follow the size of the scene.
    fn for_any_world(self) -> Self {
        let any_world = |config: TuneGaussiansConfig| TuneGaussiansConfig { position_unit: 0.0, ..config };
        Self {
            refine_gaussians: any_world(self.refine_gaussians),
            tune_gaussians: any_world(self.tune_gaussians),
            ..self
        }
    }

    /// The published lengths and rates of the stages.
    fn trained_long(self) -> Self {
        let tune_gaussians = TuneGaussiansConfig::paper();
        match self.distill.dynamics {
            DynamicsKind::Terms => Self { refine_gaussians: tune_gaussians.clone(), tune_gaussians, ..self },
            DynamicsKind::Networks => Self {
                distill: DistillConfig::paper(),
                refine_gaussians: tune_gaussians.clone().left_out(),
                tune_dynamics: TuneDynamicsConfig::paper(),
                tune_gaussians,
                ..self
            },
        }
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
        ContentHash::of(text.as_bytes()).short()
    }
}

#[cfg(test)]
mod tests;
