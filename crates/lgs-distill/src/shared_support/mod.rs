//! The shared support of an object: particles that serve every particle as its support, so that Eq. 6 keeps
//! the whole object rigid.

mod balance;
mod choice;
pub(crate) mod moments;

use crate::config::DistillConfig;
use crate::motion::object_motion::ObjectMotion;
use crate::motion::pose::PoseKind;
use moments::SupportMoments;

/// Fewest members of a shared support: as many as fix a pose when they do not lie in a plane.
pub(crate) const FEWEST_MEMBERS: usize = 4;

/// The members of a shared support.
#[derive(Clone, Debug)]
pub(crate) struct SharedSupport {
    /// Particles of the object.
    pub(crate) particles: Vec<usize>,
    /// Their moments in the shape's axes.
    pub(crate) moments: SupportMoments,
}

impl SharedSupport {
    /// The shared support of an object; none if the configuration has no rigid constraint, or the object is
    /// not seen to be rigid or has too few particles.
    pub(crate) fn choose(motion: &ObjectMotion, config: &DistillConfig) -> Option<Self> {
        let smooth = motion.shared.as_ref().filter(|motion| motion.shared.kind == PoseKind::Rigid)?;
        let particles = choice::choose_members(smooth, config.shared_support_size);
        let points: Vec<_> = particles.iter().map(|&i| smooth.shared.shape[i]).collect();
        let is_possible = config.rigid_constraint && particles.len() >= FEWEST_MEMBERS;
        is_possible.then(|| Self { moments: SupportMoments::of(&points), particles })
    }

    /// The members as indices of a file or kernel.
    pub(crate) fn indices(&self) -> Vec<u32> {
        self.particles.iter().map(|&i| i as u32).collect()
    }
}
