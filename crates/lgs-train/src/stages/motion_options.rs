//! Settings of the learned motion.

use lgs_distill::Alignment;
use lgs_dynamics::VelocityPolicy;
use serde::{Deserialize, Serialize};

/// Integration and alignment of the learned motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionOptions {
    /// Time step Δτ. Default 0.01.
    pub dt: f32,
    /// Local rigid alignment (Eq. 6). Without it (ablation) candidates are final, Gaussians keep the
    /// orientation they have at t = 0, and no object follows a rigid constraint. Default true.
    pub alignment: bool,
    /// Neighbours in a support of the alignment, the particle itself not counted; 0 is no alignment.
    /// Default 19.
    pub alignment_neighbors: usize,
    /// Velocities after alignment: `keep` (the paper), `from-positions` or `rigid` (method §4.6).
    /// On long rollouts of trained scenes the first two are equally accurate, and only the first returns
    /// exactly.
    pub velocity_policy: VelocityPolicy,
}

impl Default for MotionOptions {
    fn default() -> Self {
        Self { dt: 0.01, alignment: true, alignment_neighbors: 19, velocity_policy: VelocityPolicy::Keep }
    }
}

impl MotionOptions {
    /// As published.
    #[must_use]
    pub fn paper() -> Self {
        Self::default()
    }

    /// Local rigid alignment, if it is on.
    #[must_use]
    pub fn alignment(&self) -> Option<Alignment> {
        let &Self { alignment_neighbors: neighbors, velocity_policy, .. } = self;
        let is_on = self.alignment && neighbors > 0;
        is_on.then_some(Alignment { support: neighbors + 1, velocity_policy })
    }

    /// Checks the step.
    ///
    /// # Errors
    /// The key and the reason.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        if self.dt > 0.0 && self.dt <= 0.1 {
            Ok(())
        } else {
            Err(("dt", format!("{} is not in (0, 0.1]", self.dt)))
        }
    }
}
