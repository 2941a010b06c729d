//! Scenes and sources whose motion is known, for tests.

use std::sync::Arc;

use lgs_core::GaussianCloud;
use lgs_core::linear::add;
use lgs_data::frames::FrameSequence;
use lgs_dynamics::{Supports, System, VelocityPolicy};

use crate::scene::{Dynamics, LagrangianScene, MotionConfig, ObjectModel, ParticleDynamics};
use crate::source::ImportedFrames;

/// A scene of one object, whose particles move by a system and are aligned within supports, if there are any.
#[must_use]
pub fn particles(
    dynamic_gaussians: GaussianCloud,
    velocities: Vec<[f32; 3]>,
    system: System,
    supports: Option<Supports>,
) -> LagrangianScene {
    let supports = supports.map(Arc::new);
    let particles = ParticleDynamics { system, supports, velocity_policy: VelocityPolicy::Keep };
    let members = 0..dynamic_gaussians.len();
    LagrangianScene {
        dynamic_gaussians,
        velocities,
        objects: vec![ObjectModel { members, recording: None, dynamics: Dynamics::Particles(particles) }],
        ..LagrangianScene::still(
            GaussianCloud::default(),
            MotionConfig { dt: 0.01, time_window: 0.75 },
            [1.0; 3],
        )
    }
}

/// A source whose Gaussians slide by an offset in a unit of time and do not turn.
#[must_use]
pub fn sliding(gaussians: GaussianCloud, offset: [f32; 3]) -> ImportedFrames {
    let moved = gaussians.means.iter().map(|&mean| add(mean, offset)).collect();
    ImportedFrames::new(FrameSequence {
        times: vec![0.0, 1.0],
        positions: vec![gaussians.means.clone(), moved],
        rotations: vec![gaussians.rotations.clone()],
        gaussians,
    })
}
