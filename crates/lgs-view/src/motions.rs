//! Rollouts of a scene under edits, kept for as long as there is room.

use lgs_dynamics::{Edit, Reversal, RolloutSpec};
use lgs_eval::laws::Shown;
use lgs_model::{Dynamics, LagrangianScene, Motion, SceneState};

use crate::protocol::ObjectEdit;
use crate::thresholds::{CHUNK_STEPS, LARGEST_SCALE};

/// Bytes of a Gaussian in a state: position, velocity and rotation.
const STATE_BYTES: usize = 40;

/// A rollout under the edits of its objects.
struct Kept {
    edits: Vec<ObjectEdit>,
    motion: Motion<'static>,
    /// How far each object's motion is known, once it has been asked for.
    shown: Option<Vec<Shown>>,
    /// Number of the last call that used it.
    used: u64,
}

/// Rollouts by their edits, the longest unused of which goes when they take too much memory; the one in use
/// stays, however large it is.
pub(crate) struct Motions {
    /// The scene without its static Gaussians.
    scene: LagrangianScene,
    kept: Vec<Kept>,
    calls: u64,
    /// Most bytes that rollouts take.
    limit: usize,
}

/// The dynamic Gaussians at a time, or on the way to it.
pub(crate) struct Reached {
    pub(crate) state: SceneState,
    pub(crate) time: f32,
    /// Whether `time` is the one that was asked for.
    pub(crate) is_there: bool,
}

impl Motions {
    pub(crate) fn new(scene: &LagrangianScene, limit: usize) -> Self {
        let mut scene = scene.clone();
        scene.static_gaussians = lgs_core::GaussianCloud::default();
        (scene.shading, scene.light) = (None, None);
        Self { scene, kept: Vec::new(), calls: 0, limit }
    }

    /// The state at a time; if many steps are missing, that after the next few of them.
    pub(crate) fn towards(&mut self, time: f32, edits: &[ObjectEdit]) -> Result<Reached, String> {
        let index = self.of(edits)?;
        let (dt, motion) = (self.scene.motion.dt, &mut self.kept[index].motion);
        let wanted = RolloutSpec::until(time.abs(), dt).steps;
        let [back, forth] = motion.kept_steps();
        let known = if time < 0.0 { back } else { forth };
        let reached = if wanted > known + CHUNK_STEPS {
            let steps = known + CHUNK_STEPS;
            let part = (steps as f32 * dt).copysign(time);
            Reached { state: motion.state_at(part), time: part, is_there: false }
        } else {
            Reached { state: motion.state_at(time), time, is_there: true }
        };
        self.shed(index);
        Ok(reached)
    }

    /// The law of an object under some edits, its terms scaled; β is not part of it.
    pub(crate) fn dynamics(&mut self, edits: &[ObjectEdit], object: usize) -> Result<Dynamics, String> {
        let index = self.of(edits)?;
        let objects = &self.kept[index].motion.scene().objects;
        objects.get(object).map(|object| object.dynamics.clone()).ok_or_else(|| format!("no object {object}"))
    }

    /// How far the motion of each object is known under some edits.
    pub(crate) fn shown(&mut self, edits: &[ObjectEdit]) -> Result<Vec<Shown>, String> {
        let index = self.of(edits)?;
        let Kept { edits, motion, shown, .. } = &mut self.kept[index];
        let scene = motion.scene();
        let of_objects = || {
            let scales: Vec<Edit> = (0..scene.objects.len())
                .map(|object| edits.get(object).map_or_else(Edit::default, ObjectEdit::scales))
                .collect();
            let is_edited = |object: usize| edits.get(object).is_some_and(|edit| !edit.is_none());
            Shown::of_objects(scene, &scales, &is_edited)
        };
        Ok(shown.get_or_insert_with(of_objects).clone())
    }

    /// Bytes of all rollouts, and the most that they may take.
    pub(crate) fn memory(&self) -> [usize; 2] {
        [self.kept.iter().map(|kept| bytes(&kept.motion)).sum(), self.limit]
    }

    /// Takes a few more of the steps that the rollout of the latest call misses within the scene's times;
    /// returns whether there were any.
    pub(crate) fn prepare(&mut self) -> bool {
        let latest = self.kept.iter().enumerate().max_by_key(|(_, kept)| kept.used);
        latest.map(|(index, _)| index).is_some_and(|index| self.roll_on(index))
    }

