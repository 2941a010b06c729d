//! `view`: a page in the browser that looks at a run and steers its physics.

use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use lgs_core::{Camera, GaussianCloud};
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::source::{SourceModel, load_source};
use lgs_model::{LagrangianScene, MotionConfig};
use lgs_train::RunFolder;
use lgs_view::{Exhibit, Options, Server, Subject, TruthImage};

use super::camera::Orbit;
use super::failure::At;
use super::interrupt::on_interrupt;
use super::laws::laws_of;
use super::output;
use super::progress::say;
use super::run::{Run, name_of, open_folder};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Port to listen on; 0 for a free one
    #[arg(long, default_value_t = 7007)]
    port: u16,
    /// Address to listen on; other than a loopback address it asks every page for a token
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
    /// Token that pages have to bring [default: none on a loopback address, else a random one]
    #[arg(long)]
    token: Option<String>,
    /// Open the page in the browser
    #[arg(long)]
    open: bool,
    /// Memory for kept rollouts, MiB
    #[arg(long, value_name = "MIB", default_value_t = 1024)]
    cache: usize,
    /// Pages that may be open at a time
    #[arg(long, value_name = "N", default_value_t = 16)]
    pages: usize,
    /// Do not read the dataset's images, which are there to compare with
    #[arg(long)]
    no_images: bool,
    /// Dataset, if it is no longer where training found it
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let options = Options {
        host: args.host,
        port: args.port,
        token: args.token.clone(),
        cache_bytes: args.cache << 20,
        most_pages: args.pages,
    };
    let server = Server::bind(options)?;
    let subject = subject(args)?;
    subject.missing.iter().for_each(|part| say(&format!("warning: {part}")));
    let stopper = server.stopper();
    on_interrupt(move |_| stopper.stop()).context("cannot take Ctrl-C")?;
    let url = server.url();
    output::print(&format!("{url}\n"))?;
    say("Ctrl-C ends the viewer");
    if args.open && webbrowser::open(&url).is_err() {
        say("warning: no browser could be opened; open the address by hand");
    }
    Ok(server.run(&Arc::new(Exhibit::of(subject)))?)
}

/// The parts of a run that there are.
fn subject(args: &Args) -> Result<Subject> {
    let (folder, config) = open_folder(&args.run)?;
    let source_path = folder.source_path(config.source.kind);
    let source = if source_path.exists() { Some(load_source(&source_path).at(&source_path)?) } else { None };
    let mut missing = Vec::new();
    let has_scene = folder.scene_path().exists();
    let mut run =
        if has_scene { Run::open(&args.run)? } else { unfinished(folder, config, source.as_deref())? };
    if !has_scene {
        missing.push("training is not finished: this is the source model alone".to_owned());
    }
    if source.is_none() {
        missing.push("the run has no source model".to_owned());
    }
    let dataset = if args.no_images { None } else { dataset(&run, args.data.as_deref(), &mut missing)? };
    if let Some(dataset) = dataset.as_ref().filter(|_| !has_scene) {
        run.scene.background = dataset.background;
    }
    let cameras = match &dataset {
        Some(dataset) => {
            dataset.cameras("train").iter().map(|frame| (frame.name.clone(), frame.camera)).collect()
        }
        None => distinct(run.cameras()?),
    };
    let frames = dataset.and_then(|mut dataset| dataset.splits.remove("train")).unwrap_or_default();
    let views: Vec<Camera> = cameras.iter().map(|(_, camera)| *camera).collect();
    let orbit = Orbit::around(&views, &start_cloud(&run.scene));
    Ok(Subject {
        title: name_of(&args.run),
        run: args.run.display().to_string(),
        start: (orbit.at(-60.0), orbit.center()),
        laws: if has_scene { laws_of(&run)? } else { Vec::new() },
        truth: frames.into_iter().map(|frame| truth(frame, &cameras, run.scene.background)).collect(),
        has_scene,
        scene: run.scene,
        source: source.map(Arc::from),
        cameras,
        missing,
    })
}

/// A scene in which the first frame of a source model rests, for as long as there is no other.
pub(super) fn resting(source: &dyn SourceModel, background: [f32; 3]) -> LagrangianScene {
    let motion = MotionConfig { dt: 0.01, time_window: source.time_range().map_or(1.0, |[_, last]| last) };
    LagrangianScene::still(source.cloud_at(0.0), motion, background)
}

/// A run whose training is under way, with the source model's first frame in place of the scene.
fn unfinished(
    folder: RunFolder,
    config: lgs_train::TrainConfig,
    source: Option<&dyn SourceModel>,
) -> Result<Run> {
    let Some(source) = source else {
        bail!("there is neither a scene nor a source model to look at yet: {}", folder.root().display());
    };
    let background = if config.data.white_background { [1.0; 3] } else { [0.0; 3] };
    let scene = resting(source, background);
    Ok(Run { folder, config, scene })
}

/// The training images, unless they are gone.
fn dataset(run: &Run, given: Option<&Path>, missing: &mut Vec<String>) -> Result<Option<Dataset>> {
    let Some(root) = run.dataset_path(given)? else { return Ok(None) };
    if given.is_none() && !root.is_dir() {
        missing.push(format!("the dataset is no longer where training found it: {}", root.display()));
        return Ok(None);
    }
    run.images(&root, Some(vec!["train".to_owned()])).map(Some)
}

/// Cameras without those that only repeat another.
pub(super) fn distinct(cameras: Vec<(String, Camera)>) -> Vec<(String, Camera)> {
    let mut found: Vec<(String, Camera)> = Vec::new();
    for (name, camera) in cameras {
        if found.iter().all(|(_, other)| *other != camera) {
            found.push((name, camera));
        }
    }
    found
}

pub(super) fn start_cloud(scene: &LagrangianScene) -> GaussianCloud {
    let mut motion = lgs_model::Motion::new(scene, lgs_dynamics::Edit::default(), Default::default());
    scene.cloud_at(&motion.state_at(0.0), 0.0)
}

fn truth(frame: Frame, cameras: &[(String, Camera)], background: [f32; 3]) -> TruthImage {
    let camera = cameras.iter().position(|(_, camera)| *camera == frame.camera).unwrap_or_default();
    TruthImage { camera, time: frame.time, load: Box::new(move || Ok(frame.composited(background))) }
}
