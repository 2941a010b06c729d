//! `lagrangegs synth`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lgs_data::files::folder_of;
use lgs_data::synth::{Lamp, SynthError, SynthOptions, TrackOptions, check, generate, scenes, tracks};
use lgs_eval::table::aligned;

use super::failure::{At, BadUsage};
use super::output;
use super::progress::Task;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Name of the scene
    #[arg(required_unless_present = "list")]
    scene: Option<String>,
    /// List the scenes
    #[arg(long)]
    list: bool,
    /// Write the true tracks of surface points over the captured window instead of a dataset: a
    /// `.safetensors` file for `train --source frames`
    #[arg(long)]
    tracks: bool,
    /// Standard deviation of the tracks' noise, world units, correlated from frame to frame [default: 0]
    #[arg(long, value_name = "X", requires = "tracks")]
    noise: Option<f64>,
    /// Folder to write, new or empty; with --tracks the file
    #[arg(long, required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Width and height of the images, pixels [default: 160]
    #[arg(long, value_name = "PX")]
    size: Option<u32>,
    /// Training views; held-out ones are added [default: 12]
    #[arg(long)]
    views: Option<usize>,
    /// Draws the scene's constants, turns the cameras and shifts the textures [default: 0]
    #[arg(long)]
    seed: Option<u64>,
    /// Training images per unit of time and view, a divisor of 60, or 120 or 240 [default: 60]
    #[arg(long, value_name = "N")]
    train_fps: Option<u32>,
    /// Training views that show each time, drawn anew for each [default: all]
    #[arg(long, value_name = "N")]
    images_per_time: Option<usize>,
    /// A sun that stands still lights the bodies, and they cast shadows; else a lamp rides along with each
    #[arg(long)]
    sun: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let (Some(scene), Some(out), false) = (&args.scene, &args.out, args.list) else {
        return list();
    };
    if args.tracks {
        return write_tracks(scene, args, out);
    }
    let default = SynthOptions::default();
    let options = SynthOptions {
        size: args.size.unwrap_or(default.size),
        views: args.views.unwrap_or(default.views),
        seed: args.seed.unwrap_or(default.seed),
        train_fps: args.train_fps.unwrap_or(default.train_fps),
        images_per_time: args.images_per_time,
        lamp: if args.sun { Lamp::Sun } else { Lamp::Riding },
    };
    check_call(scene, &options)?;
    make(scene, &options, out)?;
    output::print(&format!("{}\n", out.display()))
}

/// Refuses a scene or an option that flags name and that there is not.
pub(super) fn check_call(scene: &str, options: &SynthOptions) -> Result<()> {
    check(scene, options).map_err(|error| {
        let text = match error {
            SynthError::Option { option, expected, found } => {
                format!("--{} should be {expected}, found {found}", option.replace('_', "-"))
            }
            other => other.to_string(),
        };
        BadUsage(text).into()
    })
}

/// Writes a scene behind a progress bar.
pub(super) fn make(scene: &str, options: &SynthOptions, out: &Path) -> Result<()> {
    output::refuse_inside_dataset(folder_of(out))?;
    let task = Task::new(scene, 0);
    generate(scene, options, out, &|done, total| task.count(done, total)).at(out)
}

fn write_tracks(scene: &str, args: &Args, out: &Path) -> Result<()> {
    let noise = args.noise.unwrap_or(0.0);
    if !(noise.is_finite() && noise >= 0.0) {
        let text = format!("--noise should be finite and not negative, found {noise}");
        return Err(BadUsage(text).into());
    }
    check_call(scene, &SynthOptions::default())?;
    output::refuse_inside_dataset(folder_of(out))?;
    let options = TrackOptions { noise, seed: args.seed.unwrap_or(0) };
    tracks(scene, &options).at(out)?.save(out)?;
    output::print(&format!("{}\n", out.display()))
}

fn list() -> Result<()> {
    let mut rows = Vec::new();
    for info in scenes() {
        let verdict = if info.explained { "" } else { " (no law explains it)" };
        rows.push(vec![info.name.to_owned(), format!("{}{verdict}", info.description)]);
        rows.push(vec![String::new(), format!("drawn: {}", info.drawn)]);
    }
    output::print(&aligned(&rows, &[false, false]))
}
