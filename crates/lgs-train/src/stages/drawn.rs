//! Scenes by how well they draw the images.

use lgs_data::dataset::Frame;
use lgs_model::LagrangianScene;

use super::newton::squared_error_of;
use crate::thresholds::MOST_BELOW_SOURCE;

/// A scene and how well it draws some frames.
pub(super) struct Drawn<'a> {
    pub(super) scene: LagrangianScene,
    frames: &'a [&'a Frame],
    /// Squared error of the images.
    pub(super) error: f64,
}

impl<'a> Drawn<'a> {
    /// A scene and its error.
    pub(super) fn new(scene: LagrangianScene, frames: &'a [&'a Frame]) -> Self {
        Self { error: squared_error_of(&scene, frames), scene, frames }
    }

    /// Takes another scene in its place, if there is one that draws the frames about as well, or leaves at
    /// most so much more of them.
    pub(super) fn take_if_near(&mut self, other: Option<LagrangianScene>, slack: f64) {
        let Some(other) = other else { return };
        let (error, after) = (self.error, squared_error_of(&other, self.frames));
        tracing::debug!(error, after, "images by the motion that the scene had, and by what they offer");
        if decibels_between(error, after) <= MOST_BELOW_SOURCE || after - error <= slack {
            (self.scene, self.error) = (other, after);
        }
    }
}

/// Decibels by which a squared error is worse than another.
pub(super) fn decibels_between(error: f64, worse: f64) -> f64 {
    10.0 * (worse / error.max(f64::MIN_POSITIVE)).log10()
}
