//! `lagrangegs synth`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lgs_data::files::folder_of;
use lgs_data::synth::{SynthOptions, generate, scenes};
use lgs_eval::table::aligned;

use super::failure::At;
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
    /// Folder to write, new or empty
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
    /// Training images per unit of time and view, a divisor of 60 [default: 60]
    #[arg(long, value_name = "N")]
    train_fps: Option<u32>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let (Some(scene), Some(out), false) = (&args.scene, &args.out, args.list) else {
        return list();
    };
    let default = SynthOptions::default();
    let options = SynthOptions {
        size: args.size.unwrap_or(default.size),
        views: args.views.unwrap_or(default.views),
        seed: args.seed.unwrap_or(default.seed),
        train_fps: args.train_fps.unwrap_or(default.train_fps),
    };
    make(scene, &options, out)?;
    output::print(&format!("{}\n", out.display()))
}

/// Writes a scene behind a progress bar.
pub(super) fn make(scene: &str, options: &SynthOptions, out: &Path) -> Result<()> {
    output::refuse_inside_dataset(folder_of(out))?;
    let task = Task::new(scene, 0);
    generate(scene, options, out, &|done, total| task.count(done, total)).at(out)
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
