//! Rollouts of a scene with their states kept, so that a sweep over times costs one rollout.

use lgs_core::linear::{add, scale, sub};
use lgs_dynamics::{Edit, Reversal, RolloutSpec, State, rollout, rollout_reversed};

use super::{LagrangianScene, ObjectModel};

/// Positions, velocities and accumulated rotations of all moving Gaussians at one time; rows as in the scene.
pub type SceneState = State;

/// How many steps a cache grows by at a time.
const CHUNK_STEPS: usize = 25;

/// The motion of a scene under an edit: states on the step grid, computed when first asked for and kept.
pub struct Motion<'a> {
    scene: &'a LagrangianScene,
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
        let start = SceneState {
            q: scene.dynamic_gaussians.means.clone(),
            v: scene.start_velocities(edit),
            rotation: vec![[1.0, 0.0, 0.0, 0.0]; scene.dynamic_gaussians.len()],
        };
        Self { scene, edit, reversal, forward: vec![start.clone()], backward: vec![start] }
    }

    /// The state at time `t`: full steps of `dt`, then one shortened step to a time off the grid (gap G9).
    #[must_use]
    pub fn state_at(&mut self, t: f32) -> SceneState {
        let (steps, rest) = split_time(t.abs(), self.scene.motion.dt);
        let backwards = t < 0.0;
        self.extend(steps, backwards);
        let states = if backwards { &self.backward } else { &self.forward };
        match rest {
            None => states[steps].clone(),
            Some(rest) => self
                .advance(&states[steps], rest, 1, backwards)
                .pop()
                .unwrap_or_else(|| states[steps].clone()),
        }
    }

    /// States on the grid from 0 to `steps · dt` (backwards: to `−steps · dt`).
    pub fn states(&mut self, steps: usize, backwards: bool) -> &[SceneState] {
        self.extend(steps, backwards);
        if backwards { &self.backward[..=steps] } else { &self.forward[..=steps] }
    }

    fn extend(&mut self, steps: usize, backwards: bool) {
        loop {
            let states = if backwards { &self.backward } else { &self.forward };
            let Some(missing) = (steps + 1).checked_sub(states.len()).filter(|&m| m > 0) else { return };
            let Some(last) = states.last() else { return };
            let more = self.advance(last, self.scene.motion.dt, missing.max(CHUNK_STEPS), backwards);
            if backwards { self.backward.extend(more) } else { self.forward.extend(more) }
        }
    }

    fn advance(&self, start: &SceneState, dt: f32, steps: usize, backwards: bool) -> Vec<SceneState> {
        // The velocity scale acts once, on v0.
        let edit = Edit { velocity_scale: 1.0, ..self.edit };
        self.scene.advance(start, dt, steps, edit, backwards.then_some(self.reversal))
    }
}

impl LagrangianScene {
    /// What an edited motion starts with, `[n_dynamic]`, world units per unit of time.
    ///
    /// The stored velocities lag half a kick behind those at t = 0, with which Eq. 5 tracks positions to
    /// second order (gap G28): `v(0) = v₀ + ½ dt a(q₀, v₀)`. An edit scales v(0) and changes the
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

    /// The states after 1 … `steps` steps of `dt` from `start`; backwards in time if a reversal is given.
    #[must_use]
    pub fn advance(
        &self,
        start: &SceneState,
        dt: f32,
        steps: usize,
        edit: Edit,
        backwards: Option<Reversal>,
    ) -> Vec<SceneState> {
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
            let path = match backwards {
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

/// Full steps in a time, and what is left if it is more than rounding.
pub(crate) fn split_time(t: f32, dt: f32) -> (usize, Option<f32>) {
    /// Part of a step below which a time counts as on the grid.
    const ON_GRID: f64 = 1e-3;
    let steps = f64::from(t) / f64::from(dt);
    let whole = (steps + ON_GRID).floor();
    let rest = steps - whole;
    (whole as usize, (rest > ON_GRID).then(|| (rest * f64::from(dt)) as f32))
}

#[cfg(test)]
mod tests {
    use super::split_time;

    #[test]
    fn times_on_the_grid_have_no_rest() {
        assert_eq!(split_time(0.75, 0.01), (75, None));
        assert_eq!(split_time(2.25, 0.01), (225, None));
        assert_eq!(split_time(0.0, 0.01), (0, None));
        let (steps, rest) = split_time(46.0 / 60.0, 0.01);
        assert_eq!(steps, 76);
        assert!((rest.unwrap_or(0.0) - 0.006_666_7).abs() < 1e-5);
    }
}
