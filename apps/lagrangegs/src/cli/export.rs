//! `lagrangegs export`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use lgs_data::ply::write_ply;
use lgs_dynamics::Edit;
use lgs_model::Motion;
use serde_json::json;

use super::failure::At;
use super::frames::{MotionArgs, file_name, sweep};
use super::output::{self, prepare_folder, refuse_inside_dataset, remove_listed, write_list};
use super::render::ModelName;
use super::run::Run;
use super::times::Times;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Times: FROM:TO:STEP, single times, or both separated by commas; from −τ_max to 3 τ_max
    #[arg(long, allow_hyphen_values = true)]
    times: Times,
    /// Whose Gaussians
    #[arg(long, value_enum, default_value_t = ModelName::Lagrangian)]
    model: ModelName,
    /// File format
    #[arg(long, value_enum, default_value_t = Format::Ply)]
    format: Format,
    #[command(flatten)]
    motion: MotionArgs,
    /// Folder to write files into, or a single .ply file for a single time
    #[arg(long)]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Gaussian splats as the INRIA viewers read them
    Ply,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let run = Run::open(&args.run)?;
    args.times.check(&run.scene.motion).at(&args.run)?;
    refuse_inside_dataset(&args.out)?;
    let source = match args.model {
        ModelName::Lagrangian => None,
        ModelName::Source if args.motion.edit() != Edit::default() => {
            bail!("the source model has no physics to scale; leave out the scales or `--model source`")
        }
        ModelName::Source => Some(
            run.source()?.with_context(|| format!("the run has no source model: {}", args.run.display()))?,
        ),
    };
    let mut motion = Motion::new(&run.scene, args.motion.edit(), args.motion.reversal());
    let extension = match args.format {
        Format::Ply => "ply",
    };
    let times = &args.times.0;
    let single = times.len() == 1 && args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
    let path = |index: usize| {
        if single { args.out.clone() } else { args.out.join(file_name(index, times[index], extension)) }
    };
    if single {
        prepare_folder(args.out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")))?;
    } else {
        prepare_folder(&args.out)?;
        remove_listed(&args.out)?;
    }
    let gaussians = source.as_ref().map_or(run.scene.len(), |source| source.len());
    let cloud_at = |time| match &source {
        Some(source) => source.cloud_at(time),
        None => run.scene.cloud_at(&motion.state_at(time)),
    };
    sweep(cloud_at, times, "export", |index, cloud| write_ply(&path(index), cloud).at(&path(index)))?;
    if !single {
        let files = times
            .iter()
            .enumerate()
            .map(|(i, &t)| json!({"file": file_name(i, t, extension), "time": t}))
            .collect::<Vec<_>>();
        write_list(&args.out, &json!({ "gaussians": gaussians, "frames": files }))?;
    }
    output::print(&format!("{} files of {} Gaussians, {}\n", times.len(), gaussians, args.out.display()))
}
