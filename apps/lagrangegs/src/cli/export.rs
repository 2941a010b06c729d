//! `lagrangegs export`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lgs_core::GaussianCloud;
use lgs_data::files::folder_of;
use lgs_data::splats::{SplatFormat, write_splats};
use lgs_eval::laws::Trust;
use lgs_model::Motion;
use lgs_model::source::SourceModel;
use serde_json::json;

use super::failure::{At, BadUsage};
use super::frames::{MotionArgs, sweep};
use super::output::{self, FrameFolder, FrameKind, prepare_folder, refuse_inside_dataset};
use super::run::Run;
use super::splats::{format_of, frame_name, splat_format, warn_of_loss};
use super::times::Times;
use super::trust::{ModelName, listed, trust_in, warn_of};

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
    /// Format of the splat files [default: that of the name in --out, else ply]
    #[arg(long, value_name = "FORMAT", value_parser = splat_format())]
    format: Option<SplatFormat>,
    #[command(flatten)]
    motion: MotionArgs,
    /// Folder to write files into, or a single splat file for a single time
    #[arg(long)]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<()> {
    args.model.check_edit(args.motion.edit())?;
    args.check_out()?;
    let run = Run::open(&args.run)?;
    args.times.check(&run.scene.motion, &args.run)?;
    refuse_inside_dataset(&args.out)?;
    run.refuse_inside_frames(&args.out)?;
    let source = source(args, &run)?;
    let mut motion = Motion::new(&run.scene, args.motion.edit(), args.motion.reversal());
    let files = Files::prepare(args)?;
    let trust = trust_in(&run, args.model, args.motion.edit())?;
    warn_of(&trust, files.times);
    let degrees = [&run.scene.static_gaussians, &run.scene.dynamic_gaussians].map(|cloud| cloud.sh_degree);
    warn_of_loss(degrees[0].max(degrees[1]), files.format);
    let gaussians = source.as_ref().map_or(run.scene.len(), |source| source.len());
    let cloud_at = |time| match &source {
        Some(source) => source.cloud_at(time),
        None => run.scene.cloud_at(&motion.state_at(time), time),
    };
    files.write(cloud_at, (gaussians, &trust))?;
    let count = args.times.0.len();
    output::print(&format!("{count} files of {gaussians} Gaussians, {}\n", args.out.display()))
}

impl Args {
    /// Refuses the name of a splat file for several times or another format.
    fn check_out(&self) -> Result<()> {
        let Some(named) = SplatFormat::of_name(&self.out).filter(|_| !self.out.is_dir()) else {
            return Ok(());
        };
        let is_other = self.format.is_some_and(|format| format != named);
        if is_other || self.times.0.len() > 1 {
            let text =
                "a splat file holds a single time in the format of its name; other files go into a folder";
            return Err(BadUsage(format!("{text}: {}", self.out.display())).into());
        }
        Ok(())
    }
}

/// The source model, if its Gaussians are asked for.
fn source(args: &Args, run: &Run) -> Result<Option<Box<dyn SourceModel>>> {
    match args.model {
        ModelName::Lagrangian => Ok(None),
        ModelName::Source => {
            let source = run.source()?;
            source.map(Some).with_context(|| format!("the run has no source model: {}", args.run.display()))
        }
    }
}

/// Where the files go: into a folder, or to a single path.
struct Files<'a> {
    out: &'a Path,
    times: &'a [f32],
    format: SplatFormat,
    is_single: bool,
}

impl<'a> Files<'a> {
    /// Makes sure that the files can be written.
    fn prepare(args: &'a Args) -> Result<Self> {
        let (out, times) = (args.out.as_path(), args.times.0.as_slice());
        let format = args.format.unwrap_or_else(|| format_of(out));
        let is_single = times.len() == 1 && SplatFormat::of_name(out) == Some(format) && !out.is_dir();
        prepare_folder(if is_single { folder_of(out) } else { out })?;
        Ok(Self { out, times, format, is_single })
    }

    /// Writes the Gaussians at all times, and into a folder the list of the files.
    fn write(
        &self,
        cloud_at: impl FnMut(f32) -> GaussianCloud,
        (gaussians, trust): (usize, &Trust),
    ) -> Result<()> {
        let write = |path: &Path, cloud: &GaussianCloud| write_splats(path, cloud, self.format).at(path);
        if self.is_single {
            return sweep(cloud_at, self.times, "export", |_, cloud| write(self.out, cloud)).map(drop);
        }
        let name = |index: usize| frame_name(index, self.format);
        FrameFolder::fill(self.out, FrameKind::Splats, |frames| {
            let work = |index: usize, cloud: &GaussianCloud| write(&frames.path(&name(index)), cloud);
            sweep(cloud_at, self.times, "export", work)?;
            let entry = |(index, &time): (usize, &f32)| listed(&name(index), time, trust);
            let files: Vec<_> = self.times.iter().enumerate().map(entry).collect();
            Ok(((), json!({ "gaussians": gaussians, "frames": files })))
        })
    }
}
