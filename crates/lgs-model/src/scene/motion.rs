//! Rollouts of a scene with their states kept, so that a sweep over times costs one rollout.

use std::borrow::Cow;
use std::ops::Range;

use burn::tensor::Device;
use lgs_dynamics::tensor::processor;
use lgs_dynamics::{Edit, Reversal, RolloutSpec, State};
use lgs_mechanics::Law;

use super::contact::EditedLaws;
use super::dynamics::{Dynamics, GeneralisedDynamics, ObjectFields, Stretch};
use super::recording::Recording;
use super::{LagrangianScene, ObjectModel};

/// Positions, velocities and accumulated rotations of all dynamic Gaussians at one time; rows as in the
/// scene.
pub type SceneState = State;

/// How many steps a cache grows by at a time.
const CHUNK_STEPS: usize = 25;

/// The motion of a scene under an edit: states on the step grid, computed when first asked for and kept.
pub struct Motion<'a> {
    scene: Cow<'a, LagrangianScene>,
    /// One for each object.
    edits: Vec<Edit>,
    laws: EditedLaws,
    reversal: Reversal,
    /// Where particles are rolled forwards.
    device: Device,
    forward: Vec<SceneState>,
    backward: Vec<SceneState>,
}

impl<'a> Motion<'a> {
    /// The motion of `scene` with scaled velocity, potential and force (α, β, γ); `reversal` is used for
    /// negative times. The scales mean the velocity at t = 0, see [`LagrangianScene::start_velocities`].
    #[must_use]
    pub fn new(scene: &'a LagrangianScene, edit: Edit, reversal: Reversal) -> Self {
        let edits = vec![edit; scene.objects.len()];
        Self::of(Cow::Borrowed(scene), edits, reversal)
    }

    fn of(scene: Cow<'a, LagrangianScene>, edits: Vec<Edit>, reversal: Reversal) -> Self {
        assert_eq!(edits.len(), scene.objects.len(), "edits of the objects");
        let velocities = scene.start_velocities_of(&edits);
        let start = SceneState::at_start(scene.dynamic_gaussians.means.clone(), velocities);
        let laws = EditedLaws::new(&scene, &edits);
        let (forward, backward) = (vec![start.clone()], vec![start]);
        Self { scene, edits, laws, reversal, device: processor(), forward, backward }
    }

    /// The same, with particles that are rolled forwards by a device.
    #[must_use]
    pub fn on(self, device: &Device) -> Self {
        Self { device: device.clone(), ..self }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &LagrangianScene {
        &self.scene
    }

    /// The state at time `t`: full steps of `dt`, then one shortened step to a time off the grid (method
    /// §4.3).
    #[must_use]
    pub fn state_at(&mut self, t: f32) -> SceneState {
        let until = RolloutSpec::until(t.abs(), self.scene.motion.dt);
        let direction = Direction::of(t);
        self.laws.follow(&self.scene, &self.edits, f64::from(t));
        self.extend(until.steps, direction);
        let state = &self.states_of(direction)[until.steps];
        let from = self.grid_time(until.steps, direction);
        let rest =
            until.last_dt.and_then(|rest| self.advance(state, self.stretch(from, rest, 1, direction)).pop());
        rest.unwrap_or_else(|| state.clone())
    }

    /// Numbers of steps that are kept, backwards and forwards in time.
    #[must_use]
    pub fn kept_steps(&self) -> [usize; 2] {
        [self.backward.len() - 1, self.forward.len() - 1]
    }

    /// States on the grid of steps from 0 to `steps · dt`.
    pub fn states(&mut self, steps: usize) -> &[SceneState] {
        self.extend(steps, Direction::Forward);
        &self.forward[..=steps]
    }

    /// States on the grid of steps from 0 back to `−steps · dt`.
    pub fn past_states(&mut self, steps: usize) -> &[SceneState] {
        self.extend(steps, Direction::Backward);
        &self.backward[..=steps]
    }

    /// Energies and accelerations of an object's particles after a number of full steps from t = 0, where
    /// the edit has brought them but without its scales.
    #[must_use]
    pub fn fields(&mut self, object: usize, steps: usize) -> ObjectFields {
        self.extend(steps, Direction::Forward);
        self.fields_of(object, &self.forward[steps], self.grid_time(steps, Direction::Forward))
    }

    /// The same at any time.
    #[must_use]
    pub fn fields_at(&mut self, object: usize, time: f32) -> ObjectFields {
        let state = self.state_at(time);
        self.fields_of(object, &state, f64::from(time))
    }

    fn fields_of(&self, object: usize, state: &SceneState, time: f64) -> ObjectFields {
        let ObjectModel { members, dynamics, .. } = &self.scene.objects[object];
        let points = &self.scene.dynamic_gaussians.means[members.clone()];
        let edited = (self.edits[object], time);
        dynamics.fields(points, &part_of(state, members), edited, self.laws.of(object))
    }

    fn states_of(&self, direction: Direction) -> &Vec<SceneState> {
        match direction {
            Direction::Forward => &self.forward,
            Direction::Backward => &self.backward,
        }
    }

    fn extend(&mut self, steps: usize, direction: Direction) {
        let states = self.states_of(direction);
        let missing = (steps + 1).saturating_sub(states.len());
        if missing == 0 {
            return;
        }
        let (kept, missing, dt) = (states.len() - 1, missing.max(CHUNK_STEPS), self.scene.motion.dt);
        self.laws.follow(&self.scene, &self.edits, self.grid_time(kept + missing, direction));
        let last = &self.states_of(direction)[kept];
        let more = self.advance(last, self.stretch(self.grid_time(kept, direction), dt, missing, direction));
        match direction {
            Direction::Forward => self.forward.extend(more),
            Direction::Backward => self.backward.extend(more),
        }
    }

    /// Time after a number of full steps.
    fn grid_time(&self, steps: usize, direction: Direction) -> f64 {
        let time = steps as f64 * f64::from(self.scene.motion.dt);
        if direction == Direction::Backward { -time } else { time }
    }

    fn stretch(&self, from: f64, dt: f32, steps: usize, direction: Direction) -> Stretch {
        Stretch { from, dt, steps, reversal: (direction == Direction::Backward).then_some(self.reversal) }
    }

    /// The states after each step of a stretch from `start`.
    fn advance(&self, start: &SceneState, stretch: Stretch) -> Vec<SceneState> {
        let mut states: Vec<SceneState> = (0..stretch.steps).map(|_| SceneState::default()).collect();
        for (index, (object, &edit)) in self.scene.objects.iter().zip(&self.edits).enumerate() {
            let members = &object.members;
            let points = &self.scene.dynamic_gaussians.means[members.clone()];
            let rolling = Rolling { edit, law: self.laws.of(index), device: &self.device };
            let path = object.advance(points, (&part_of(start, members), stretch), rolling);
            states.iter_mut().zip(path).for_each(|(state, part)| follow(state, part));
        }
        self.scene.cast_shadows(&self.edits, &stretch.times(), &mut states);
        states
    }
}

impl Motion<'static> {
    /// The unedited motion of a scene that it keeps.
    #[must_use]
    pub fn owned(scene: LagrangianScene) -> Self {
        let edits = vec![Edit::default(); scene.objects.len()];
        Self::with_edits(scene, edits, Reversal::default())
    }

