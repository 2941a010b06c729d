//! The motion of a scene once its Gaussians are tuned: laws chosen a last time by the images, and held to the
//! source.

use lgs_distill::CoordinatesKind;
use lgs_model::LagrangianScene;
use lgs_model::source::SourceModel;

use super::Pipeline;
use crate::checkpoint::Stage;
use crate::error::TrainError;
use crate::stages::{HeldToSource, Outcome, SourceOfScene, WorseThanSource, held_to_source, load_rows};
use crate::thresholds::UNSETTLED;

/// A scene whose laws have been chosen for tuned Gaussians.
pub(super) struct Settled {
    pub(super) held: HeldToSource,
    /// Whether its motion is so much another one that its Gaussians are to be tuned once more.
    pub(super) needs_retuning: bool,
}

/// Warns of objects that draw the window too badly.
pub(super) fn warn_of(worse: &[WorseThanSource]) {
    for WorseThanSource { object, decibels, outcome } in worse {
        let outcome = match outcome {
            Outcome::GivesWay => "it plays the source's tracks there, and its law is not to be trusted",
            Outcome::IsDistrusted => "it is not to be trusted",
            Outcome::Stays => "so would the source's tracks: something else than motion changes how it looks",
        };
        tracing::warn!(
            "object {object}: its motion draws the captured window {decibels:.1} dB worse than the source \
             does; {outcome}"
        );
    }
}

impl Pipeline<'_> {
    /// The scene with laws chosen once more by the images, now that the Gaussians are tuned, and held to the
    /// source.
    pub(super) fn settled(
        &self,
        scene: LagrangianScene,
        source: &dyn SourceModel,
    ) -> Result<Settled, TrainError> {
        let (scene, gain) = self.with_laws_of_tuned_gaussians(scene)?;
        let held = self.held_to_source(scene, source)?;
        let plays_tracks = held.worse.iter().any(|object| object.outcome == Outcome::GivesWay);
        Ok(Settled { held, needs_retuning: plays_tracks || gain.abs() > UNSETTLED })
    }

    /// The scene with the laws given up that draw the window worse than the source. The paper's dynamics are
    /// never replaced.
    fn held_to_source(
        &self,
        scene: LagrangianScene,
        source: &dyn SourceModel,
    ) -> Result<HeldToSource, TrainError> {
        let path = self.run.source_rows_path();
        if self.config.distill.coordinates == CoordinatesKind::Particles || !path.exists() {
            return Ok(HeldToSource { scene, worse: Vec::new() });
        }
        let rows = load_rows(&path, source, &scene)?;
        let of = SourceOfScene { source, rows, config: &self.config.distill };
        Ok(held_to_source(scene, &of, self.dataset.split("train")))
    }

    /// The scene with laws chosen a last time by the images, now that the Gaussians are those of stage 3:
    /// what they had wrong before was error of the poses. Tells by how many decibels they draw the images
    /// better.
    ///
    /// # Errors
    /// If the record of the budget cannot be written.
    fn with_laws_of_tuned_gaussians(
        &self,
        scene: LagrangianScene,
    ) -> Result<(LagrangianScene, f64), TrainError> {
        let is_fitted = !self.is_left_out(Stage::FitDynamics, &scene);
        let are_tuned = !self.is_left_out(Stage::TuneGaussians, &scene);
        if !is_fitted || !are_tuned || !self.has_time_for(Stage::TuneGaussians)? {
            return Ok((scene, 0.0));
        }
        Ok(self.fit_dynamics(scene)?.with_laws_of_images())
    }
}
