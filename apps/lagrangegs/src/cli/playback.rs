//! `render --out FILE.rrd`: the motion of a run as a recording for rerun's viewer.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use lgs_core::GaussianCloud;
use lgs_eval::laws::Trust;
use lgs_model::source::SourceModel;
use lgs_model::{Motion, SceneState};
use lgs_rerun::{Moment, Moving, ObjectNote, Picture, Playback};
use lgs_view::object_color;

use super::drawing::Job;
use super::failure::At;
use super::frames::sweep_in_order;
use super::laws::laws_of;
use super::run::{Run, name_of};
use super::trust::ModelName;
use super::view::distinct;

/// A model at a time.
struct Shown {
    cloud: GaussianCloud,
    /// State and energies of the objects, of a scene.
    state: Option<(SceneState, Vec<[f64; 2]>)>,
}

/// The model that is recorded.
enum Model<'a> {
    Scene(Box<Motion<'a>>),
    Source(Box<dyn SourceModel>),
}

/// Records the frames of one of the run's models; returns what was written, in words.
pub(super) fn record(run: &Run, model: ModelName, job: &Job, path: &Path) -> Result<String> {
    let mut shown = Model::open(run, model, job)?;
    let title = format!("{}, {}", name_of(run.folder.root()), model.word());
    let about = format!("{:?} {:?} {:?} {:?}", job.edit, job.reversal, job.times, job.cameras);
    let mut playback = Playback::begin(path, (&title, about.as_bytes()), &run.scene).at(path)?;
    playback.cameras(&distinct(run.cameras()?)).at(path)?;
    if model == ModelName::Lagrangian {
        playback.objects(notes(run, &job.trust)?).at(path)?;
    }
    let subject = |index: usize| Ok(Arc::new(shown.at(job.times[index])));
    let work = |index: usize, shown: &Arc<Shown>| {
        let mut image = lgs_eval::render(&shown.cloud, &job.cameras[index], run.scene.background).image;
        job.mark.apply(&job.trust, job.times[index], &mut image);
        Ok((index, Arc::clone(shown), Picture::of(&image)))
    };
    let parts = if model == ModelName::Source { 1 } else { run.scene.objects.len() };
    let take = |(index, shown, picture): (usize, Arc<Shown>, Picture)| {
        let time = job.times[index];
        let untrusted = job.trust.untrusted_at(time);
        let trusted: Vec<bool> = (0..parts).map(|part| !untrusted.contains(&part)).collect();
        let (camera, picture, trusted) = (&job.cameras[index], &picture, trusted.as_slice());
        let moment = Moment { time, moving: shown.moving(), camera, picture, trusted };
        playback.moment(&moment).at(path)
    };
    sweep_in_order("recording", job.times.len(), subject, work, take)?;
    let bytes = playback.finish().at(path)?;
    Ok(format!("a recording of {} times, {:.0} kB", job.times.len(), bytes as f64 / 1e3))
}

impl Shown {
    fn moving(&self) -> Moving<'_> {
        match &self.state {
            Some((state, energies)) => Moving::Scene(state, energies),
            None => Moving::Whole(&self.cloud),
        }
    }
}

impl<'a> Model<'a> {
    fn open(run: &'a Run, model: ModelName, job: &Job) -> Result<Self> {
        match model {
            ModelName::Lagrangian => {
                Ok(Self::Scene(Box::new(Motion::new(&run.scene, job.edit, job.reversal))))
            }
            ModelName::Source => {
                let none = || format!("the run has no source model: {}", run.folder.root().display());
                run.source()?.with_context(none).map(Self::Source)
            }
        }
    }

    fn at(&mut self, time: f32) -> Shown {
        match self {
            Self::Source(source) => Shown { cloud: source.cloud_at(time), state: None },
            Self::Scene(motion) => {
                let state = motion.state_at(time);
                let objects = 0..motion.scene().objects.len();
                let energies = objects.map(|object| {
                    let fields = motion.fields_at(object, time);
                    [fields.potential, fields.kinetic]
                });
                let energies = energies.collect();
                Shown { cloud: motion.scene().cloud_at(&state, time), state: Some((state, energies)) }
            }
        }
    }
}

/// What is said of each object of a run.
fn notes(run: &Run, trust: &Trust) -> Result<Vec<ObjectNote>> {
    let laws = laws_of(run)?;
    let trusted = |object: usize| match trust {
        Trust::Objects(objects) => objects[object],
        Trust::Source(window) => *window,
    };
    let note = |object: usize| {
        let law = laws.get(object).and_then(Option::as_ref);
        ObjectNote::of(law, trusted(object), object_color(object))
    };
    Ok((0..run.scene.objects.len()).map(note).collect())
}
