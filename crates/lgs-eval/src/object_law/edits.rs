//! How far forecasts under edits are trusted.

use lgs_data::edit::SYNTHETIC_EDITS;
use lgs_dynamics::Edit;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::terms::Role;
use lgs_model::LagrangianScene;
use serde::{Deserialize, Serialize};

use super::ObjectLaw;
use crate::scales::scales;

/// How far the forecast of an edited motion is trusted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrustedEdit {
    /// α, of the velocity at t = 0.
    pub velocity_scale: f32,
    /// β, of the potential.
    pub potential_scale: f32,
    /// γ, of the other forces.
    pub force_scale: f32,
    /// First and last time at which the forecast is trusted, units of time.
    pub trusted: [f64; 2],
}

impl TrustedEdit {
    /// The scale that is not 1, with its name.
    #[must_use]
    pub fn name(&self) -> String {
        let scales = [("α", self.velocity_scale), ("β", self.potential_scale), ("γ", self.force_scale)];
        let edited = scales.iter().filter(|(_, scale)| *scale != 1.0);
        edited.map(|(name, scale)| format!("{name} = {scale}")).collect::<Vec<_>>().join(", ")
    }
}

impl ObjectLaw {
    /// The same with how far forecasts under edits of an object of a scene are trusted, where its law
    /// explains the motion and laws were drawn from what is known of it.
    #[must_use]
    pub fn with_edits(mut self, scene: &LagrangianScene, object: usize) -> Self {
        let acts = |conserves: bool| self.terms.iter().any(|t| (t.role == Role::Conserves) == conserves);
        let matters = |edit: &&Edit| {
            edit.velocity_scale != 1.0
                || (edit.potential_scale != 1.0 && acts(true))
                || (edit.force_scale != 1.0 && acts(false))
        };
        let told = |edit: &Edit| {
            let Edit { velocity_scale, potential_scale, force_scale } = *edit;
            let edits = vec![*edit; scene.objects.len()];
            let trusted = scene.trusted_under(&[object], &edits).pop()??;
            Some(TrustedEdit { velocity_scale, potential_scale, force_scale, trusted })
        };
        if self.verdict == Verdict::Explained {
            let shown = SYNTHETIC_EDITS.map(|(_, edit)| scales(edit));
            self.edits = shown.iter().filter(matters).filter_map(told).collect();
        }
        self
    }
}