    /// The motion of a scene that it keeps, with an edit for each object.
    ///
    /// # Panics
    /// If there are not as many edits as objects.
    #[must_use]
    pub fn with_edits(scene: LagrangianScene, edits: Vec<Edit>, reversal: Reversal) -> Self {
        Self::of(Cow::Owned(scene), edits, reversal)
    }
}

/// Which way in time, from t = 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    /// Positive times.
    Forward,
    /// Negative times.
    Backward,
}

impl Direction {
    /// Where a time lies.
    fn of(time: f32) -> Self {
        if time < 0.0 { Self::Backward } else { Self::Forward }
    }
}

/// How an object is rolled.
#[derive(Clone, Copy)]
struct Rolling<'a> {
    edit: Edit,
    /// Another law than its own.
    law: Option<&'a Law>,
    /// Where its particles are rolled.
    device: &'a Device,
}

impl ObjectModel {
    /// The states after each step of a stretch from `start`, of particles that are at `points` at t = 0:
    /// recorded ones as long as there are any, and from then on those of what carries the recording on,
    /// which as a rule are its dynamics. An edited motion is that of the dynamics alone, or that of the law
    /// which the end of the recording follows.
    fn advance(
        &self,
        points: &[[f32; 3]],
        (start, stretch): (&SceneState, Stretch),
        Rolling { edit, law, device }: Rolling<'_>,
    ) -> Vec<SceneState> {
        let times = stretch.times();
        if edit != Edit::default()
            && let Some(edited) = self.recording.as_ref().and_then(|r| r.edited(points, edit, &times))
        {
            return edited;
        }
        let recording = self.recording.as_ref().filter(|_| edit == Edit::default());
        let mut path = recording.map_or_else(Vec::new, |recording| recording.played(points, &times));
        let times = &times[path.len()..];
        if let Some(carried_on) = recording.and_then(|recording| recording.carried_on(points, times)) {
            path.extend(carried_on);
            return path;
        }
        let carried_on = match &self.dynamics {
            Dynamics::Particles(particles) => {
                let rest = Stretch { steps: times.len(), ..stretch };
                particles.advance(path.last().unwrap_or(start), rest, (edit, device))
            }
            Dynamics::Generalised(generalised) => {
                let law = law.unwrap_or(&generalised.law);
                let recording = recording.filter(|_| stretch.reversal.is_none());
                following(generalised, points, (law, edit, times), recording)
            }
        };
        path.extend(carried_on);
        path
    }
}

/// The states of particles under a law at some times, brought to where a recording ends if they come after
/// it.
fn following(
    generalised: &GeneralisedDynamics,
    points: &[[f32; 3]],
    (law, edit, times): (&Law, Edit, &[f64]),
    recording: Option<&Recording>,
) -> Vec<SceneState> {
    let place = |state: &_| generalised.placed(points, state);
    let states = |times: &[f64]| -> Vec<SceneState> {
        generalised.states_by(law, edit, times).iter().map(place).collect()
    };
    let mut later = states(times);
    if let Some(recording) = recording.filter(|_| times.first().is_some_and(|&time| time > 0.0)) {
        let end = [recording.end()];
        if let (Some(recorded), Some(moved)) = (recording.played(points, &end).pop(), states(&end).pop()) {
            recording.hand_over([&recorded, &moved], &mut later, times);
        }
    }
    later
}

/// Appends the rows of a part.
fn follow(state: &mut SceneState, part: SceneState) {
    if state.is_empty() {
        *state = part;
        return;
    }
    state.q.extend(part.q);
    state.v.extend(part.v);
    state.rotation.extend(part.rotation);
}

/// The rows of one object.
pub(super) fn part_of(state: &SceneState, rows: &Range<usize>) -> SceneState {
    SceneState {
        q: state.q[rows.clone()].to_vec(),
        v: state.v[rows.clone()].to_vec(),
        rotation: state.rotation[rows.clone()].to_vec(),
    }
}
