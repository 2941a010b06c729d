//! From an object's trajectories to its denoised motion.

use super::object_motion::ObjectMotion;
use super::paths::Paths;
use super::pose::PoseKind;
use super::procrustes::{fit_shared_motion, refine_shared_motion};
use super::scales::scales;
use super::shared_motion::SharedMotion;
use super::smooth_motion::SmoothMotion;
use crate::config::{DistillConfig, SharedMotionKind};
use crate::thresholds::{RESIDUAL_SLACK, RESIDUAL_TOLERANCE, SAMPLE_SIZE};
use crate::trajectories::Trajectories;

/// Denoises an object's trajectories: by the motion that its particles share if they do, else particle by
/// particle.
pub(crate) fn denoise(trajectories: &Trajectories, config: &DistillConfig) -> ObjectMotion {
    let (noise, displacement) = (trajectories.independent_noise(), trajectories.rms_displacement());
    let shared = shared_motion(trajectories, config, noise, displacement)
        .map(|motion| SmoothMotion::new(motion, config.degrees()));
    let dt = f64::from(trajectories.dt());
    let (paths, degree) = match &shared {
        Some(motion) => (Paths::shared(motion, dt), motion.degree),
        None => Paths::independent(trajectories, config.degrees(), SAMPLE_SIZE),
    };
    let validation = paths.spread(SAMPLE_SIZE);
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
            let is_rigid = rigid.residual <= RESIDUAL_SLACK * affine.residual
                || rigid.residual <= affine.residual + RESIDUAL_TOLERANCE * displacement;
            let better = if is_rigid { rigid } else { affine };
            let most = RESIDUAL_SLACK * noise + f64::from(config.shared_residual) * displacement;
            (better.residual <= most).then_some(better)
        }
    }
}
