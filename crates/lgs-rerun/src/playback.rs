//! A recording of the motion of a trained model.

use std::path::Path;

use lgs_core::linear::{quat_mul, quat_normalize};
use lgs_core::{Camera, GaussianCloud};
use lgs_model::{LagrangianScene, SceneState};

use crate::Recording;
use crate::content::{Content, When};
use crate::error::RerunError;
use crate::note::ObjectNote;
use crate::picture::Picture;
use crate::thresholds::PATHS_PER_OBJECT;

/// A moment of the motion.
#[derive(Debug)]
pub struct Moment<'a> {
    /// Time of the scene.
    pub time: f32,
    /// The Gaussians.
    pub moving: Moving<'a>,
    /// The camera of the picture.
    pub camera: &'a Camera,
    /// The Gaussians as the camera sees them.
    pub picture: &'a Picture,
    /// Whether the motion of each object is trusted at the time; of a source model's, one value for all.
    pub trusted: &'a [bool],
}

/// Gaussians at a moment.
#[derive(Debug)]
pub enum Moving<'a> {
    /// Those of a scene: the state of its dynamic ones, and potential and kinetic energy of each object.
    Scene(&'a SceneState, &'a [[f64; 2]]),
    /// Those of a model that knows no objects.
    Whole(&'a GaussianCloud),
}

/// The motion of a trained model, as a recording shows it on the timeline `time`.
pub struct Playback<'a> {
    recording: Recording,
    scene: &'a LagrangianScene,
    notes: Vec<ObjectNote>,
    /// Times so far, each with the places of the Gaussians that draw the paths.
    paths: Vec<(f32, Vec<[f32; 3]>)>,
}

impl<'a> Playback<'a> {
    /// Begins a recording, see [`Recording::begin`].
    ///
    /// # Errors
    /// If it cannot be begun.
    pub fn begin(
        path: &Path,
        (title, about): (&str, &[u8]),
        scene: &'a LagrangianScene,
    ) -> Result<Self, RerunError> {
        let recording = Recording::begin(path, title, about)?;
        Ok(Self { recording, scene, notes: Vec::new(), paths: Vec::new() })
    }

    /// Records the cameras of the dataset.
    ///
    /// # Errors
    /// If the recording cannot be written.
    pub fn cameras(&mut self, cameras: &[(String, Camera)]) -> Result<(), RerunError> {
        for (name, camera) in cameras {
            let entity = format!("world/cameras/{name}");
            self.recording.log(&entity, When::Always, &Content::Camera(camera))?;
        }
        Ok(())
    }

    /// Records what stays of the scene: its static Gaussians, and of each object the Gaussians' looks, its
    /// law and the names of its curves.
    ///
    /// # Errors
    /// If the recording cannot be written.
    pub fn objects(&mut self, notes: Vec<ObjectNote>) -> Result<(), RerunError> {
        let fixed = &self.scene.static_gaussians;
        if !fixed.is_empty() {
            self.always("world/static", &Content::Looks(fixed))?;
            self.always("world/static", &Content::Poses(&fixed.means, &fixed.rotations))?;
        }
        for (index, (object, note)) in self.scene.objects.iter().zip(&notes).enumerate() {
            let rows: Vec<usize> = object.members.clone().collect();
            let looks = self.scene.dynamic_gaussians.select(&rows);
            let name = format!("object {index}");
            let world = |part: &str| format!("world/objects/{index}/{part}");
            let about = |part: &str| format!("objects/{index}/{part}");
            let curve = |what: &str| format!("{name}: {what}");
            let contents = [
                (world("gaussians"), Content::Looks(&looks)),
                (world("center"), Content::Label(&name, note.color)),
                (about("law"), Content::Page(&note.text)),
                (about("potential_energy"), Content::Curve(&curve("potential energy"), note.color)),
                (about("kinetic_energy"), Content::Curve(&curve("kinetic energy"), pale(note.color))),
                (about("trusted"), Content::Curve(&curve("trusted"), note.color)),
            ];
            for (entity, content) in contents {
                self.recording.log(&entity, When::Always, &content)?;
            }
        }
        self.notes = notes;
        Ok(())
    }

