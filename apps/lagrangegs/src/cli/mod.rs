//! The command line: parse, run, report.
//!
//! Results go to stdout, progress and logs to stderr. The exit code is 0 when done, 1 when something failed,
//! 2 for bad usage and 128 + N when signal N ended it at once (130: Ctrl-C); an error is one line that ends
//! with the path it is about (`failure.rs`). Each command has a file of its own.

mod ablation;
mod bench;
mod camera;
mod camera_path;
mod compare;
mod convert;
mod demo;
mod device;
mod drawing;
mod eval;
mod evidence;
mod export;
mod facts;
mod failure;
mod frames;
mod import;
mod info;
mod interrupt;
mod laws;
mod live;
mod outlook;
mod output;
mod playback;
mod profile;
mod progress;
mod render;
mod report;
mod run;
mod shots;
mod splats;
mod synth;
mod thresholds;
mod times;
mod tracks;
mod train;
mod training;
mod trust;
mod video;
mod view;
mod watchers;
mod weights;

use std::process::ExitCode;
use std::time::Instant;

use clap::{Parser, Subcommand};

use profile::Profile;

/// From multi-view images to an editable Lagrangian scene.
#[derive(Debug, Parser)]
#[command(name = "lagrangegs", version, about, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say at the end where the time went, by stage and operation
    #[arg(long, global = true)]
    profile: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The whole story on a synthetic scene: make it, train on it, measure, render its future, its past and
    /// other physics
    Demo(demo::Args),
    /// Write a synthetic dataset with ground truth
    Synth(synth::Args),
    /// Train a source model and distil it into a Lagrangian scene
    Train(train::Args),
    /// Measure a run: images of every split, and the motion
    Eval(eval::Args),
    /// Draw the figures of an evaluated run and gather them in report.html (eval does so too)
    Report(report::Args),
    /// Render a run at any times, from any camera, under edited physics
    Render(render::Args),
    /// Look at a run in the browser: any time, any camera, any physics
    View(view::Args),
    /// Write splat files, one per time, same order and count
    Export(export::Args),
    /// Turn splat files, or frames of them, into another format
    Convert(convert::Args),
    /// Run a suite of scenes, methods, seeds and ablations, and make its tables
    Bench(bench::Args),
    /// Convert a dataset of any format to the project's own layout
    Import(import::Args),
    /// Say what a dataset, run, checkpoint, splat file, folder of frames or other program's model holds, and
    /// what is wrong with it
    Info(info::Args),
    /// Import the networks that LPIPS needs, and say which there are
    Weights(weights::Args),
}

/// Runs the program with the process's arguments.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let profile = cli.profile.then(Profile::default);
    progress::start_logs(profile.as_ref());
    // The viewer ends in its own way.
    if !matches!(cli.command, Command::View(_)) {
        interrupt::listen();
    }
    let begun = Instant::now();
    let done = match &cli.command {
        Command::Demo(args) => demo::run(args),
        Command::Synth(args) => synth::run(args),
        Command::Train(args) => train::run(args),
        Command::Eval(args) => eval::run(args),
        Command::Report(args) => report::run(args),
        Command::Render(args) => render::run(args),
        Command::View(args) => view::run(args),
        Command::Export(args) => export::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Import(args) => import::run(args),
        Command::Info(args) => info::run(args),
        Command::Weights(args) => weights::run(args),
    };
    if let Some(profile) = profile {
        progress::say(&profile.table(begun.elapsed()));
    }
    match done {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever read the results has seen enough (`| head`).
        Err(error) if output::is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            progress::say(&format!("error: {}", failure::chain(&error)));
            if error.is::<failure::BadUsage>() { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
