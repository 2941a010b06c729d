//! A recording of a run that is trained.

use std::cell::RefCell;
use std::path::PathBuf;

use lgs_core::{Camera, GaussianCloud};
use lgs_data::dataset::{Dataset, Frame};
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion};
use lgs_train::events::{Event, read_events};
use lgs_train::{Glance, Onlooker, Progress, RunFolder, Stage};

use crate::content::{Content, When};
use crate::error::RerunError;
use crate::picture::Picture;
use crate::recorder::Recorder;
use crate::thresholds::PICTURES_PER_STAGE;

/// Curves of training: entity, name and colour.
const CURVES: [(&str, &str, [f32; 3]); 3] = [
    ("curve/loss", "loss", [0.84, 0.37, 0.0]),
    ("curve/psnr", "PSNR, dB", [0.0, 0.45, 0.7]),
    ("curve/gaussians", "Gaussians", [0.5, 0.5, 0.5]),
];

/// A run that is trained, as a recording shows it on the timeline `step`, which counts the steps of all
/// stages.
///
/// A recording that fails does not end training: [`Self::finish`] returns the error.
pub struct Training {
    /// The training camera of the pictures and the time that they show; none without images.
    view: Option<(Camera, f32)>,
    background: [f32; 3],
    events: PathBuf,
    state: RefCell<State>,
}

struct State {
    recorder: Recorder,
    stage: Option<Stage>,
    /// Steps of the stages before.
    before: usize,
    /// Steps of the stage: done, and in all.
    steps: [usize; 2],
    /// The picture of the stage that is due next, counted from 0.
    next_picture: usize,
}

impl Training {
    /// Begins with what stays: the training cameras, and the image that the pictures are to resemble.
    #[must_use]
    pub fn new(mut recorder: Recorder, folder: &RunFolder, dataset: &Dataset) -> Self {
        for frame in dataset.cameras("train") {
            let entity = format!("world/cameras/{}", frame.name);
            recorder.log(&entity, When::Always, &Content::Camera(&frame.camera));
        }
        let frame = middle_frame(dataset.split("train"));
        if let Some(frame) = frame {
            let truth = Picture::of(&frame.composited(dataset.background));
            recorder.log("world/view", When::Always, &Content::Camera(&frame.camera));
            recorder.log("truth", When::Always, &Content::Picture(&truth));
        }
        for (entity, name, color) in CURVES {
            recorder.log(entity, When::Always, &Content::Curve(name, color));
        }
        recorder.flush();
        Self {
            view: frame.map(|frame| (frame.camera, frame.time)),
            background: dataset.background,
            events: folder.events_path(),
            state: RefCell::new(State { recorder, stage: None, before: 0, steps: [0; 2], next_picture: 0 }),
        }
    }

    /// Takes note of a step; the first one of a resumed run brings the curve up to it.
    pub fn report(&self, progress: &Progress) {
        let mut state = self.state.borrow_mut();
        if state.stage.is_none() {
            // A curve that cannot be read is no reason to stop training.
            state.recall(&read_events(&self.events).unwrap_or_default(), progress);
        }
        if state.stage != Some(progress.stage) {
            state.enter(progress.stage);
        }
        // Stage 1 has steps of another kind; the timeline leaves them out.
        if progress.stage == Stage::Distill {
            return;
        }
        state.steps = [progress.step, progress.steps];
        if progress.is_on_curve() {
            state.point(&Event::of(progress));
        }
    }

    /// Why recording stopped, if it did.
    #[must_use]
    pub fn failure(&self) -> Option<String> {
        self.state.borrow().recorder.failure().map(ToString::to_string)
    }

    /// Ends the recording; returns its size in bytes.
    ///
    /// # Errors
    /// If it could not be written, now or earlier.
    pub fn finish(self) -> Result<u64, RerunError> {
        self.state.into_inner().recorder.finish()
    }

    fn gaussians(&self, glance: &Glance) -> GaussianCloud {
        let time = self.view.map_or(0.0, |(_, time)| time);
        match glance {
            Glance::Source(source) => source.cloud_at(time),
            Glance::Scene(scene) => cloud_of(scene, time),
        }
    }
}

impl Onlooker for &Training {
    fn wants(&mut self) -> bool {
        let state = self.state.borrow();
        let [done, all] = state.steps;
        state.recorder.failure().is_none() && done * PICTURES_PER_STAGE >= state.next_picture * all.max(1)
    }

    fn show(&mut self, snapshot: Glance) {
        let cloud = self.gaussians(&snapshot);
        let picture = self
            .view
            .map(|(camera, _)| Picture::of(&lgs_eval::render(&cloud, &camera, self.background).image));
        let mut state = self.state.borrow_mut();
        let [done, all] = state.steps;
        state.next_picture = done * PICTURES_PER_STAGE / all.max(1) + 1;
        let now = When::Step(state.before + done);
        state.recorder.log("world/gaussians", now, &Content::Gaussians(&cloud));
        if let Some(picture) = &picture {
            state.recorder.log("world/view", now, &Content::Picture(picture));
        }
        state.recorder.flush();
    }
}

impl State {
    /// The curve of an earlier session, up to a step that was taken now.
    fn recall(&mut self, events: &[Event], now: &Progress) {
        let stages = Stage::ALL.into_iter().filter(|stage| *stage <= now.stage);
        for stage in stages {
            let is_own = |event: &&Event| event.stage == stage.name();
            let is_past = |event: &&Event| stage < now.stage || event.step < now.step;
            for event in events.iter().filter(is_own).filter(is_past) {
                if self.stage != Some(stage) {
                    self.enter(stage);
                }
                self.steps = [event.step; 2];
                self.point(event);
            }
        }
    }

    fn enter(&mut self, stage: Stage) {
        self.before += self.steps[0];
        (self.stage, self.steps, self.next_picture) = (Some(stage), [0; 2], 0);
        self.recorder.log("stage", When::Step(self.before), &Content::Line(stage.name()));
    }

    /// A point of the training curve.
    fn point(&mut self, event: &Event) {
        let now = When::Step(self.before + event.step);
        let psnr = event.psnr.map(f64::from);
        let values = [Some(f64::from(event.loss)), psnr, Some(event.gaussians as f64)];
        for ((entity, ..), value) in CURVES.iter().zip(values) {
            if let Some(value) = value {
                self.recorder.log(entity, now, &Content::Number(value));
            }
        }
    }
}

fn cloud_of(scene: &LagrangianScene, time: f32) -> GaussianCloud {
    scene.cloud_at(&Motion::new(scene, Edit::default(), Reversal::default()).state_at(time), time)
}

/// The frame nearest to the middle of the times, where what moves has moved.
fn middle_frame(frames: &[Frame]) -> Option<&Frame> {
    let times = frames.iter().map(|frame| frame.time);
    let [first, last] = times.fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], t| [a.min(t), b.max(t)]);
    let from_middle = |frame: &Frame| (frame.time - 0.5 * (first + last)).abs();
    frames.iter().min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)))
}
