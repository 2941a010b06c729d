//! Position errors of edited motions against the edited truth.

use std::collections::BTreeMap;

use lgs_data::edit::MotionEdit;
use lgs_data::synth::GroundTruth;
use lgs_dynamics::Reversal;
use lgs_model::{LagrangianScene, Motion};

use super::trajectory::trajectory_errors;
use super::truth::Truth;
use crate::scales::scales;

/// Position errors of a scene under every edit whose truth is known, over the mean path length of that truth,
/// by the name of the edit and by time; times without an error are left out.
#[must_use]
pub fn edited_trajectory_errors(
    scene: &LagrangianScene,
    reversal: Reversal,
    edits: &BTreeMap<String, MotionEdit>,
    truths: &BTreeMap<String, GroundTruth>,
) -> BTreeMap<String, BTreeMap<String, Option<f64>>> {
    let errors = |(name, &edit): (&String, &MotionEdit)| {
        let truth = Truth::new(truths.get(name)?)?;
        let mut motion = Motion::new(scene, scales(edit), reversal);
        let (errors, _) = trajectory_errors(scene, &mut motion, Some(&truth));
        Some((name.clone(), errors.into_iter().filter(|(_, error)| error.is_some()).collect()))
    };
    edits.iter().filter_map(errors).collect()
}
