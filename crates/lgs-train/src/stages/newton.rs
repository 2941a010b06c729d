//! Gauss–Newton on the images (method §6): where every object starts, how, and the constants of its law.
//!
//! These unknowns are few, but images bind them together: within a captured window, more gravity looks nearly
//! like another start. First-order steps wander in such a valley; least squares go to its ground. The images
//! of a time determine a body's pose there ([`observe`]), and the derivatives of the pose by the unknowns
//! ([`Body::responses`]) bring all times together. What no image determines, such as the stiffness that keeps
//! a rotor's blades on their circles, stays where stage 1 found it by the trajectories that it followed.

mod in_view;

use lgs_core::linear::{norm, sub};
use lgs_core::{Camera, GaussianCloud, median, stream};
use lgs_data::dataset::Frame;
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion, TensorFile, TensorFileError};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::body::{Body, Positions, Response, Responses, part_of};
use super::displacement::Pose;
use super::normal_equations::NormalEquations;
use super::observation::{Changes, Normal, Observation, observe, squared_error};
use super::thresholds::{
    CORRELATED_VALUES, PRIOR_DEVIATION, ROLLED_PARTICLES, STEP_FRACTIONS, TRAJECTORY_DEVIATION,
};
use crate::figures::StepReport;

/// Changes of all objects' unknowns, in search of those that make the images come out best.
pub(super) struct Newton {
    bodies: Vec<Body>,
    /// Some particles of every object.
    parts: Vec<LagrangianScene>,
    /// Of every object, since the fit began.
    changes: Vec<Vec<f64>>,
}

impl Newton {
    /// No changes of a scene.
    pub(super) fn new(scene: &LagrangianScene, seed: u64) -> Self {
        let objects = 0..scene.objects.len();
        let bodies: Vec<Body> = objects.clone().map(|object| Body::new(scene, object)).collect();
        let part =
            |object| part_of(scene, object, ROLLED_PARTICLES, &mut stream(seed, "newton", object as u64));
        let changes = bodies.iter().map(|body| vec![0.0; body.unknowns()]).collect();
        Self { bodies, parts: objects.map(part).collect(), changes }
    }

    /// Whether no object has an unknown.
    pub(super) fn is_empty(&self) -> bool {
        self.changes.iter().all(Vec::is_empty)
    }

