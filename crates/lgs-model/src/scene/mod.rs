//! The Lagrangian scene: static Gaussians, dynamic Gaussians with their initial velocity, and the
//! dynamics of each object.
//!
//! Dynamic Gaussians are stored object by object, so that an object is a range of rows. Exports and renders
//! list the static Gaussians first and the dynamic ones behind them, at every time in the same order.

mod contact;
#[cfg(test)]
mod contact_testing;
mod contact_trust;
mod continuation;
mod dynamics;
mod dynamics_file;
mod file;
mod generalised;
mod harmonics;
mod motion;
mod recording;
mod recording_file;
mod shadow;
mod start_velocities;
mod stretch;

use std::ops::Range;

use lgs_core::GaussianCloud;
use serde::{Deserialize, Serialize};

use crate::light::Light;
use crate::shading::Shading;

pub use contact::ObjectContact;
pub use continuation::{Continuation, PartDynamics};
pub use dynamics::{Dynamics, GeneralisedDynamics, ObjectFields, ParticleDynamics};
pub use file::{
    SceneError, insert_cloud, load_scene, read_cloud, save_scene, scene_from_tensors, scene_to_tensors,
};
pub use motion::{Motion, SceneState};
pub use recording::Recording;
pub use shadow::{Projection, Shadow};
pub use stretch::mapped_shape;

/// How the dynamic Gaussians are rolled out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionConfig {
    /// Time step Δτ, in units of normalised time.
    pub dt: f32,
    /// End of the captured window, τ_max.
    pub time_window: f32,
}

impl MotionConfig {
    /// The times that a scene can be asked for: from −τ_max to 3 τ_max.
    #[must_use]
    pub fn time_range(&self) -> (f32, f32) {
        (-self.time_window, 3.0 * self.time_window)
    }
}

/// One object: the dynamic Gaussians that move together, and how.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    /// Rows of the dynamic Gaussians.
    pub members: Range<usize>,
    /// Its potential and force, and the coordinates in which they act.
    pub dynamics: Dynamics,
    /// Its motion inside the captured window if no law describes it; without an edit it is played there, and
    /// the dynamics carry it on at most ([`Continuation`]).
    pub recording: Option<Recording>,
}

/// A trained scene whose motion is a Lagrangian system.
#[derive(Clone, Debug)]
pub struct LagrangianScene {
    /// Gaussians that never move.
    pub static_gaussians: GaussianCloud,
    /// Dynamic Gaussians as they are at t = 0, object by object.
    pub dynamic_gaussians: GaussianCloud,
    /// Initial velocity of each dynamic Gaussian, world units per unit of time.
    pub velocities: Vec<[f32; 3]>,
    /// Objects in the order of their rows.
    pub objects: Vec<ObjectModel>,
    /// Objects that hit each other, if any were seen to.
    pub contact: Option<ObjectContact>,
    /// Objects that are shadows of others.
    pub shadows: Vec<Shadow>,
    /// How the Gaussians are lit over time, static first, then dynamic; nothing where colours are constant.
    pub shading: Option<Shading>,
    /// The light in which the dynamic Gaussians turn, if it is known.
    pub light: Option<Light>,
    /// Integration settings.
    pub motion: MotionConfig,
    /// Colour behind the Gaussians.
    pub background: [f32; 3],
}

impl LagrangianScene {
    /// A scene of Gaussians that never move.
    #[must_use]
    pub fn still(static_gaussians: GaussianCloud, motion: MotionConfig, background: [f32; 3]) -> Self {
        Self {
            dynamic_gaussians: static_gaussians.select(&[]),
            static_gaussians,
            velocities: Vec::new(),
            objects: Vec::new(),
            contact: None,
            shadows: Vec::new(),
            shading: None,
            light: None,
            motion,
            background,
        }
    }

    /// Number of Gaussians, static and dynamic.
    #[must_use]
    pub fn len(&self) -> usize {
        self.static_gaussians.len() + self.dynamic_gaussians.len()
    }

    /// Whether the scene has no Gaussian at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All Gaussians, the dynamic ones in `state`, in the colours of a time: static first, then dynamic,
    /// object by object.
    #[must_use]
    pub fn cloud_at(&self, state: &SceneState, time: f32) -> GaussianCloud {
        let mut cloud = self.static_gaussians.clone();
        if cloud.is_empty() {
            cloud.sh_degree = self.dynamic_gaussians.sh_degree;
        }
        cloud.means.extend_from_slice(&state.q);
        let (rotations, log_scales) = self.shapes_at(state);
        cloud.rotations.extend(rotations);
        cloud.log_scales.extend(log_scales);
        cloud.raw_opacities.extend_from_slice(&self.dynamic_gaussians.raw_opacities);
        cloud.sh.extend_from_slice(&self.dynamic_gaussians.sh);
        let first = self.static_gaussians.len();
        for (rows, turn) in self.turned_bodies(state) {
            cloud.turn_harmonics(first + rows.start..first + rows.end, turn);
        }
        if let Some(shading) = &self.shading {
            shading.shade(&mut cloud, time);
        }
        if let Some(light) = &self.light {
            light.shade(&mut cloud, state);
        }
        cloud
    }
}