    /// Records a moment.
    ///
    /// # Errors
    /// If the recording cannot be written.
    pub fn moment(&mut self, moment: &Moment<'_>) -> Result<(), RerunError> {
        let now = When::Time(moment.time);
        self.recording.log("world/view", now, &Content::Camera(moment.camera))?;
        self.recording.log("world/view", now, &Content::Picture(moment.picture))?;
        match moment.moving {
            Moving::Scene(state, energies) => self.state(now, state, energies)?,
            Moving::Whole(cloud) => self.recording.log("world/gaussians", now, &Content::Gaussians(cloud))?,
        }
        for (object, &trusted) in moment.trusted.iter().enumerate() {
            let entity = match moment.moving {
                Moving::Scene(..) => format!("objects/{object}/trusted"),
                Moving::Whole(_) => "trusted".to_owned(),
            };
            self.recording.log(&entity, now, &Content::Number(f64::from(u8::from(trusted))))?;
        }
        if let Moving::Scene(state, _) = moment.moving {
            self.paths.push((moment.time, self.path_rows().map(|row| state.q[row]).collect()));
        }
        Ok(())
    }

    /// Ends the recording with the paths of the moments; returns its size in bytes.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<u64, RerunError> {
        self.paths.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut first = 0;
        for index in 0..self.notes.len() {
            let count = self.rows_of(index).count();
            let path = |column: usize| self.paths.iter().map(|(_, places)| places[column]).collect();
            let paths: Vec<Vec<[f32; 3]>> = (first..first + count).map(path).collect();
            let entity = format!("world/objects/{index}/paths");
            if self.paths.len() > 1 {
                self.recording.log(
                    &entity,
                    When::Always,
                    &Content::Paths(&paths, self.notes[index].color),
                )?;
            }
            first += count;
        }
        self.recording.finish()
    }

    fn always(&mut self, entity: &str, content: &Content<'_>) -> Result<(), RerunError> {
        self.recording.log(entity, When::Always, content)
    }

    /// The dynamic Gaussians in a state, with the marks of each object.
    fn state(&mut self, now: When, state: &SceneState, energies: &[[f64; 2]]) -> Result<(), RerunError> {
        let scene = self.scene;
        for (index, object) in scene.objects.iter().enumerate() {
            let members = object.members.clone();
            let turned = |row: usize| {
                let own = quat_normalize(scene.dynamic_gaussians.rotations[row]);
                quat_mul(state.rotation[row], own)
            };
            let rotations: Vec<[f32; 4]> = members.clone().map(turned).collect();
            let world = |part: &str| format!("world/objects/{index}/{part}");
            let poses = Content::Poses(&state.q[members.clone()], &rotations);
            self.recording.log(&world("gaussians"), now, &poses)?;
            let center = mean(&state.q[members.clone()]);
            self.recording.log(&world("center"), now, &Content::Place(center))?;
            let color = self.notes.get(index).map_or([1.0; 3], |note| note.color);
            let velocity = Content::Arrow(center, mean(&state.v[members]), color);
            self.recording.log(&world("velocity"), now, &velocity)?;
            if let Some([potential, kinetic]) = energies.get(index) {
                let about = |part: &str| format!("objects/{index}/{part}");
                self.recording.log(&about("potential_energy"), now, &Content::Number(*potential))?;
                self.recording.log(&about("kinetic_energy"), now, &Content::Number(*kinetic))?;
            }
        }
        Ok(())
    }

    /// The Gaussians that draw the paths of all objects.
    fn path_rows(&self) -> impl Iterator<Item = usize> {
        (0..self.scene.objects.len()).flat_map(|index| self.rows_of(index))
    }

    fn rows_of(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let members = self.scene.objects[index].members.clone();
        let step = members.len().div_ceil(PATHS_PER_OBJECT).max(1);
        members.step_by(step)
    }
}

fn mean(points: &[[f32; 3]]) -> [f32; 3] {
    let n = points.len().max(1) as f32;
    std::array::from_fn(|axis| points.iter().map(|point| point[axis]).sum::<f32>() / n)
}

/// A colour half way to white.
fn pale(color: [f32; 3]) -> [f32; 3] {
    color.map(|channel| 0.5 * (1.0 + channel))
}
