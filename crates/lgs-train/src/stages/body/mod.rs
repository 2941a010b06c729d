//! An object as a body, or a few: some numbers change where it starts, how it starts and the constants of its
//! law.

mod geometry;
mod law;
mod particles;

use std::sync::Arc;

use lgs_core::{GaussianCloud, Stream};
use lgs_dynamics::Supports;
use lgs_model::{Dynamics, LagrangianScene, ObjectModel};

use super::displacement::Displacement;
use super::subset::{choose, supports_of};
use law::LawBody;
use particles::ParticleBody;

/// One object and the units of its unknowns.
pub(super) enum Body {
    /// Particles, with the constants of a linear law.
    Particles(Box<ParticleBody>),
    /// A law in generalised coordinates.
    Law(Box<LawBody>),
    /// A recorded motion, of which nothing is to be found.
    Recorded,
}

/// The centre of a rigid part at a time, and the derivative of its pose by each unknown.
#[derive(Default)]
pub(super) struct Response {
    pub(super) center: [f32; 3],
    /// Displacement per unit of the unknown.
    pub(super) by_unknown: Vec<Displacement>,
}

/// Responses of all parts of a body, by time and part.
pub(super) type Responses = Vec<Vec<Response>>;

/// Positions of particles, by time and particle.
pub(super) type Positions = Vec<Vec<[f32; 3]>>;

impl Body {
    pub(super) fn new(scene: &LagrangianScene, object: usize) -> Self {
        match &scene.objects[object].dynamics {
            _ if scene.objects[object].recording.is_some() => Self::Recorded,
            Dynamics::Particles(particles) => {
                Self::Particles(Box::new(ParticleBody::new(scene, object, &particles.system)))
            }
            Dynamics::Generalised(dynamics) => Self::Law(Box::new(LawBody::new(scene, object, dynamics))),
        }
    }

    /// Root mean square distance from the centre of each of its rigid parts, world units; of a recorded
    /// motion no part is observed.
    pub(super) fn radii(&self) -> Vec<f32> {
        match self {
            Self::Particles(body) => vec![body.radius()],
            Self::Law(body) => body.radii().to_vec(),
            Self::Recorded => Vec::new(),
        }
    }

    /// Whether images of it tell of its shape as well.
    pub(super) fn deforms(&self) -> bool {
        matches!(self, Self::Law(body) if body.deforms())
    }

    pub(super) fn unknowns(&self) -> usize {
        match self {
            Self::Particles(body) => body.unknowns(),
            Self::Law(body) => body.unknowns(),
            Self::Recorded => 0,
        }
    }

    /// Changes an object of a scene, all of it or a part, by so many units of each unknown.
    pub(super) fn change(&self, by: &[f64], scene: &mut LagrangianScene, object: usize) {
        match self {
            Self::Particles(body) => body.change(by, scene, object),
            Self::Law(body) => body.change(by, scene, object),
            Self::Recorded => {}
        }
    }

    /// The parts of the body at some times after a change, with their derivatives by each unknown; `alone` is
    /// a scene of some of its particles.
    pub(super) fn responses(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Responses {
        match self {
            Self::Particles(body) => {
                body.responses(alone, change, times).into_iter().map(|response| vec![response]).collect()
            }
            Self::Law(body) => body.responses(alone, change, times),
            Self::Recorded => times.iter().map(|_| Vec::new()).collect(),
        }
    }

    /// Positions of the particles of `alone` at some times, by time, after a change; none without a law in
    /// generalised coordinates.
    pub(super) fn positions(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Positions {
        match self {
            Self::Law(body) => body.positions(alone, change, times),
            Self::Particles(_) | Self::Recorded => Vec::new(),
        }
    }

    /// Information on the unknowns `[n, n]` in trajectories of particles without any rigid constraint: inner
    /// products of the positions' derivatives, means over the particles, summed over the times.
    pub(super) fn information_of_trajectories(&self, alone: &LagrangianScene, times: &[f32]) -> Vec<f64> {
        match self {
            Self::Particles(body) => body.information_of_trajectories(alone, times),
            Self::Law(body) => body.information_of_trajectories(alone, times),
            Self::Recorded => Vec::new(),
        }
    }
}

/// The scene of at most `subset` particles of one object.
pub(super) fn part_of(
    scene: &LagrangianScene,
    object: usize,
    subset: usize,
    rng: &mut Stream,
) -> LagrangianScene {
    let ObjectModel { members, dynamics, .. } = &scene.objects[object];
    let chosen = choose(members.len(), dynamics.supports().and_then(Supports::common), subset, rng);
    let rows: Vec<usize> = chosen.iter().map(|&i| members.start + i as usize).collect();
    let dynamic_gaussians = scene.dynamic_gaussians.select(&rows);
    let mut dynamics = dynamics.clone();
    if let Dynamics::Generalised(generalised) = &mut dynamics {
        generalised.bodies = generalised.bodies.of(&chosen);
    }
    if let Some(supports) = dynamics.particles_mut().and_then(|particles| particles.supports.as_mut())
        && rows.len() < members.len()
    {
        *supports = Arc::new(supports_of(&chosen, supports, &dynamic_gaussians.means));
    }
    LagrangianScene {
        velocities: rows.iter().map(|&i| scene.velocities[i]).collect(),
        objects: vec![ObjectModel { members: 0..rows.len(), dynamics, recording: None }],
        dynamic_gaussians,
        ..LagrangianScene::still(GaussianCloud::default(), scene.motion, scene.background)
    }
}
