//! The model as it is while it trains, for proposals.

use lgs_core::GaussianCloud;
use lgs_model::source::{Learned, SourceMotion};

use super::proposals::Posed;

/// What has been learned up to an iteration.
pub(super) struct Snapshot<'a> {
    pub(super) motion: &'a dyn SourceMotion,
    /// With the Gaussians as they are drawn.
    pub(super) learned: Learned,
    /// Whether the Gaussians move yet.
    pub(super) is_deformed: bool,
}

impl Posed for Snapshot<'_> {
    fn at(&self, time: f32) -> GaussianCloud {
        match self.is_deformed {
            true => self.motion.model(self.learned.clone()).cloud_at(time),
            false => self.learned.cloud.clone(),
        }
    }

    fn moved(&self, canonical: &GaussianCloud, time: f32) -> Vec<[f32; 3]> {
        if !self.is_deformed {
            return canonical.means.clone();
        }
        let (cloud, features) = (canonical.clone(), self.motion.fresh_features(canonical));
        self.motion.model(Learned { cloud, features, ..self.learned.clone() }).positions_at(time)
    }
}