    /// Adds the changes to a checkpoint.
    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        for (object, change) in self.changes.iter().enumerate() {
            let values: Vec<f32> = change.iter().map(|&x| x as f32).collect();
            file.insert(name_of(object), &[values.len()], &values);
        }
    }

    /// Reads the changes of a checkpoint.
    pub(super) fn restore(&mut self, file: &TensorFile) -> Result<(), TensorFileError> {
        for (object, change) in self.changes.iter_mut().enumerate() {
            let (_, values) = file.values(&name_of(object))?;
            if values.len() != change.len() {
                return Err(file.field(
                    &name_of(object),
                    &format!("{} values", change.len()),
                    values.len().to_string(),
                ));
            }
            *change = values.iter().map(|&x| f64::from(x)).collect();
        }
        Ok(())
    }

    /// The scene with the changes found so far.
    pub(super) fn applied_to(&self, scene: &LagrangianScene) -> LagrangianScene {
        self.changed(scene, &self.changes)
    }

    fn changed(&self, scene: &LagrangianScene, changes: &[Vec<f64>]) -> LagrangianScene {
        let mut changed = scene.clone();
        let all = self.bodies.iter().zip(changes).enumerate();
        all.for_each(|(object, (body, change))| body.change(change, &mut changed, object));
        changed
    }

    /// One step of Gauss–Newton on all objects, a smaller one or none if it does not better the images. Tells
    /// how these were before.
    pub(super) fn step(&mut self, scene: &LagrangianScene, frames: &[&Frame]) -> StepReport {
        let _span = tracing::trace_span!("newton").entered();
        let observed = self.observed(scene, frames);
        let before: f64 = observed.observations.iter().map(|o| o.squared_error).sum();
        let steps: Vec<Vec<f64>> = (0..self.bodies.len())
            .map(|object| self.equations(object, &observed).solution(&self.changes[object]))
            .collect();
        let error =
            |changes: &Vec<Vec<f64>>| error_of(&self.changed(scene, changes), frames, &observed.times);
        let better = STEP_FRACTIONS
            .iter()
            .map(|&part| self.moved(&steps, part))
            .filter(|changes| !self.is_empty() && self.keeps_in_view(changes, &observed))
            .find(|changes| error(changes) < before);
        tracing::debug!(?steps, accepted = better.is_some(), "Gauss–Newton");
        if let Some(changes) = better {
            self.changes = changes;
        }
        let loss = observed.observations.iter().map(|o| o.loss).sum::<f32>() / frames.len().max(1) as f32;
        StepReport::known(loss, observed.mse)
    }

    /// By how much the unknowns of each object, in their units, change when one group of frames is left out:
    /// by object and group. `group_of_frame` numbers the groups from 0 up.
    pub(super) fn without_each(
        &self,
        scene: &LagrangianScene,
        frames: &[&Frame],
        group_of_frame: &[usize],
    ) -> Vec<Vec<Vec<f64>>> {
        let observed = self.observed(scene, frames);
        let groups = group_of_frame.iter().max().map_or(0, |last| last + 1);
        let of_object = |object: usize| {
            let all = self.equations(object, &observed);
            let with = all.solution(&self.changes[object]);
            let of_group = |group: usize| -> Vec<f64> {
                let own = self.evidence(object, &observed, &|frame| group_of_frame[frame] == group);
                let without = all.without(&own, observed.weight()).solution(&self.changes[object]);
                without.iter().zip(&with).map(|(without, with)| without - with).collect()
            };
            (0..groups).map(of_group).collect()
        };
        (0..self.bodies.len()).map(of_object).collect()
    }

    /// Positions of some particles of an object at some times, by time, after a change of its unknowns from
    /// where they are; none for an object without a law in generalised coordinates.
    pub(super) fn positions(&self, object: usize, by: &[f64], times: &[f32]) -> Positions {
        let change: Vec<f64> = self.changes[object].iter().zip(by).map(|(x, dx)| x + dx).collect();
        self.bodies[object].positions(&self.parts[object], &change, times)
    }

    /// The images of a scene as they are drawn now, and what they depend on.
    fn observed<'a>(&self, scene: &LagrangianScene, frames: &'a [&'a Frame]) -> Observed<'a> {
        let times = Times::of(frames);
        let responses = self.responses(&times);
        let observations = self.observations(scene, frames, &times, &responses);
        let squared: f64 = observations.iter().map(|o| o.squared_error).sum();
        let values: f64 = frames.iter().map(|frame| 3.0 * frame.pixels.counted() as f64).sum();
        Observed { frames, times, responses, observations, mse: squared / values }
    }

    /// The normal equations of one object's unknowns.
    fn equations(&self, object: usize, observed: &Observed<'_>) -> NormalEquations {
        let first = |frame: &Frame| observed.responses[object][observed.times.index(frame)].first();
        let size = |frame: &&Frame| Some(pixel_at(&frame.camera, first(frame)?.center));
        let pixels = observed.frames.iter().filter_map(size);
        let pixel = median(pixels).unwrap_or(0.0).max(f64::MIN_POSITIVE);
        let trajectories = tracing::trace_span!("trajectories").in_scope(|| {
            self.bodies[object].information_of_trajectories(&self.parts[object], &observed.times.0)
        });
        let weight = 1.0 / (TRAJECTORY_DEVIATION * pixel).powi(2);
        let unknowns = self.bodies[object].unknowns();
        let stiffness = DMatrix::from_fn(unknowns, unknowns, |i, j| {
            let prior = if i == j { PRIOR_DEVIATION.powi(-2) } else { 0.0 };
            weight * trajectories[i * unknowns + j] + prior
        });
        NormalEquations::new(stiffness, &self.evidence(object, observed, &|_| true), observed.weight())
    }

    /// What some frames, told by their index, show of the parts of an object, with the parts' responses.
    fn evidence<'a>(
        &self,
        object: usize,
        observed: &'a Observed<'_>,
        is_wanted: &dyn Fn(usize) -> bool,
    ) -> Vec<(&'a Response, &'a Normal)> {
        let first: usize = self.bodies[..object].iter().map(|body| body.radii().len()).sum();
        let responses = |frame: &Frame| &observed.responses[object][observed.times.index(frame)];
        let wanted =
            (observed.frames.iter().zip(&observed.observations).enumerate()).filter(|(i, _)| is_wanted(*i));
        wanted.flat_map(|(_, (frame, o))| responses(frame).iter().zip(&o.normals[first..])).collect()
    }

    /// Poses and their derivatives, by object.
    fn responses(&self, times: &Times) -> Vec<Responses> {
        let _span = tracing::trace_span!("responses").entered();
        let all = self.bodies.iter().zip(&self.parts).zip(&self.changes);
        all.map(|((body, part), change)| body.responses(part, change, &times.0)).collect()
    }

    /// The observations of all objects, by frame.
    fn observations(
        &self,
        scene: &LagrangianScene,
        frames: &[&Frame],
        times: &Times,
        responses: &[Responses],
    ) -> Vec<Observation> {
        let clouds = clouds_at(&self.applied_to(scene), times);
        let _span = tracing::trace_span!("observations").entered();
        let of_frame = |frame: &&Frame| {
            let at = times.index(frame);
            let pose = |object: usize| {
                let parts = scene.objects[object].bodies().into_iter();
                let parts = parts.zip(&responses[object][at]).zip(self.bodies[object].radii());
                let first = scene.static_gaussians.len();
                parts.map(move |((rows, response), radius)| Pose {
                    rows: first + rows.start..first + rows.end,
                    center: response.center,
                    radius,
                    deforms: self.bodies[object].deforms(),
                })
            };
            let poses: Vec<Pose> = (0..self.bodies.len()).flat_map(pose).collect();
            observe(frame, &clouds[at], &poses, scene.background, Changes::Differences)
        };
        frames.par_iter().map(of_frame).collect()
    }

    /// The changes after a part of the steps, as a checkpoint holds them.
    fn moved(&self, steps: &[Vec<f64>], part: f64) -> Vec<Vec<f64>> {
        let moved = |(x, dx): (&f64, &f64)| f64::from((x + part * dx) as f32);
        self.changes
            .iter()
            .zip(steps)
            .map(|(change, step)| change.iter().zip(step).map(moved).collect())
            .collect()
    }
}

