//! `lagrangegs render`.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use lgs_model::Motion;

use super::camera::{self, CameraChoice};
use super::compare::{Compare, Other};
use super::drawing::{Job, Label, Subject};
use super::failure::BadUsage;
use super::frames::MotionArgs;
use super::output::{self, refuse_inside_dataset};
use super::playback::record;
use super::run::Run;
use super::shots::{Shots, Wish};
use super::times::Times;
use super::trust::{Mark, ModelName, trust_in, warn_of};
use super::video::{Target, VideoArgs};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Times: FROM:TO:STEP, single times, or both separated by commas; from −τ_max to 3 τ_max [default: those
    /// of a camera path from a file]
    #[arg(long, allow_hyphen_values = true)]
    times: Option<Times>,
    /// A view of the dataset by name (train/r_000) or number, `orbit` (once around), `orbit:DEGREES`
    /// (standing still), `through:NAME,NAME,…` (from view to view; without names through all), or a camera
    /// path (FILE.json, as the page of `view` saves it)
    #[arg(long, default_value = "orbit")]
    camera: CameraChoice,
    /// Which of the run's models to draw; the source model knows only the captured window and beyond it
    /// guesses
    #[arg(long, value_enum, default_value_t = ModelName::Lagrangian)]
    model: ModelName,
    /// What to show beside each frame
    #[arg(long, value_enum, value_name = "WHAT")]
    compare: Option<Compare>,
    /// Write the time over each frame
    #[arg(long)]
    label: bool,
    #[command(flatten)]
    motion: MotionArgs,
    /// How to mark frames of times at which the motion of some object is not trusted
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    mark_untrusted: Mark,
    /// Folder to write images into, an image for a single time (FILE.png), a video (FILE.mp4, FILE.webm or
    /// FILE.gif), or a recording for rerun's viewer (FILE.rrd, only in builds with the feature `rerun`)
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    video: VideoArgs,
    /// Width of the images, pixels [default: the camera's]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192))]
    size: Option<u32>,
    /// Dataset, if it is no longer where training found it
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let wish = Wish {
        times: args.times.as_ref(),
        camera: &args.camera,
        rate: args.video.rate(),
        data: args.data.as_deref(),
    };
    wish.ensure_times();
    args.model.check_edit(args.motion.edit())?;
    args.check_out()?;
    let run = Run::open(&args.run)?;
    let Shots { times, cameras } = wish.shots(&run)?;
    refuse_inside_dataset(&args.out)?;
    run.refuse_inside_frames(&args.out)?;
    let mut other = Other::open(&run, args.compare, &cameras, args.data.as_deref())?;
    let sink = Sink::of(args, times.len())?;
    let job = Job {
        model: args.model,
        times,
        cameras: cameras.iter().map(|camera| camera::with_width(camera, args.size)).collect(),
        edit: args.motion.edit(),
        reversal: args.motion.reversal(),
        trust: trust_in(&run, args.model, args.motion.edit())?,
        mark: args.mark_untrusted,
        label: if args.label { Label::Times } else { Label::Names },
    };
    warn_of(&job.trust, &job.times);
    let begun = Instant::now();
    let made = make(&run, args.model, &job, (&mut other, &sink))?;
    let rate = job.times.len() as f64 / begun.elapsed().as_secs_f64().max(1e-9);
    let out = args.out.display();
    output::print(&format!("{made}, {rate:.0} frames per second with rollout and writing, {out}\n"))
}

/// Where the frames go.
enum Sink {
    Frames(Target),
    Recording(PathBuf),
}

impl Sink {
    /// The sink that a path means.
    fn of(args: &Args, frames: usize) -> Result<Self> {
        if args.is_recording() {
            return Ok(Self::Recording(args.out.clone()));
        }
        args.video.target(&args.out, frames).map(Self::Frames)
    }
}

impl Args {
    /// Whether the frames become a recording for rerun's viewer.
    fn is_recording(&self) -> bool {
        self.out.extension().is_some_and(|ending| ending == "rrd")
    }

    /// Refuses a name of the output that does not go with the other flags.
    fn check_out(&self) -> Result<()> {
        if !self.is_recording() {
            return self.video.check_name(&self.out, self.times.as_ref().map(|times| times.0.len()));
        }
        if self.compare.is_some() || self.label || self.video.is_set() {
            let text = "--compare, --label, --fps and --encoder are not for recordings";
            return Err(BadUsage(format!("{text}: {}", self.out.display())).into());
        }
        Ok(())
    }
}

/// Renders the frames of one of the run's models; returns what was written, in words.
fn make(run: &Run, model: ModelName, job: &Job, (other, sink): (&mut Other<'_>, &Sink)) -> Result<String> {
    let target = match sink {
        Sink::Frames(target) => target,
        Sink::Recording(path) => return record(run, model, job, path),
    };
    let background = run.scene.background;
    match model {
        ModelName::Lagrangian => {
            let mut motion = Motion::new(&run.scene, job.edit, job.reversal);
            let mut cloud_at = |time| run.scene.cloud_at(&motion.state_at(time), time);
            job.make(Subject { cloud_at: &mut cloud_at, background, other }, target)
        }
        ModelName::Source => {
            let none = || format!("the run has no source model: {}", run.folder.root().display());
            let source = run.source()?.with_context(none)?;
            let mut cloud_at = |time| source.cloud_at(time);
            job.make(Subject { cloud_at: &mut cloud_at, background, other }, target)
        }
    }
}
