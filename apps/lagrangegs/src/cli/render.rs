//! `lagrangegs render`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use lgs_core::{Camera, GaussianCloud, Image};
use lgs_data::dataset::DatasetFormat;
use lgs_dynamics::{Edit, Reversal};
use lgs_eval::laws::Trust;
use lgs_model::{LagrangianScene, Motion};
use lgs_report::sheet::{Row, contact_sheet, evenly};
use serde_json::json;

use super::camera::{self, CameraChoice, Orbit};
use super::frames::{MotionArgs, file_name, sweep};
use super::output::{self, prepare_folder, refuse_inside_dataset, remove_listed, write_list, write_png};
use super::run::{Run, load_dataset, load_options};
use super::times::Times;
use super::trust::{Mark, ModelName, listed, trust_in, warn_of};

/// Columns of the contact sheet.
const SHEET_COLUMNS: usize = 8;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Times: FROM:TO:STEP, single times, or both separated by commas; from −τ_max to 3 τ_max
    #[arg(long, allow_hyphen_values = true)]
    times: Times,
    /// A view of the dataset by name (train/r_000) or number, `orbit` (once around), or `orbit:DEGREES`
    /// (standing still)
    #[arg(long, default_value = "orbit")]
    camera: CameraChoice,
    /// Which of the run's models to draw; the source model knows only the captured window and beyond it
    /// guesses
    #[arg(long, value_enum, default_value_t = ModelName::Lagrangian)]
    model: ModelName,
    #[command(flatten)]
    motion: MotionArgs,
    /// How to mark frames of times at which the motion of some object is not trusted
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    mark_untrusted: Mark,
    /// Folder to write images into
    #[arg(long)]
    out: PathBuf,
    /// Width of the images, pixels [default: the camera's]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192))]
    size: Option<u32>,
    /// Dataset, if it is no longer where training found it
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    if args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case("mp4")) {
        bail!("video files are not supported yet; give a folder: {}", args.out.display());
    }
    let run = Run::open(&args.run)?;
    args.times.check(&run.scene.motion, &args.run)?;
    refuse_inside_dataset(&args.out)?;
    let cameras = cameras(&run, args)?.iter().map(|camera| camera::with_width(camera, args.size)).collect();
    let job = Job {
        times: args.times.0.clone(),
        cameras,
        edit: args.motion.edit(),
        reversal: args.motion.reversal(),
        trust: trust_in(&run, args.model, args.motion.edit()),
        mark: args.mark_untrusted,
    };
    warn_of(&job.trust, &job.times);
    let begun = Instant::now();
    let frames = match args.model {
        ModelName::Lagrangian => job.write(&run.scene, &args.out)?,
        ModelName::Source => {
            if args.motion.edit() != Edit::default() {
                bail!("the source model has no physics to scale; leave out the scales or `--model source`");
            }
            let source = run
                .source()?
                .with_context(|| format!("the run has no source model: {}", args.run.display()))?;
            job.write_clouds(|time| source.cloud_at(time), run.scene.background, &args.out)?
        }
    };
    let rate = frames.len() as f64 / begun.elapsed().as_secs_f64().max(1e-9);
    output::print(&format!(
        "{} images, {rate:.0} per second with rollout and writing, {}\n",
        frames.len(),
        args.out.display()
    ))
}

/// One camera per time.
fn cameras(run: &Run, args: &Args) -> Result<Vec<Camera>> {
    let known = run.cameras()?;
    let count = args.times.0.len();
    match &args.camera {
        CameraChoice::Orbit(azimuth) => Ok(orbit(run)?.cameras(*azimuth, count)),
        CameraChoice::Named(name) => Ok(vec![named(run, name, &known, args.data.as_deref())?; count]),
    }
}

/// The orbit that suits a run.
pub(super) fn orbit(run: &Run) -> Result<Orbit> {
    let cameras: Vec<Camera> = run.cameras()?.into_iter().map(|(_, camera)| camera).collect();
    let mut motion = Motion::new(&run.scene, Edit::default(), Reversal::Exact);
    Ok(Orbit::around(&cameras, &run.scene.cloud_at(&motion.state_at(0.0))))
}

