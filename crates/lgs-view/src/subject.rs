//! What is viewed: the models of a run and the images of its dataset.

use std::sync::Arc;

use lgs_core::{Camera, Image};
use lgs_eval::laws::{ObjectLaw, Shown, Trust};
use lgs_model::LagrangianScene;
use lgs_model::source::SourceModel;

use crate::colors::object_color;
use crate::protocol::{CameraSheet, Hello, Model, ObjectSheet, StartCamera};
use crate::thresholds::NEARLY_UPRIGHT;

/// An image of the dataset.
pub struct TruthImage {
    /// Name of its camera in [`Subject::cameras`].
    pub camera: usize,
    /// Time of the image.
    pub time: f32,
    /// The image over the scene's background; read when it is asked for.
    pub load: Box<dyn Fn() -> Result<Image, String> + Send + Sync>,
}

/// The parts of a run that can be looked at.
pub struct Subject {
    /// Title of the page.
    pub title: String,
    /// The run's folder, as a command line names it.
    pub run: String,
    /// Whether `scene` is a trained one; without it the source model alone is shown.
    pub has_scene: bool,
    /// The Lagrangian scene.
    pub scene: LagrangianScene,
    /// The source model that it was distilled from.
    pub source: Option<Arc<dyn SourceModel>>,
    /// A record for each object of the scene; none where nothing is known.
    pub laws: Vec<Option<ObjectLaw>>,
    /// Cameras with their names.
    pub cameras: Vec<(String, Camera)>,
    /// Images to compare with.
    pub truth: Vec<TruthImage>,
    /// Camera to begin with, and the point that it looks at.
    pub start: (Camera, [f32; 3]),
    /// Parts of the run that are missing, in words.
    pub missing: Vec<String>,
}

impl Subject {
    /// What a page needs to know.
    pub(crate) fn hello(&self, training: bool) -> Hello {
        let (camera, target) = &self.start;
        let (first, last) = self.scene.motion.time_range();
        Hello {
            kind: "hello",
            title: self.title.clone(),
            run: self.run.clone(),
            times: [first, last],
            window: self.scene.motion.time_window,
            background: self.scene.background,
            models: self.models(),
            objects: self.objects(),
            cameras: self.cameras.iter().map(|(name, camera)| sheet(name, camera)).collect(),
            start: StartCamera {
                position: camera.center_in_world(),
                target: *target,
                up: self.up(),
                fov_y: fov_y(camera),
            },
            missing: self.missing.clone(),
            training,
        }
    }

    /// The direction that cameras hold upwards: an axis of the world where it is near to one.
    fn up(&self) -> [f32; 3] {
        let own = |camera: &Camera| -glam::Mat3::from_mat4(camera.camera_from_world).row(1);
        let cameras = self.cameras.iter().map(|(_, camera)| camera).chain([&self.start.0]);
        let Some(mean) = cameras.map(own).sum::<glam::Vec3>().try_normalize() else { return [0.0, 0.0, 1.0] };
        let axes = [glam::Vec3::X, glam::Vec3::Y, glam::Vec3::Z];
        let near = axes.into_iter().find(|axis| mean.dot(*axis).abs() > NEARLY_UPRIGHT);
        near.map_or(mean, |axis| axis * mean.dot(axis).signum()).to_array()
    }

    fn models(&self) -> Vec<Model> {
        let source = self.source.is_some().then_some(Model::Source);
        let truth = (!self.truth.is_empty()).then_some(Model::Truth);
        self.has_scene.then_some(Model::Lagrangian).into_iter().chain(source).chain(truth).collect()
    }

    fn objects(&self) -> Vec<ObjectSheet> {
        let one = |(index, object): (usize, &lgs_model::ObjectModel)| ObjectSheet {
            gaussians: object.members.len(),
            color: object_color(index),
            law: self.laws.get(index).cloned().flatten(),
        };
        self.scene.objects.iter().enumerate().map(one).collect()
    }

    /// Trust in the motion that a model shows, with its objects under edits.
    pub(crate) fn trust(&self, model: Model, shown: &[Shown]) -> Trust {
        let window = f64::from(self.scene.motion.time_window);
        match model {
            Model::Truth => Trust::Objects(Vec::new()),
            Model::Source => Trust::Source([0.0, window]),
            Model::Lagrangian => {
                let law = |index: usize| self.laws.get(index).and_then(Option::as_ref);
                let objects = shown.iter().enumerate().map(|(index, shown)| (law(index), *shown));
                Trust::of_objects(objects, window)
            }
        }
    }

    /// The image of a dataset camera that is nearest to a time.
    pub(crate) fn truth_at(&self, camera: usize, time: f32) -> Option<&TruthImage> {
        let of_camera = self.truth.iter().filter(|image| image.camera == camera);
        of_camera.min_by(|a, b| (a.time - time).abs().total_cmp(&(b.time - time).abs()))
    }
}

fn fov_y(camera: &Camera) -> f32 {
    2.0 * (camera.height as f32 / (2.0 * camera.fy)).atan()
}

fn sheet(name: &str, camera: &Camera) -> CameraSheet {
    let rotation = glam::Quat::from_mat4(&camera.camera_from_world.inverse());
    CameraSheet {
        name: name.to_owned(),
        position: camera.center_in_world(),
        rotation: [rotation.w, rotation.x, rotation.y, rotation.z],
        fov_y: fov_y(camera),
        size: [camera.width, camera.height],
    }
}
