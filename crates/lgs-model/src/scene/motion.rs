//! Rollouts of a scene with their states kept, so that a sweep over times costs one rollout.

use std::borrow::Cow;

use lgs_core::linear::{add, scale, sub};
use lgs_dynamics::{Edit, Reversal, RolloutSpec, State, rollout, rollout_reversed};

use super::{LagrangianScene, ObjectModel};

/// Positions, velocities and accumulated rotations of all dynamic Gaussians at one time; rows as in the
/// scene.
pub type SceneState = State;

/// How many steps a cache grows by at a time.
const CHUNK_STEPS: usize = 25;

/// The motion of a scene under an edit: states on the step grid, computed when first asked for and kept.
pub struct Motion<'a> {
    scene: Cow<'a, LagrangianScene>,
    edit: Edit,
    reversal: Reversal,
    forward: Vec<SceneState>,
    backward: Vec<SceneState>,
}

impl<'a> Motion<'a> {
    /// The motion of `scene` with scaled velocity, potential and force (α, β, γ); `reversal` is used for
    /// negative times. The scales mean the velocity at t = 0, see [`LagrangianScene::start_velocities`].
    #[must_use]
    pub fn new(scene: &'a LagrangianScene, edit: Edit, reversal: Reversal) -> Self {
        Self::of(Cow::Borrowed(scene), edit, reversal)
    }

    fn of(scene: Cow<'a, LagrangianScene>, edit: Edit, reversal: Reversal) -> Self {
        let start = SceneState::at_start(scene.dynamic_gaussians.means.clone(), scene.start_velocities(edit));
        Self { scene, edit, reversal, forward: vec![start.clone()], backward: vec![start] }
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
        self.extend(until.steps, direction);
        let state = &self.states_of(direction)[until.steps];
        let rest = until.last_dt.and_then(|rest| self.advance(state, rest, 1, direction).pop());
        rest.unwrap_or_else(|| state.clone())
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
        let (last, dt) = (&states[states.len() - 1], self.scene.motion.dt);
        let more = self.advance(last, dt, missing.max(CHUNK_STEPS), direction);
        match direction {
            Direction::Forward => self.forward.extend(more),
            Direction::Backward => self.backward.extend(more),
        }
    }

    fn advance(&self, start: &SceneState, dt: f32, steps: usize, direction: Direction) -> Vec<SceneState> {
        // The velocity scale acts once, on v0.
        let edit = Edit { velocity_scale: 1.0, ..self.edit };
        let reversal = (direction == Direction::Backward).then_some(self.reversal);
        self.scene.advance(start, Advance { dt, steps, edit, reversal })
    }
}

impl Motion<'static> {
    /// The unedited motion of a scene that it keeps.
    #[must_use]
    pub fn owned(scene: LagrangianScene) -> Self {
        Self::of(Cow::Owned(scene), Edit::default(), Reversal::default())
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

/// A number of equal steps.
#[derive(Clone, Copy, Debug)]
struct Advance {
    dt: f32,
    steps: usize,
    edit: Edit,
    /// How to go backwards in time; nothing goes forwards.
    reversal: Option<Reversal>,
}

impl LagrangianScene {
    /// What an edited motion starts with, `[n_dynamic]`, world units per unit of time.
    ///
    /// The stored velocities lag half a kick behind those at t = 0, with which Eq. 5 tracks positions to
    /// second order (method §4.3): `v(0) = v₀ + ½ dt a(q₀, v₀)`. An edit scales v(0) and changes the
    /// accelerations, so its own half kick is taken off: `α v(0) − ½ dt a_edit`. Without an edit these are
    /// the stored velocities, bit for bit.
    #[must_use]
    pub fn start_velocities(&self, edit: Edit) -> Vec<[f32; 3]> {
        if edit == Edit::default() {
            return self.velocities.clone();
        }
        let half = 0.5 * self.motion.dt;
        let mut start = Vec::with_capacity(self.velocities.len());
        for object in &self.objects {
            let (q, stored) = (
                &self.dynamic_gaussians.means[object.members.clone()],
                &self.velocities[object.members.clone()],
            );
            let kick = object.system.accelerations(q, stored, &Edit::default());
            let at_zero = stored.iter().zip(kick).map(|(v, a)| add(*v, scale(a, half)));
            let scaled: Vec<[f32; 3]> = at_zero.map(|v| scale(v, edit.velocity_scale)).collect();
            let edited_kick = object.system.accelerations(q, &scaled, &edit);
            start.extend(scaled.iter().zip(edited_kick).map(|(v, a)| sub(*v, scale(a, half))));
        }
        start
    }

    /// The states after 1 … `steps` steps from `start`.
    fn advance(&self, start: &SceneState, by: Advance) -> Vec<SceneState> {
        let Advance { dt, steps, edit, reversal } = by;
        let mut states: Vec<SceneState> = (0..steps).map(|_| SceneState::default()).collect();
        for object in &self.objects {
            let spec = RolloutSpec {
                dt,
                steps,
                last_dt: None,
                edit,
                supports: object.supports.as_ref(),
                velocity_policy: object.velocity_policy,
            };
            let part = object.part_of(start);
            let path = match reversal {
                Some(reversal) => rollout_reversed(&object.system, &part, &spec, reversal),
                None => rollout(&object.system, &part, &spec),
            };
            for (state, part) in states.iter_mut().zip(path.into_iter().skip(1)) {
                state.q.extend(part.q);
                state.v.extend(part.v);
                state.rotation.extend(part.rotation);
            }
        }
        states
    }
}

impl ObjectModel {
    fn part_of(&self, state: &SceneState) -> State {
        let rows = self.members.clone();
        State {
            q: state.q[rows.clone()].to_vec(),
            v: state.v[rows.clone()].to_vec(),
            rotation: state.rotation[rows].to_vec(),
        }
    }
}
