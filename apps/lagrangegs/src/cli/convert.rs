//! `lagrangegs convert`: splat files, folders of frames and trajectories from one format into another.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use lgs_core::GaussianCloud;
use lgs_data::frames::{FrameFile, FrameSequence, list_frames, read_frames};
use lgs_data::splats::{SplatFormat, read_splats, write_splats};
use serde_json::{Value, json};

use super::failure::{At, BadUsage};
use super::output::{
    self, FrameFolder, FrameKind, prepare_folder, refuse_inside_dataset, refuse_inside_input,
};
use super::progress::Task;
use super::splats::{format_of, frame_name, splat_format, warn_of_loss};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Splat file, folder of frames, or trajectories (.safetensors, .splatv, .c3d, .csv, .tsv)
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Splat file; for several frames a folder, or a .safetensors of trajectories
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Format of the splat files [default: that of OUT's name, else ply]
    #[arg(long, value_name = "FORMAT", value_parser = splat_format())]
    format: Option<SplatFormat>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let (input, out) = (args.input.as_path(), args.output.as_path());
    if !input.exists() {
        bail!("there is no such file or folder: {}", input.display());
    }
    refuse_inside_dataset(out)?;
    let format = args.format.unwrap_or_else(|| format_of(out));
    if out.extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors")) {
        let sequence = read_frames(input).at(input)?;
        sequence.save(out)?;
        return done(sequence.times.len(), sequence.gaussians.len(), out);
    }
    let frames = if input.is_dir() {
        Frames::Files(input, list_frames(input).at(input)?)
    } else if SplatFormat::of_name(input).is_some() {
        let cloud = read_splats(input).at(input)?;
        warn_of_loss(cloud.sh_degree, format);
        write_splats(out, &cloud, format).at(out)?;
        return done(1, cloud.len(), out);
    } else {
        Frames::Sequence(read_frames(input).at(input)?)
    };
    convert_frames(&frames, out, format)
}

/// Frames of a folder, or of a file.
enum Frames<'a> {
    Files(&'a Path, Vec<FrameFile>),
    Sequence(FrameSequence),
}

impl Frames<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Files(_, files) => files.len(),
            Self::Sequence(sequence) => sequence.times.len(),
        }
    }

    fn time(&self, frame: usize) -> Option<f32> {
        match self {
            Self::Files(_, files) => files[frame].time,
            Self::Sequence(sequence) => Some(sequence.times[frame]),
        }
    }

    fn cloud(&self, frame: usize) -> Result<GaussianCloud> {
        match self {
            Self::Files(folder, files) => {
                let path = folder.join(&files[frame].name);
                read_splats(&path).at(&path)
            }
            Self::Sequence(sequence) => Ok(sequence.cloud(frame)),
        }
    }
}

fn convert_frames(frames: &Frames<'_>, out: &Path, format: SplatFormat) -> Result<()> {
    if frames.len() == 0 {
        bail!("expected splat files (.ply, .compressed.ply, .splat, .spz), found none: {}", out.display());
    }
    if let Frames::Files(folder, _) = frames {
        refuse_inside_input(out, folder)?;
    }
    if SplatFormat::of_name(out).is_some() && !out.is_dir() {
        let text = "a splat file holds a single time; frames go into a folder";
        return Err(BadUsage(format!("{text}: {}", out.display())).into());
    }
    prepare_folder(out)?;
    let task = Task::new("convert", frames.len() as u64);
    let gaussians = FrameFolder::fill(out, FrameKind::Splats, |folder| {
        let (mut gaussians, mut listed) = (0, Vec::new());
        for frame in 0..frames.len() {
            let (name, cloud) = (frame_name(frame, format), frames.cloud(frame)?);
            if frame == 0 {
                warn_of_loss(cloud.sh_degree, format);
            }
            gaussians = cloud.len();
            let path = folder.path(&name);
            write_splats(&path, &cloud, format).at(&path)?;
            listed.push(entry(&name, frames.time(frame)));
            task.count(frame + 1, frames.len());
        }
        Ok((gaussians, json!({ "frames": listed })))
    })?;
    done(frames.len(), gaussians, out)
}

/// A file in the list of a folder; frames without times are listed without them.
fn entry(name: &str, time: Option<f32>) -> Value {
    match time {
        Some(time) => json!({ "file": name, "time": time }),
        None => json!({ "file": name }),
    }
}

fn done(files: usize, gaussians: usize, out: &Path) -> Result<()> {
    output::print(&format!("{files} frames of {gaussians} Gaussians, {}\n", out.display()))
}
