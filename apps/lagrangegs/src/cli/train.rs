//! `lagrangegs train`: its flags, and the configuration that they ask for.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use lgs_data::dataset::DatasetFormat;
use lgs_data::tracks::is_track_file;
use lgs_model::source::{SourceKind, imported_kind};
use lgs_train::config::{ConfigError, Preset};
use lgs_train::{Difference, RunFolder, TrainConfig, TrainError};

use super::ablation::Ablations;
use super::device::DeviceArgs;
use super::failure::{At, BadUsage, chain};
use super::outlook::duration;
use super::output::{self, refuse_inside_dataset, refuse_inside_input};
use super::run::dataset_format;
use super::tracks::announce;
use super::training::{Request, train};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Dataset; with `--source frames` and no `--import`, the frames themselves [default with --resume: that
    /// of the run]
    #[arg(required_unless_present_any = ["import", "resume"])]
    data: Option<PathBuf>,
    /// Format of the dataset [default: detected]
    #[arg(long, value_name = "NAME", value_parser = dataset_format)]
    format: Option<DatasetFormat>,
    /// Leave out images that the dataset lists and that are absent, and count them
    #[arg(long)]
    skip_missing: bool,
    /// Folder of the run, new or (with --resume) one that was begun
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    /// Model that learns the motion from the images: Deformable 3D Gaussians (defgs), a deformation that a
    /// field of rigid velocities carries on (freegave), a network that moves control nodes which the
    /// Gaussians follow (nodes), constant velocities (linear), or trajectories from elsewhere (frames)
    /// [default: defgs, with the preset `standard` nodes]
    #[arg(long, value_name = "SOURCE", value_parser = source_kind())]
    source: Option<SourceKind>,
    /// Take the source model from here instead of training it: a folder of splat files, a .safetensors of
    /// trajectories, moving splats (.splatv), point tracks of motion capture (.c3d, .csv, .tsv), or an output
    /// folder of the DefGS authors' program; without a dataset, stage 1 is all that is done
    #[arg(long, value_name = "PATH")]
    import: Option<PathBuf>,
    /// Defaults to start from [default: quick]
    #[arg(long, value_enum, value_name = "PRESET")]
    preset: Option<PresetName>,
    /// Time that training keeps to, such as 40m or 1h30m: schedules are stretched or shortened to end with it
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time_budget: Option<f64>,
    /// Width that images are resized to, pixels [default: as they are]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192))]
    size: Option<u32>,
    /// What moves objects [default: terms, with the preset `paper` networks]
    #[arg(long, value_enum, value_name = "DYNAMICS")]
    dynamics: Option<DynamicsName>,
    /// TOML file laid over the preset
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Setting laid over preset and file, such as source.iterations=500; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Seed of every random draw
    #[arg(long)]
    seed: Option<u64>,
    /// Continue from the run's latest checkpoint, under the run's own configuration
    #[arg(long)]
    resume: bool,
    /// Serve a page that shows the models while they are trained; its address is printed
    #[arg(long)]
    view: bool,
    /// Port of the page; 0 for a free one
    #[arg(long, default_value_t = 7007, requires = "view")]
    port: u16,
    /// Write a recording for rerun's viewer while training goes on: the curve, and now and then the Gaussians
    /// and a picture. It is FILE.part.rrd until the end (only in builds with the feature `rerun`)
    #[arg(long, value_name = "FILE.rrd")]
    rerun: Option<PathBuf>,
    #[command(flatten)]
    ablations: Ablations,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PresetName {
    /// Minutes on two processor cores
    Quick,
    /// For sets of any size, resolved from the data; as long as --time-budget says, else up to an hour
    Standard,
    /// As published; hours to days on a processor
    Paper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DynamicsName {
    /// Coordinates, terms and a neural remainder, chosen by evidence
    Terms,
    /// The paper's networks U and Q of every particle
    Networks,
}

/// Parses the name of a kind of source model.
fn source_kind() -> impl TypedValueParser<Value = SourceKind> {
    let kind = |name: String| SourceKind::ALL.into_iter().find(|kind| kind.name() == name);
    PossibleValuesParser::new(SourceKind::ALL.map(SourceKind::name))
        .map(move |name| kind(name).unwrap_or_default())
}

fn key_value(text: &str) -> Result<String, String> {
    if text.split_once('=').is_some_and(|(key, _)| !key.trim().is_empty()) {
        Ok(text.to_owned())
    } else {
        Err("expected KEY=VALUE".to_owned())
    }
}

pub(super) fn run(args: &Args) -> Result<()> {
    refuse_inside_dataset(&args.out)?;
    let Asked { data, import, config } = if args.resume { args.resumed()? } else { args.begun()? };
    if let Some(import) = &import {
        refuse_inside_input(&args.out, import)?;
        announce(import)?;
    }
    args.device.run(|device| {
        train(&Request {
            data: data.as_deref(),
            out: &args.out,
            config,
            resume: args.resume,
            source_from: None,
            view: args.view.then_some(args.port),
            rerun: args.rerun.as_deref(),
            device,
        })
    })?;
    output::print(&format!("{}\n", args.out.display()))
}

/// What is to be trained, and on what.
struct Asked {
    data: Option<PathBuf>,
    /// What is imported, where the call names it.
    import: Option<PathBuf>,
    config: TrainConfig,
}

impl Args {
    /// A new run: the one path of `--source frames PATH` is the frames.
    fn begun(&self) -> Result<Asked> {
        let (data, import) = match (self.data.clone(), self.import.clone()) {
            (frames, None) if self.source == Some(SourceKind::Frames) => (None, frames),
            paths => paths,
        };
        let preset = match self.preset {
            Some(PresetName::Paper) => Preset::Paper,
            Some(PresetName::Standard) => Preset::Standard,
            _ => Preset::Quick,
        };
        let mut sets = self.source_settings(import.as_deref())?;
        // A marker is a measured thing, not one Gaussian of many: by itself it can be an object.
        let is_tracks = import.as_deref().is_some_and(is_track_file);
        sets.extend(is_tracks.then(|| "partition.smallest_object=1".to_owned()));
        sets.extend(self.settings());
        Ok(Asked { data, import, config: configured(preset, self.config.as_deref(), &sets)? })
    }

    /// The run that is there, which flags may repeat but not change; what they do not say it says itself.
    fn resumed(&self) -> Result<Asked> {
        let (run, own) = RunFolder::open(&self.out).at(&self.out).context("there is no run to resume")?;
        let recorded = run.dataset().at(&run.config_path())?.map(|dataset| dataset.path);
        let has_frames_alone = recorded.is_none() && !own.source.import.is_empty();
        let (data, import) = match (self.data.clone(), self.import.clone()) {
            (frames, None) if has_frames_alone || self.source == Some(SourceKind::Frames) => (None, frames),
            paths => paths,
        };
        let mut sets = self.source_settings(import.as_deref())?;
        let name = |preset: PresetName| Some(preset.to_possible_value()?.get_name().to_owned());
        sets.extend(self.preset.and_then(name).map(|name| format!("preset={name}")));
        sets.extend(self.settings());
        let file = self.config.as_deref();
        let changed = blamed(file, own.changed_by(file, &sets), |file| own.changed_by(Some(file), &[]))?;
        refuse_change(changed, &self.out)?;
        Ok(Asked { data: data.or(recorded), import, config: own })
    }

    /// Settings of the source: its kind, which files to import decide if nothing else does, and these files.
    fn source_settings(&self, import: Option<&Path>) -> Result<Vec<String>> {
        let Some(import) = import else {
            return Ok(self.source.iter().map(|source| format!("source.kind={}", source.name())).collect());
        };
        // An official model is a source that could have been trained here, whatever it is called.
        let kind = match (imported_kind(import), self.source) {
            (found, None | Some(SourceKind::Frames)) => found.name(),
            (_, Some(named)) => named.name(),
        };
        let path = std::path::absolute(import).at(import)?;
        Ok(vec![format!("source.kind={kind}"), format!("source.import={}", path.display())])
    }

    /// Settings that other flags stand for.
    fn settings(&self) -> Vec<String> {
        let mut sets = Vec::new();
        sets.extend(self.format.map(|format| format!("data.format={}", format.name())));
        sets.extend(self.time_budget.map(|secs| format!("time_budget_secs={secs:?}")));
        sets.extend(self.size.map(|size| format!("data.resolution={size}")));
        sets.extend(self.skip_missing.then(|| "data.skip_missing=true".to_owned()));
        let name = |dynamics: DynamicsName| Some(dynamics.to_possible_value()?.get_name().to_owned());
        sets.extend(self.dynamics.and_then(name).map(|name| format!("distill.dynamics={name}")));
        sets.extend(self.ablations.settings());
        sets.extend_from_slice(&self.set);
        sets.extend(self.seed.map(|seed| format!("seed={seed}")));
        sets
    }
}

/// Refuses to resume a run under another configuration than its own.
pub(super) fn refuse_change(changed: Option<Difference>, out: &Path) -> Result<()> {
    let Some(Difference { key, own, other }) = changed else { return Ok(()) };
    bail!(
        "the run was begun with another configuration: `{key}` is {own} in the run, asked for is {other}; \
         a run keeps its settings, which need not be repeated: {}",
        out.display()
    )
}

/// A preset with a file and settings laid over it. Wrong settings are bad usage; a wrong file is not.
pub(super) fn configured(preset: Preset, file: Option<&Path>, settings: &[String]) -> Result<TrainConfig> {
    let alone = |file: &Path| TrainConfig::resolve(preset, Some(file), &[]);
    blamed(file, TrainConfig::resolve(preset, file, settings), alone)
}

/// The outcome of laying a file and settings over something: wrong settings are bad usage, a file that is
/// wrong by itself is not.
fn blamed<T, U>(
    file: Option<&Path>,
    outcome: Result<T, ConfigError>,
    alone: impl Fn(&Path) -> Result<U, ConfigError>,
) -> Result<T> {
    outcome.or_else(|error| {
        if let Some(file) = file {
            alone(file).map_err(TrainError::from).at(file).context("the configuration is wrong")?;
        }
        Err(BadUsage(format!("the configuration is wrong: {}", chain(&error.into()))).into())
    })
}
