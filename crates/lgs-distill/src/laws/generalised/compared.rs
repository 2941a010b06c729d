//! A law through impacts beside the smooth laws of the same body.

use super::contact::{Impacted, Surroundings};
use super::evidence::unknowns;
use super::observed::ObservedPoses;
use super::rated::Rated;
use crate::motion::pose::Pose;
use crate::thresholds::MOST_AFTER_IMPACT;
use lgs_mechanics::choose::DESCRIBED;
use lgs_mechanics::contact::Origin;

impl Impacted {
    /// Whether it needs no comparison with a smooth law.
    pub(super) fn is_sure(&self) -> bool {
        self.bounced.is_within_noise() && self.is_on_observed_plane()
    }

    /// Whether it leaves nothing that a smooth law is to be sought for: it explains the motion, or describes
    /// it through hits of which others tell.
    pub(super) fn accounts_for_motion(&self, surroundings: Surroundings<'_>) -> bool {
        let is_told = !surroundings.hits.is_empty();
        self.bounced.is_within_noise() || (is_told && self.bounced.chi_square <= DESCRIBED)
    }

    /// Whether points at rest show the plane that the body bounces off.
    pub(super) fn is_on_observed_plane(&self) -> bool {
        self.bounced.law.contact.as_ref().is_some_and(|contact| contact.origin == Origin::Observed)
    }

    /// By how much it is likelier than the likeliest smooth law, in units of χ²; nothing if it is not. On a
    /// plane that nothing at rest shows, it has to say where the body is after the impact: what stops a body
    /// in the air may be a hand.
    pub(super) fn lead(&self, smooth: Option<&Rated>, observed: &ObservedPoses) -> Option<f64> {
        let bounced = &self.bounced;
        if !self.is_on_observed_plane() && bounced.error > MOST_AFTER_IMPACT * bounced.path() {
            return None;
        }
        let Some(rated) = smooth else { return Some(0.0) };
        let (system, judged) = (rated.system(), &rated.best().judged);
        let Some(poses) = rated.best().posterior.placed.poses(&observed.times) else { return Some(0.0) };
        let poses: Vec<Pose> = poses.into_iter().flatten().collect();
        // The start of the law with a contact is not counted, so as many are left out of the other's.
        let beyond_start = unknowns(system, judged) - 2.0 * bounced.start.v.len() as f64;
        let [smooth, bounced] = [self.evidence_of(observed, &poses, beyond_start), bounced.evidence()];
        tracing::debug!(smooth, bounced, "evidence of a smooth law and of one with a contact");
        (bounced < smooth).then_some(smooth - bounced)
    }
}
