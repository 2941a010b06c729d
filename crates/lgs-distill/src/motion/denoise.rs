//! From an object's trajectories to its denoised motion.

use super::object_motion::ObjectMotion;
use super::paths::Paths;
use super::pose::PoseKind;
use super::procrustes::{fit_shared_motion, refine_shared_motion};
use super::scales::scales;
use super::shared_motion::SharedMotion;
use super::smooth_motion::SmoothMotion;
use crate::config::{DistillConfig, SharedMotionKind};
use crate::trajectories::Trajectories;

/// Particles that errors and scales are measured on.
pub(crate) const VALIDATION_PARTICLES: usize = 200;
/// An affine motion is preferred to a rigid one only if the rigid residual is this many times larger …
const RIGID_SLACK: f64 = 1.5;
/// … and exceeds it by this part of the displacement.
const RIGID_TOLERANCE: f64 = 0.02;
/// A motion is shared if its residual is below this many times the independent noise and what
/// [`DistillConfig::shared_residual`] grants.
const NOISE_SLACK: f64 = 1.5;

/// Denoises an object's trajectories: by the motion that its particles share if they do, else particle by
/// particle.
pub(crate) fn denoise(trajectories: &Trajectories, config: &DistillConfig) -> ObjectMotion {
    let (noise, displacement) = (trajectories.independent_noise(), trajectories.rms_displacement());
    let shared = shared_motion(trajectories, config, noise, displacement)
        .map(|motion| SmoothMotion::new(motion, config.degrees()));
    let dt = f64::from(trajectories.dt());
    let (paths, degree) = match &shared {
        Some(motion) => (Paths::shared(motion, dt), motion.degree),
        None => Paths::independent(trajectories, config.degrees(), VALIDATION_PARTICLES),
    };
    let validation = paths.spread(VALIDATION_PARTICLES);
    let scales = scales(&paths, &validation, dt * trajectories.times.len() as f64);
    ObjectMotion { shared, paths, degree, validation, scales, noise, displacement }
}

/// The motion that the particles share, if they do.
fn shared_motion(
    trajectories: &Trajectories,
    config: &DistillConfig,
    noise: f64,
    displacement: f64,
) -> Option<SharedMotion> {
    let fit = |kind| refine_shared_motion(fit_shared_motion(trajectories, kind), trajectories);
    match config.shared_motion {
        SharedMotionKind::None => None,
        SharedMotionKind::Rigid => Some(fit(PoseKind::Rigid)),
        SharedMotionKind::Affine => Some(fit(PoseKind::Affine)),
        SharedMotionKind::Auto => {
            let (rigid, affine) = (fit(PoseKind::Rigid), fit(PoseKind::Affine));
            let is_rigid = rigid.residual <= RIGID_SLACK * affine.residual
                || rigid.residual <= affine.residual + RIGID_TOLERANCE * displacement;
            let better = if is_rigid { rigid } else { affine };
            let most = NOISE_SLACK * noise + f64::from(config.shared_residual) * displacement;
            (better.residual <= most).then_some(better)
        }
    }
}
