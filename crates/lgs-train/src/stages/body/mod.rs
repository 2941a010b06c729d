//! An object as a body: a few numbers change where it starts, how it starts and the constants of its law.

mod geometry;
mod law;
mod particles;

use lgs_core::{GaussianCloud, Stream};
use lgs_dynamics::Supports;
use lgs_model::{Dynamics, LagrangianScene, ObjectModel};

use super::observation::Displacement;
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

/// A body's centre at a time, and the derivative of its pose by each unknown.
pub(super) struct Response {
    pub(super) center: [f32; 3],
    /// Displacement per unit of the unknown.
    pub(super) by_unknown: Vec<Displacement>,
}

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

    /// Root mean square distance from the centre, world units.
    pub(super) fn radius(&self) -> f32 {
        match self {
            Self::Particles(body) => body.radius(),
            Self::Law(body) => body.radius(),
            Self::Recorded => 1.0,
        }
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

    /// The body at some times after a change, with its derivatives by each unknown; `alone` is a scene of
    /// some of its particles.
    pub(super) fn responses(&self, alone: &LagrangianScene, change: &[f64], times: &[f32]) -> Vec<Response> {
        match self {
            Self::Particles(body) => body.responses(alone, change, times),
            Self::Law(body) => body.responses(alone, change, times),
            Self::Recorded => {
                times.iter().map(|_| Response { center: [0.0; 3], by_unknown: Vec::new() }).collect()
            }
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
    if let Some(supports) = dynamics.particles_mut().and_then(|particles| particles.supports.as_mut())
        && rows.len() < members.len()
    {
        *supports = supports_of(&chosen, supports, &dynamic_gaussians.means);
    }
    LagrangianScene {
        static_gaussians: GaussianCloud::default(),
        velocities: rows.iter().map(|&i| scene.velocities[i]).collect(),
        objects: vec![ObjectModel { members: 0..rows.len(), dynamics, recording: None }],
        dynamic_gaussians,
        ..*scene
    }
}
