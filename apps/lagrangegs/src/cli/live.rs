//! `train --view`: the page of `view`, of a run that is being trained.

use std::net::{IpAddr, Ipv4Addr};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use anyhow::Result;
use lgs_core::Camera;
use lgs_data::dataset::Dataset;
use lgs_model::LagrangianScene;
use lgs_model::source::{SourceModel, load_source};
use lgs_train::checkpoint::Stage;
use lgs_train::{Glance, Onlooker, Progress, RunFolder, TrainConfig};
use lgs_view::{Exhibit, Options, Server, StepSheet, Stopper, Subject};

use super::camera::Orbit;
use super::progress::say;
use super::run::name_of;
use super::view::{distinct, resting, start_cloud};

/// Memory for rollouts of the page, bytes: a snapshot is looked at for a second or two.
const CACHE_BYTES: usize = 256 << 20;
/// Most pages at a time.
const MOST_PAGES: usize = 16;

/// Takes the page's port, before anything else is done, and says where the page will be.
pub(super) fn bind(port: u16) -> Result<Server> {
    let server = Server::bind(Options {
        host: IpAddr::V4(Ipv4Addr::LOCALHOST),
        port,
        token: None,
        cache_bytes: CACHE_BYTES,
        most_pages: MOST_PAGES,
    })?;
    say(&format!("the models can be looked at while they are trained: {}", server.url()));
    Ok(server)
}

/// A run that is trained, as its page shows it. Pages that come early wait until there is something to see.
pub(super) struct Gallery<'a> {
    folder: &'a RunFolder,
    config: &'a TrainConfig,
    background: [f32; 3],
    /// End of the captured window.
    window: f32,
    cameras: Vec<(String, Camera)>,
    hall: Mutex<Hall>,
}

/// What opens with the first snapshot.
struct Hall {
    server: Option<Server>,
    stopper: Stopper,
    exhibit: Option<Arc<Exhibit>>,
    thread: Option<JoinHandle<()>>,
    /// The finished source model.
    source: Option<Arc<dyn SourceModel>>,
    stage: Option<Stage>,
    /// Whether the stage has been shown.
    is_shown: bool,
}

impl<'a> Gallery<'a> {
    pub(super) fn new(
        server: Server,
        folder: &'a RunFolder,
        config: &'a TrainConfig,
        dataset: &Dataset,
    ) -> Self {
        let frames = dataset.split("train").iter();
        let window = frames.clone().map(|frame| frame.time).reduce(f32::max);
        Self {
            folder,
            config,
            window: window.filter(|last| *last > 0.0).unwrap_or(1.0),
            background: dataset.background,
            cameras: distinct(frames.map(|frame| (frame.name.clone(), frame.camera)).collect()),
            hall: Mutex::new(Hall {
                stopper: server.stopper(),
                server: Some(server),
                exhibit: None,
                thread: None,
                source: None,
                stage: None,
                is_shown: false,
            }),
        }
    }

    fn hall(&self) -> MutexGuard<'_, Hall> {
        self.hall.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes note of a step, and waits where a page has paused training.
    pub(super) fn report(&self, progress: &Progress, stop: &AtomicBool) {
        let &Progress { stage, step, steps, loss, psnr, gaussians, .. } = progress;
        if self.hall().stage != Some(stage) {
            self.enter(stage);
        }
        let exhibit = self.hall().exhibit.clone();
        if let Some(exhibit) = exhibit {
            exhibit.report(StepSheet { stage: stage.name(), step, steps, loss, psnr, gaussians });
            exhibit.wait_while_paused(stop);
        }
    }

    /// A stage begins: after the first one there is a source model to compare with.
    fn enter(&self, stage: Stage) {
        let mut hall = self.hall();
        (hall.stage, hall.is_shown) = (Some(stage), false);
        if stage == Stage::Source || hall.source.is_some() {
            return;
        }
        let path = self.folder.source_path(self.config.source.kind);
        let Ok(source) = load_source(&path) else { return };
        let source: Arc<dyn SourceModel> = Arc::from(source);
        hall.source = Some(Arc::clone(&source));
        let begun = Instant::now();
        let subject = self.source_subject(source);
        hall.show(subject, begun);
    }

    /// A source model by itself.
    fn source_subject(&self, source: Arc<dyn SourceModel>) -> Subject {
        let mut scene = resting(&*source, self.background);
        scene.motion.time_window = self.window;
        self.subject(scene, Some(source), false)
    }

    fn subject(
        &self,
        scene: LagrangianScene,
        source: Option<Arc<dyn SourceModel>>,
        has_scene: bool,
    ) -> Subject {
        let views: Vec<Camera> = self.cameras.iter().map(|(_, camera)| *camera).collect();
        let orbit = Orbit::around(&views, &start_cloud(&scene));
        Subject {
            title: name_of(self.folder.root()),
            run: self.folder.root().display().to_string(),
            has_scene,
            source,
            laws: Vec::new(),
            cameras: self.cameras.clone(),
            truth: Vec::new(),
            start: (orbit.at(-60.0), orbit.center()),
            missing: Vec::new(),
            scene,
        }
    }
}

impl Hall {
    /// Shows a subject; the first one opens the page.
    fn show(&mut self, subject: Subject, begun: Instant) {
        if let Some(exhibit) = &self.exhibit {
            exhibit.show(subject, begun);
            return;
        }
        let exhibit = Arc::new(Exhibit::of_training(subject));
        self.exhibit = Some(Arc::clone(&exhibit));
        let Some(server) = self.server.take() else { return };
        self.thread = Some(std::thread::spawn(move || {
            if let Err(error) = server.run(&exhibit) {
                say(&format!("warning: training goes on without its page: {error}"));
            }
        }));
    }
}

impl Onlooker for &Gallery<'_> {
    fn wants(&mut self) -> bool {
        let hall = self.hall();
        !hall.is_shown || hall.exhibit.as_ref().is_none_or(|exhibit| exhibit.wants())
    }

    fn show(&mut self, snapshot: Glance) {
        let begun = Instant::now();
        let subject = match snapshot {
            Glance::Source(source) => self.source_subject(source),
            Glance::Scene(scene) => {
                let source = self.hall().source.clone();
                self.subject(Arc::unwrap_or_clone(scene), source, true)
            }
        };
        let mut hall = self.hall();
        hall.is_shown = true;
        hall.show(subject, begun);
    }
}

impl Drop for Gallery<'_> {
    fn drop(&mut self) {
        let thread = {
            let mut hall = self.hall();
            hall.stopper.stop();
            hall.thread.take()
        };
        thread.into_iter().for_each(|thread| drop(thread.join()));
    }
}
