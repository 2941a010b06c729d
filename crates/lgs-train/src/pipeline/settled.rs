//! The motion of a scene once its Gaussians are tuned: laws chosen a last time by the images, and held to the
//! source.

use std::cell::RefCell;

use lgs_distill::CoordinatesKind;
use lgs_model::LagrangianScene;
use lgs_model::source::SourceModel;

use super::Pipeline;
use crate::budget::Budget;
use crate::checkpoint::{Checkpoint, Stage};
use crate::driver::{Control, SceneTrainer};
use crate::error::TrainError;
use crate::stages::{
    HeldToSource, Outcome, SourceOfScene, TuneGaussians, WorseThanSource, held_to_source, load_rows,
};
use crate::thresholds::{MOST_RETUNINGS, UNSETTLED};

/// A scene whose laws have been chosen for tuned Gaussians.
struct Settled {
    held: HeldToSource,
    /// Whether objects have come to play their source's tracks.
    plays_tracks: bool,
    /// Whether the laws draw the images another way.
    is_changed: bool,
}

impl Settled {
    /// Whether its motion is so much another one that its Gaussians are to be tuned for the `round`th time. A
    /// law that gives way to tracks once more would be sought and give way in every round.
    fn needs_retuning(&self, round: usize) -> bool {
        let is_new = match round {
            1 => self.is_changed || self.plays_tracks,
            _ => self.is_changed && !self.plays_tracks,
        };
        is_new && round <= MOST_RETUNINGS
    }
}

/// Warns of objects that draw the window too badly.
fn warn_of(worse: &[WorseThanSource]) {
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
    /// The scene with laws chosen a last time by the images, after stage 3. Where that changes the motion,
    /// the Gaussians are tuned once more and laws chosen for these, as long as it does and there is time;
    /// `latest` is a checkpoint of such a round.
    pub(super) fn retuned(
        &self,
        mut scene: LagrangianScene,
        source: &dyn SourceModel,
        mut latest: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<LagrangianScene, TrainError> {
        let (data, config) = (self.training_data(), &self.config.tune_gaussians);
        let mut tuned: Option<TuneGaussians<'_>> = None;
        loop {
            if latest.is_none() {
                let settled = self.settled(scene, source)?;
                let round = tuned.as_ref().map_or(0, TuneGaussians::round) + 1;
                let goes_on = settled.needs_retuning(round) && self.has_time_to_retune(round)?;
                scene = settled.held.scene;
                if !goes_on {
                    warn_of(&settled.held.worse);
                    return Ok(scene);
                }
            }
            let mut trainer = TuneGaussians::again(scene, data, config, tuned.as_ref());
            self.training_loop().drive(&mut trainer, latest.take(), control)?;
            scene = trainer.scene();
            tuned = Some(trainer);
        }
    }

    /// Whether the budget, if there is one, leaves time to tune the Gaussians once more.
    fn has_time_to_retune(&self, round: usize) -> Result<bool, TrainError> {
        let decide =
            |budget: &RefCell<Budget>| budget.borrow_mut().has_time_again_for(Stage::RetuneGaussians, round);
        self.budget.as_ref().map_or(Ok(true), decide)
    }

    /// The scene with laws chosen once more by the images, now that the Gaussians are tuned, and held to the
    /// source.
    fn settled(&self, scene: LagrangianScene, source: &dyn SourceModel) -> Result<Settled, TrainError> {
        let (scene, gain) = self.with_laws_of_tuned_gaussians(scene)?;
        let held = self.held_to_source(scene, source)?;
        let plays_tracks = held.worse.iter().any(|object| object.outcome == Outcome::GivesWay);
        Ok(Settled { held, plays_tracks, is_changed: gain.abs() > UNSETTLED })
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
