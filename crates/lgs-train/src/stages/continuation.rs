//! What carries on the motion of an object that no law describes, beyond its recording (method §5.4).
//!
//! The dynamics that stage 1 left such an object with have not been able to follow its tracks, and may bring
//! it anywhere in the time to come. They carry it on only if they forecast the end of its own tracks better
//! than free motion and rest do, and keep it about where it has been.

use lgs_core::GaussianCloud;
use lgs_distill::{DistillConfig, MOST_REACH};
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{Continuation, LagrangianScene, Motion, MotionConfig, ObjectModel, Recording};

use super::initial_pose::mean;

/// What an object is judged by, beside itself.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    /// Starting velocities of its particles.
    pub(super) velocities: &'a [[f32; 3]],
    pub(super) motion: MotionConfig,
    /// Position error of its dynamics at held-out samples, if stage 1 measured it.
    pub(super) forecast_error: Option<f64>,
    /// Says how many samples are held out.
    pub(super) config: &'a DistillConfig,
}

/// An object with what carries its recording on; the same where it has none.
pub(super) fn carried_on(mut object: ObjectModel, known: Known<'_>) -> ObjectModel {
    if let Some(recording) = object.recording.take() {
        let continuation = RecordedObject { object: &object, recording: &recording, known }.continuation();
        object.recording = Some(recording.continued_by(continuation.unwrap_or_default()));
    }
    object
}

/// A recorded object by itself.
struct RecordedObject<'a> {
    object: &'a ObjectModel,
    recording: &'a Recording,
    known: Known<'a>,
}

impl RecordedObject<'_> {
    /// What forecasts the end of the tracks best; of equals the first. Nothing for a recording of two times.
    fn continuation(&self) -> Option<Continuation> {
        let (recording, samples) = (self.recording, self.recording.times().len());
        let beginning = recording.beginning(samples - self.known.config.held_out_samples(samples))?;
        let error =
            |continuation| error(&self.scene(beginning.clone().continued_by(continuation)), recording);
        let own = if self.stays() { error(Continuation::Dynamics) } else { f64::INFINITY };
        let own = own.max(self.known.forecast_error.unwrap_or(0.0));
        let [free, rest] = [Continuation::Free, Continuation::Rest].map(error);
        tracing::debug!(own, free, rest, "errors of what may carry a recording on");
        let of_all = [(own, Continuation::Dynamics), (free, Continuation::Free), (rest, Continuation::Rest)];
        of_all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, best)| best)
    }

    /// The object by itself with a recording.
    fn scene(&self, recording: Recording) -> LagrangianScene {
        let means = recording.start().to_vec();
        let members = 0..means.len();
        LagrangianScene {
            dynamic_gaussians: GaussianCloud::isotropic(means, 1.0, [0.5; 3], 0.5),
            velocities: self.known.velocities.to_vec(),
            objects: vec![ObjectModel {
                members,
                dynamics: self.object.dynamics.clone(),
                recording: Some(recording),
            }],
            ..LagrangianScene::still(GaussianCloud::default(), self.known.motion, [0.0; 3])
        }
    }

    /// Whether the dynamics keep every particle, up to the last time that a scene is asked for, within
    /// [`MOST_REACH`] of the reach that the object has in its recording.
    fn stays(&self) -> bool {
        let recording = self.recording;
        let scene = self.scene(recording.clone().continued_by(Continuation::Dynamics));
        let seen = || recording.positions().iter().flatten().copied();
        let center = mean(&seen().collect::<Vec<_>>());
        let reach = seen().map(|p| square(p, center)).fold(0.0, f64::max);
        let steps = (scene.motion.time_range().1 / scene.motion.dt).floor() as usize;
        let mut motion = Motion::new(&scene, Edit::default(), Reversal::default());
        let mut later = motion.states(steps).iter().flat_map(|state| &state.q);
        later.all(|&q| square(q, center) <= MOST_REACH * MOST_REACH * reach)
    }
}

/// Root mean square error of a scene's positions at the times of a recording after the one that it has.
fn error(scene: &LagrangianScene, recording: &Recording) -> f64 {
    let begun = scene.objects[0].recording.as_ref().map_or(0, |beginning| beginning.times().len());
    let held_out = begun..recording.times().len();
    let count = held_out.len() * scene.dynamic_gaussians.len();
    let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
    let of_sample = |sample: usize| {
        let found = motion.state_at(recording.times()[sample]).q;
        found.iter().zip(&recording.positions()[sample]).map(|(&a, &b)| square(a, b)).sum::<f64>()
    };
    (held_out.map(of_sample).sum::<f64>() / count as f64).sqrt()
}

fn square(a: [f32; 3], b: [f32; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::Law;
    use lgs_mechanics::bands;
    use lgs_mechanics::coordinates::{Bodies, Coordinates, Port, State};
    use lgs_mechanics::terms::Term;
    use lgs_model::{Dynamics, GeneralisedDynamics};
    use std::f64::consts::TAU;

    /// What carries on an object of two particles that moves along x by `place`, with a spring of such a
    /// frequency about the origin for a law.
    fn chosen(place: impl Fn(f64) -> f64, frequency: f64) -> Continuation {
        let times: Vec<f32> = (0..=20).map(|i| i as f32 / 20.0).collect();
        let at = |time: f32| {
            let x = place(f64::from(time)) as f32;
            vec![[x, 0.0, 0.0], [x, 0.2, 0.0]]
        };
        let positions = times.iter().map(|&time| at(time)).collect();
        let rotations = vec![vec![[1.0, 0.0, 0.0, 0.0]; 2]; times.len()];
        let spring = Term::named("spring", Port::Whole).expect("a term");
        let values = vec![(TAU * frequency).powi(2), 0.0, 0.0, 0.0];
        let law = Law::new(Coordinates::Point, vec![spring], values, 0.01).expect("a law");
        let velocity = (place(1e-4) - place(0.0)) / 1e-4;
        let start = State { x: vec![place(0.0), 0.0, 0.0], v: vec![velocity, 0.0, 0.0] };
        let dynamics =
            GeneralisedDynamics { law, bodies: Bodies::default(), start, known: bands::Known::default() };
        let object = ObjectModel {
            members: 0..2,
            dynamics: Dynamics::Generalised(dynamics),
            recording: Recording::new(times, positions, rotations),
        };
        let motion = MotionConfig { dt: 0.05, time_window: 1.0 };
        let velocities = &[[velocity as f32, 0.0, 0.0]; 2];
        let config = &DistillConfig::default();
        let carried_on = carried_on(object, Known { velocities, motion, forecast_error: None, config });
        carried_on.recording.expect("a recording").continuation()
    }

    #[test]
    fn tracks_go_on_by_what_forecasts_their_end() {
        let swing = |t: f64| (TAU * 1.3 * t).sin();
        assert_eq!(chosen(swing, 1.3), Continuation::Dynamics, "a law that is right");
        assert_eq!(chosen(|t| 0.6 * t, 1.3), Continuation::Free, "a spring that nothing follows");
        let flicker = |t: f64| 0.05 * (TAU * 6.0 * t).sin();
        assert_eq!(chosen(flicker, 0.0), Continuation::Rest, "what goes nowhere");
        assert_eq!(chosen(|t| 0.6 * t, 0.0), Continuation::Free, "free motion needs no law");
    }
}