/// Frames with their observations, and the responses of all objects at their times.
struct Observed<'a> {
    frames: &'a [&'a Frame],
    times: Times,
    /// By object.
    responses: Vec<Responses>,
    observations: Vec<Observation>,
    /// Mean squared error over all values of all frames.
    mse: f64,
}

impl Observed<'_> {
    /// Weight of a unit of squared error of the images.
    fn weight(&self) -> f64 {
        1.0 / (CORRELATED_VALUES * self.mse)
    }
}

/// The distinct times of frames, ascending.
struct Times(Vec<f32>);

impl Times {
    fn of(frames: &[&Frame]) -> Self {
        let mut times: Vec<f32> = frames.iter().map(|frame| frame.time.max(0.0)).collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        Self(times)
    }

    fn index(&self, frame: &Frame) -> usize {
        self.0.partition_point(|&t| t < frame.time.max(0.0))
    }
}

/// Sum of squared errors of a scene over frames.
pub(super) fn squared_error_of(scene: &LagrangianScene, frames: &[&Frame]) -> f64 {
    error_of(scene, frames, &Times::of(frames))
}

/// The same at the times of the frames.
fn error_of(scene: &LagrangianScene, frames: &[&Frame], times: &Times) -> f64 {
    let clouds = clouds_at(scene, times);
    let _span = tracing::trace_span!("errors").entered();
    let errors: Vec<f64> = frames
        .par_iter()
        .map(|frame| squared_error(frame, &clouds[times.index(frame)], scene.background))
        .collect();
    errors.iter().sum()
}

fn clouds_at(scene: &LagrangianScene, times: &Times) -> Vec<GaussianCloud> {
    let _span = tracing::trace_span!("roll the motion").entered();
    let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
    times.0.iter().map(|&t| scene.cloud_at(&motion.state_at(t), t)).collect()
}

/// What a pixel spans at a point, world units.
fn pixel_at(camera: &Camera, point: [f32; 3]) -> f64 {
    f64::from(norm(sub(point, camera.center_in_world())) / camera.fx)
}

/// Name of an object's changes in a checkpoint.
fn name_of(object: usize) -> String {
    format!("tune.newton.{object}")
}