    /// The same for the rollout under some edits.
    pub(crate) fn prepare_for(&mut self, edits: &[ObjectEdit]) -> bool {
        self.of(edits).is_ok_and(|index| self.roll_on(index))
    }

    fn roll_on(&mut self, index: usize) -> bool {
        let (first, last) = self.scene.motion.time_range();
        let steps = |time: f32| RolloutSpec::until(time.abs(), self.scene.motion.dt).steps;
        let (past, future) = (steps(first), steps(last));
        let motion = &mut self.kept[index].motion;
        let [back, forth] = motion.kept_steps();
        let has_room = bytes(motion) < self.limit;
        if has_room && forth < future {
            motion.states((forth + CHUNK_STEPS).min(future));
        } else if has_room && back < past {
            motion.past_states((back + CHUNK_STEPS).min(past));
        } else {
            return false;
        }
        self.shed(index);
        true
    }

    /// The rollout under some edits, by its place.
    fn of(&mut self, edits: &[ObjectEdit]) -> Result<usize, String> {
        // Edits that change nothing are none: they share the rollout of the scene as it is.
        let edits = if edits.iter().all(ObjectEdit::is_none) { &[] } else { edits };
        self.calls += 1;
        let is_same = |kept: &Kept| kept.edits == edits;
        let index = match self.kept.iter().position(is_same) {
            Some(index) => index,
            None => {
                let motion = edited(&self.scene, edits)?;
                self.kept.push(Kept { edits: edits.to_vec(), motion, shown: None, used: 0 });
                self.kept.len() - 1
            }
        };
        self.kept[index].used = self.calls;
        Ok(index)
    }

    /// Forgets the longest unused rollouts, but never the one in use, until all fit.
    fn shed(&mut self, in_use: usize) {
        let used = self.kept[in_use].used;
        while self.memory()[0] > self.limit && self.kept.len() > 1 {
            let others = self.kept.iter().enumerate().filter(|(_, kept)| kept.used != used);
            let Some((oldest, _)) = others.min_by_key(|(_, kept)| kept.used) else { return };
            self.kept.remove(oldest);
        }
    }
}

fn bytes(motion: &Motion) -> usize {
    let [back, forth] = motion.kept_steps();
    (back + forth + 2) * motion.scene().dynamic_gaussians.len() * STATE_BYTES
}

/// The motion of a scene with scaled terms, and with an edit for each object.
fn edited(scene: &LagrangianScene, edits: &[ObjectEdit]) -> Result<Motion<'static>, String> {
    let count = scene.objects.len();
    if !edits.is_empty() && edits.len() != count {
        return Err(format!("{} edits for {count} objects", edits.len()));
    }
    let scales = edits.iter().flat_map(|edit| [edit.velocity, edit.potential, edit.force]);
    if let Some(scale) = scales.into_iter().find(|scale| scale.abs() > LARGEST_SCALE) {
        return Err(format!("a scale of {scale} is not between -{LARGEST_SCALE} and {LARGEST_SCALE}"));
    }
    let mut scene = scene.clone();
    for (object, edit) in scene.objects.iter_mut().zip(edits) {
        if edit.is_none() {
            continue;
        }
        if !edit.terms.is_empty() {
            scale_terms(&mut object.dynamics, &edit.terms)?;
        }
        // A recording says nothing of other physics.
        object.recording = None;
    }
    if let Some(contact) = scene.contact.as_mut().filter(|_| edits.iter().any(|edit| !edit.terms.is_empty()))
    {
        contact.replays_window = false;
    }
    let mut scales: Vec<Edit> = edits.iter().map(ObjectEdit::scales).collect();
    scales.resize(count, Edit::default());
    Ok(Motion::with_edits(scene, scales, Reversal::default()))
}

/// Scales the strengths of a law's terms.
fn scale_terms(dynamics: &mut Dynamics, factors: &[f64]) -> Result<(), String> {
    let Dynamics::Generalised(generalised) = dynamics else {
        return Err("only laws in generalised coordinates have terms to scale".to_owned());
    };
    generalised.scale_terms(factors).map_err(|error| error.to_string())
}
