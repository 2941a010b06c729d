//! Training networks on what a linear law leaves of an object's motion, or on all of it.

use crate::config::DistillConfig;
use crate::dense::{V3, add, norm2, scale, sub, wide};
use crate::distill::{DistillProgress, DistillStage, Distilled, anchored_supports};
use crate::network_fit::{
    Hold, Tick, VelocityField, match_accelerations, refine_by_rollouts, rollout_error, start_of,
};
use crate::seen::JUDGES;
use crate::targets::Paths;
use lgs_dynamics::{Supports, System, rollout};

/// How much farther than in the window networks may carry an object in three windows.
const MOST_REACH: f64 = 1.5;
/// How many times more rollout steps networks of an object that is held rigid get.
const HELD_STEPS: usize = 8;

/// What networks are trained on: a part of the particles, or the anchors of an object that is held rigid.
pub(crate) struct Training<'a> {
    config: &'a DistillConfig,
    paths: Paths,
    judges: Vec<usize>,
    supports: Option<Supports>,
    force_is_fixed: bool,
}

impl<'a> Training<'a> {
    pub(crate) fn new(
        all: &Paths,
        anchors: &[usize],
        distilled: &Distilled,
        config: &'a DistillConfig,
    ) -> Self {
        let rigid_constraint = distilled.report.rigid_constraint;
        let particles =
            if rigid_constraint { anchors.to_vec() } else { all.spread(config.matching.particles) };
        let paths = all.part(&particles, all.samples());
        let local: Vec<u32> = (0..paths.len() as u32).collect();
        let supports = rigid_constraint.then(|| anchored_supports(&local, paths.len()));
        let judges = if rigid_constraint { (0..paths.len()).collect() } else { paths.spread(JUDGES) };
        let force_is_fixed =
            rigid_constraint && !distilled.report.terms.is_some_and(|terms| terms.has_force());
        Self { config, paths, judges, supports, force_is_fixed }
    }

    fn hold(&self) -> Hold<'_> {
        Hold { supports: self.supports.as_ref(), force_is_fixed: self.force_is_fixed }
    }

    pub(crate) fn error(
        &self,
        system: &System,
        field: &VelocityField,
        samples: std::ops::Range<usize>,
    ) -> f64 {
        rollout_error(system, field, &self.paths, &self.judges, samples, self.hold())
    }

    /// Whether a rollout to three windows stays near where the object was in the first.
    pub(crate) fn stays(&self, system: &System, field: &VelocityField) -> bool {
        let seen: Vec<V3> = self
            .judges
            .iter()
            .flat_map(|&j| (0..self.paths.samples()).map(move |s| self.paths.position(j, s)))
            .collect();
        let center = scale(seen.iter().fold([0.0; 3], |sum, &p| add(sum, p)), 1.0 / seen.len() as f64);
        let limit = MOST_REACH * MOST_REACH * seen.iter().map(|&p| norm2(sub(p, center))).fold(0.0, f64::max);
        let start = start_of(system, field, &self.paths, &self.judges);
        let spec = self.hold().spec(self.paths.dt(), 3 * (self.paths.samples() - 1));
        let states = rollout(system, &start, &spec);
        states.iter().flat_map(|state| &state.q).all(|&q| norm2(sub(wide(q), center)) <= limit)
    }

    /// Matching (of independent particles) and rollouts on the first `samples` samples; rollouts count only
    /// if they lower the error.
    pub(crate) fn run(
        &self,
        system: &System,
        samples: usize,
        seed: u64,
        progress: &mut dyn FnMut(DistillProgress),
    ) -> (System, VelocityField) {
        let all: Vec<usize> = (0..self.paths.len()).collect();
        let paths = self.paths.part(&all, samples);
        let (mut system, mut field) = (system.clone(), VelocityField::NONE);
        let tell = |stage, steps| {
            move |tick: Tick| DistillProgress { stage, step: tick.step + 1, steps, loss: Some(tick.loss) }
        };
        let mut rollouts = self.config.rollout.clone();
        if self.supports.is_some() {
            // A held object's internal forces do not show in accelerations: rollouts have to teach
            // everything.
            (rollouts.steps, rollouts.learning_rate) =
                (HELD_STEPS * rollouts.steps, self.config.matching.learning_rate);
        } else {
            let matching = tell(DistillStage::Matching, self.config.matching.steps);
            match_accelerations(&mut system, &paths, &self.config.matching, seed, &mut |tick| {
                progress(matching(tick))
            });
        }
        let (before, unrefined) = (self.error(&system, &field, 0..samples), system.clone());
        let refining = tell(DistillStage::Rollout, rollouts.steps);
        refine_by_rollouts(&mut system, &mut field, &paths, &rollouts, self.hold(), seed, &mut |tick| {
            progress(refining(tick))
        });
        if self.error(&system, &field, 0..samples) > before {
            (unrefined, VelocityField::NONE)
        } else {
            (system, field)
        }
    }
}
