//! `--times` and `--camera` together: a time and a camera for every frame.

use std::path::Path;

use anyhow::{Result, bail};
use clap::error::ErrorKind;
use lgs_core::Camera;
use lgs_data::dataset::{DatasetFormat, NearPlanes};
use lgs_dynamics::{Edit, Reversal};
use lgs_model::Motion;

use super::camera::{self, CameraChoice, Orbit};
use super::camera_path::CameraPath;
use super::run::Run;
use super::times::Times;

/// A time and a camera for every frame.
pub(super) struct Shots {
    pub(super) times: Vec<f32>,
    pub(super) cameras: Vec<Camera>,
}

/// What is asked for.
pub(super) struct Wish<'a> {
    pub(super) times: Option<&'a Times>,
    pub(super) camera: &'a CameraChoice,
    /// Frames per second of a path's film.
    pub(super) rate: u32,
    /// Dataset, if it is no longer where training found it.
    pub(super) data: Option<&'a Path>,
}

impl Wish<'_> {
    /// Ends the program where times are missing: the call is a wrong one.
    pub(super) fn ensure_times(&self) {
        if self.times.is_none() && !matches!(self.camera, CameraChoice::Path(_)) {
            let text = "--times is needed: only a camera path from a file brings its own\n";
            clap::Error::raw(ErrorKind::MissingRequiredArgument, text).exit();
        }
    }

    /// The frames of a run that are asked for.
    pub(super) fn shots(&self, run: &Run) -> Result<Shots> {
        if let CameraChoice::Path(file) = self.camera {
            return self.film(run, file);
        }
        let times = self.times.map_or_else(Vec::new, |times| times.0.clone());
        times_fit(run, &times, run.folder.root())?;
        let cameras = match self.camera {
            CameraChoice::Orbit(azimuth) => orbit(run)?.cameras(*azimuth, times.len()),
            CameraChoice::Named(name) => vec![self.named(run, name)?; times.len()],
            CameraChoice::Through(names) => self.through(run, names)?.spread(times.len()),
            CameraChoice::Path(_) => Vec::new(),
        };
        Ok(Shots { times, cameras })
    }

    /// A path's own times, unless others are given: then the camera goes evenly along the path.
    fn film(&self, run: &Run, file: &Path) -> Result<Shots> {
        let path = CameraPath::read(file)?;
        let (times, mut cameras) = match self.times {
            Some(times) => (times.0.clone(), path.spread(times.0.len())),
            None => match path.film(self.rate) {
                Ok(film) => film,
                Err(reason) => bail!("{reason}: {}", file.display()),
            },
        };
        let rig: Vec<Camera> = run.cameras()?.into_iter().map(|(_, camera)| camera).collect();
        let planes = NearPlanes::of(&rig);
        cameras.iter_mut().for_each(|camera| *camera = run.as_trained(*camera, &planes));
        let place = if self.times.is_some() { run.folder.root() } else { file };
        times_fit(run, &times, place)?;
        Ok(Shots { times, cameras })
    }

    /// A training camera that the run lists, or any camera of the dataset.
    fn named(&self, run: &Run, name: &str) -> Result<Camera> {
        let known = run.cameras()?;
        if let Some(camera) = camera::find(name, &known) {
            return Ok(camera);
        }
        let Some(root) = run.dataset_path(self.data)? else {
            return camera::unknown(name, &known, run.folder.root());
        };
        if !root.is_dir() {
            let root = root.display();
            bail!(
                "the run lists no camera `{name}`, and the dataset, which may have it, is absent (name it \
                 with --data); looked for at: {root}"
            );
        }
        // Reading the split of the name's first part alone saves decoding all the others.
        let format = run.config.data.format.or_else(|| DatasetFormat::detect(&root));
        let holds = |split: &&str| format.is_some_and(|format| format.has_split(&root, split));
        let split = name.split('/').next().filter(holds);
        let dataset = run.images(&root, split.map(|s| vec![s.to_owned()]))?;
        let all: Vec<(String, Camera)> =
            dataset.splits.values().flatten().map(|f| (f.name.clone(), f.camera)).collect();
        match camera::find(name, &all).filter(|_| name.parse::<usize>().is_err()) {
            Some(camera) => Ok(camera),
            None => camera::unknown(name, if known.is_empty() { &all } else { &known }, run.folder.root()),
        }
    }

    /// The path through named views, or through all that differ.
    fn through(&self, run: &Run, names: &[String]) -> Result<CameraPath> {
        let cameras = if names.is_empty() {
            let mut cameras: Vec<Camera> = run.cameras()?.into_iter().map(|(_, camera)| camera).collect();
            cameras.dedup_by(|a, b| a.camera_from_world == b.camera_from_world);
            cameras
        } else {
            names.iter().map(|name| self.named(run, name)).collect::<Result<Vec<Camera>>>()?
        };
        match CameraPath::through(&cameras) {
            Some(path) => Ok(path),
            None => {
                bail!("the run lists no cameras to go through; use `orbit`: {}", run.folder.root().display())
            }
        }
    }
}

fn times_fit(run: &Run, times: &[f32], path: &Path) -> Result<()> {
    Times(times.to_vec()).check(&run.scene.motion, path)
}

/// The orbit that suits a run.
pub(super) fn orbit(run: &Run) -> Result<Orbit> {
    let cameras: Vec<Camera> = run.cameras()?.into_iter().map(|(_, camera)| camera).collect();
    let mut motion = Motion::new(&run.scene, Edit::default(), Reversal::Exact);
    Ok(Orbit::around(&cameras, &run.scene.cloud_at(&motion.state_at(0.0), 0.0)))
}