/// A training camera that the run lists, or any camera of the dataset.
fn named(run: &Run, name: &str, known: &[(String, Camera)], data: Option<&Path>) -> Result<Camera> {
    if let Some(camera) = camera::find(name, known) {
        return Ok(camera);
    }
    let Some(root) = run.dataset_path(data)?.filter(|root| root.is_dir()) else {
        return camera::unknown(name, known, run.folder.root());
    };
    // Reading the split of the name's first part alone saves decoding all the others.
    let format = run.config.data.format.or_else(|| DatasetFormat::detect(&root));
    let holds = |split: &&str| format.is_some_and(|format| format.has_split(&root, split));
    let split = name.split('/').next().filter(holds);
    let dataset = load_dataset(&root, &load_options(&run.config, split.map(|s| vec![s.to_owned()])))?;
    let all: Vec<(String, Camera)> =
        dataset.splits.values().flatten().map(|f| (f.name.clone(), f.camera)).collect();
    match camera::find(name, &all).filter(|_| name.parse::<usize>().is_err()) {
        Some(camera) => Ok(camera),
        None => camera::unknown(name, if known.is_empty() { &all } else { known }, run.folder.root()),
    }
}

/// Frames to render: one camera per time, one motion.
pub(super) struct Job {
    pub(super) times: Vec<f32>,
    pub(super) cameras: Vec<Camera>,
    pub(super) edit: Edit,
    pub(super) reversal: Reversal,
    pub(super) trust: Trust,
    pub(super) mark: Mark,
}

impl Job {
    /// Renders all frames of a Lagrangian scene and writes each as it is done, then the list of frames and a
    /// contact sheet; returns the images. States are cached, so that the frames cost one rollout.
    pub(super) fn write(&self, scene: &LagrangianScene, out: &Path) -> Result<Vec<Image>> {
        let mut motion = Motion::new(scene, self.edit, self.reversal);
        self.write_clouds(|time| scene.cloud_at(&motion.state_at(time)), scene.background, out)
    }

    /// Renders all frames of anything that has a cloud at every time.
    fn write_clouds(
        &self,
        cloud_at: impl FnMut(f32) -> GaussianCloud,
        background: [f32; 3],
        out: &Path,
    ) -> Result<Vec<Image>> {
        prepare_folder(out)?;
        remove_listed(out)?;
        let images = sweep(cloud_at, &self.times, "rendering", |index, cloud| {
            let mut image = lgs_eval::render(cloud, &self.cameras[index], background).image;
            self.mark.apply(&self.trust, self.times[index], &mut image);
            write_png(&out.join(file_name(index, self.times[index], "png")), &image)?;
            Ok(image)
        })?;
        write_list(out, &self.list())?;
        write_png(&out.join("sheet.png"), &self.sheet(&images))?;
        Ok(images)
    }

    fn list(&self) -> serde_json::Value {
        let frame = |(index, &time): (usize, &f32)| listed(&file_name(index, time, "png"), time, &self.trust);
        json!({
            "velocity_scale": self.edit.velocity_scale,
            "potential_scale": self.edit.potential_scale,
            "force_scale": self.edit.force_scale,
            "reversal": self.reversal,
            "frames": self.times.iter().enumerate().map(frame).collect::<Vec<_>>(),
        })
    }

    fn sheet(&self, images: &[Image]) -> Image {
        let chosen = evenly(images.len(), SHEET_COLUMNS);
        let labels: Vec<String> = chosen.iter().map(|&i| time_label(self.times[i])).collect();
        contact_sheet(
            &labels,
            &[Row { title: String::new(), frames: chosen.iter().map(|&i| images[i].clone()).collect() }],
        )
    }
}

/// A time over a column of a contact sheet.
pub(super) fn time_label(time: f32) -> String {
    format!("t = {time:.2}")
}
