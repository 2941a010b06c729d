//! Forecasts of edited motions, beside the truth that has the same edit.

use super::AnyError;
use super::measure::{DT, PARTICLES, STEPS, at, distance, path};
use super::thresholds::{COMPARED, RECORDED, WINDOW, WRONG};
use lgs_data::synth::{self, GroundTruth};
use lgs_distill::{Distilled, DistilledLaw, SceneDistillation};
use lgs_mechanics::Edit;

/// How forecasts of edited motions came out.
pub(super) struct EditedForecasts {
    /// Largest error over the path at t = 1 under the edits of β and γ.
    pub(super) worst: f64,
    /// Whether the scene is trusted to t = 1, for each edit.
    pub(super) trusted: Vec<bool>,
    /// Edits under which an object errs by more than is promised at a time to which it is trusted.
    pub(super) wrong: Vec<Edit>,
}

impl EditedForecasts {
    /// How many edits are trusted, of how many; and which wrongly so.
    pub(super) fn told(&self) -> (String, String) {
        let trusted = self.trusted.iter().filter(|trusted| **trusted).count();
        let wrong = |edit: &Edit| format!("WRONGLY TRUSTED {edit:?}; ");
        (format!("{trusted}/{}", self.trusted.len()), self.wrong.iter().map(wrong).collect())
    }
}

/// Compares a scene's forecasts under each edit with the truth; nothing for objects without a law.
pub(super) fn edited_forecasts(
    found: &SceneDistillation,
    (scene, seed): (&str, u64),
    unedited: &GroundTruth,
    times: &[f64],
) -> Result<Option<EditedForecasts>, AnyError> {
    let mut all = EditedForecasts { worst: 0.0, trusted: Vec::new(), wrong: Vec::new() };
    for (edit, truth) in synth::edited_ground_truths(scene, times, PARTICLES, seed)? {
        let [velocity, potential, force] =
            [edit.velocity_scale, edit.potential_scale, edit.force_scale].map(f64::from);
        let edit = Edit { velocity, potential, force };
        let (mut error, mut way, mut until) = (0.0, 0.0, f64::INFINITY);
        for (members, object) in &found.objects {
            let Distilled::Generalised(law) = object else { return Ok(None) };
            let moved = law.edited(edit, &[times[RECORDED]]);
            way += path(&truth, members, RECORDED);
            error += moved.first().map_or(f64::NAN, |last| distance(last, &at(&truth, members, RECORDED)));
            let trusted = law.trusted_under(edit);
            until = f64::min(until, trusted[1]);
            let promised = WRONG * path(unedited, members, WINDOW - 1);
            if is_wrong(law, (members, &truth), (edit, trusted[1]), promised) {
                all.wrong.push(edit);
            }
        }
        all.trusted.push(until >= times[RECORDED]);
        // What cannot be followed is the worst.
        let relative = if error.is_nan() { f64::INFINITY } else { error / way };
        if velocity == 1.0 {
            all.worst = all.worst.max(relative);
        }
    }
    Ok((!all.trusted.is_empty()).then_some(all))
}

/// Whether an edited forecast errs by more than is promised, or than the same part of the edited path, at a
/// time to which it is trusted.
fn is_wrong(
    law: &DistilledLaw,
    (members, truth): (&[usize], &GroundTruth),
    (edit, until): (Edit, f64),
    promised: f64,
) -> bool {
    let last = ((until / DT).floor() as usize).min(STEPS);
    let steps: Vec<usize> = (COMPARED..=last).step_by(COMPARED).collect();
    let times: Vec<f64> = steps.iter().map(|&step| DT * step as f64).collect();
    let moved = law.edited(edit, &times);
    steps.iter().enumerate().any(|(i, &step)| {
        let error = moved.get(i).map_or(f64::NAN, |moved| distance(moved, &at(truth, members, step)));
        error.is_nan() || error > promised.max(WRONG * path(truth, members, step))
    })
}
