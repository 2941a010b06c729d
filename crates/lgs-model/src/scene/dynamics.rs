//! The dynamics of one object: the paper's particles, or a law in generalised coordinates.

use std::sync::Arc;

use burn::tensor::Device;
use glam::{DVec3, Vec3};
use lgs_core::linear::{add, scale, sub};
use lgs_dynamics::tensor::RolloutCall;
use lgs_dynamics::{Edit, Reversal, RolloutSpec, State, Supports, System, VelocityPolicy, rollout_reversed};
use lgs_mechanics::Law;
use lgs_mechanics::bands::Known;
use lgs_mechanics::coordinates::{self, Bodies};

/// How the particles of an object move.
#[expect(clippy::large_enum_variant, reason = "a scene has a few objects")]
#[derive(Clone, Debug)]
pub enum Dynamics {
    /// Every particle by itself under networks U and Q, aligned after each step (Eq. 4 to 6).
    Particles(ParticleDynamics),
    /// All particles by the few generalised coordinates of a law (method §4.7), of one body or of several
    /// that act on each other.
    Generalised(GeneralisedDynamics),
}

/// The paper's dynamics.
#[derive(Clone, Debug)]
pub struct ParticleDynamics {
    /// U and Q.
    pub system: System,
    /// Supports of local rigid alignment (Eq. 6) within the object, if alignment is on.
    pub supports: Option<Arc<Supports>>,
    /// Velocities after alignment (method §4.6).
    pub velocity_policy: VelocityPolicy,
}

/// A law with its start. The particles' means at t = 0 are their positions in the configuration `start.x`.
#[derive(Clone, Debug, PartialEq)]
pub struct GeneralisedDynamics {
    /// Coordinates, terms and the values of all parameters.
    pub law: Law,
    /// Which particles belong to which body of the coordinates.
    pub bodies: Bodies,
    /// Configuration and velocity at t = 0.
    pub start: coordinates::State,
    /// How well the law is known.
    pub known: Known,
}

/// Energies and accelerations of an object's particles at one time.
#[derive(Clone, Debug, Default)]
pub struct ObjectFields {
    /// Potential energy per particle and unit of its mass, summed over the particles.
    pub potential: f64,
    /// Accelerations `[n, 3]` that the potential causes; for particles `−∇U`, else its generalised force
    /// carried to the particles.
    pub conservative: Vec<[f32; 3]>,
    /// Accelerations `[n, 3]` that the force Q causes.
    pub force: Vec<[f32; 3]>,
    /// Kinetic energy, in the unit of the potential energy.
    pub kinetic: f64,
}

/// A stretch of time, from a state to later or earlier ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// Time of the state that it starts from.
    pub(super) from: f64,
    /// Length of a step, positive.
    pub(super) dt: f32,
    /// Number of steps.
    pub(super) steps: usize,
    /// How to go backwards in time; nothing goes forwards.
    pub(super) reversal: Option<Reversal>,
}

impl Stretch {
    /// Signed times after each step.
    pub(super) fn times(&self) -> Vec<f64> {
        let sign = if self.reversal.is_some() { -1.0 } else { 1.0 };
        (1..=self.steps).map(|step| self.from + sign * step as f64 * f64::from(self.dt)).collect()
    }
}

impl ParticleDynamics {
    /// The states after each step from `start`; the velocity scale of the edit is not applied. Those that go
    /// forwards in time are rolled on a device.
    pub(super) fn advance(
        &self,
        start: &State,
        stretch: Stretch,
        (edit, device): (Edit, &Device),
    ) -> Vec<State> {
        let edit = Edit { velocity_scale: 1.0, ..edit };
        let Self { system, supports, velocity_policy } = self;
        let Stretch { dt, steps, .. } = stretch;
        let mut path = match stretch.reversal {
            Some(reversal) => {
                let (supports, velocity_policy) = (supports.as_deref(), *velocity_policy);
                let spec = RolloutSpec { dt, steps, last_dt: None, edit, supports, velocity_policy };
                rollout_reversed(system, start, &spec, reversal)
            }
            None => {
                let (config, supports, velocity_policy) = (system.config, supports.clone(), *velocity_policy);
                let call = RolloutCall { config, dt, steps, last_dt: None, edit, supports, velocity_policy };
                start.rolled_on(device, &system.params, call)
            }
        };
        path.remove(0);
        path
    }

    /// The velocities that an edited motion starts with, from positions and stored velocities at t = 0.
    pub(super) fn start_velocities(
        &self,
        (q, stored): (&[[f32; 3]], &[[f32; 3]]),
        dt: f32,
        edit: Edit,
    ) -> Vec<[f32; 3]> {
        let half = 0.5 * dt;
        let kick = self.system.accelerations(q, stored, &Edit::default());
        let at_zero = stored.iter().zip(kick).map(|(v, a)| add(*v, scale(a, half)));
        let scaled: Vec<[f32; 3]> = at_zero.map(|v| scale(v, edit.velocity_scale)).collect();
        let edited_kick = self.system.accelerations(q, &scaled, &edit);
        scaled.iter().zip(edited_kick).map(|(v, a)| sub(*v, scale(a, half))).collect()
    }

    fn fields(&self, state: &State) -> ObjectFields {
        ObjectFields {
            potential: self.system.potentials(&state.q).iter().map(|&u| f64::from(u)).sum(),
            conservative: self.system.potential_gradients(&state.q).iter().map(|g| g.map(|x| -x)).collect(),
            force: self.system.forces(&state.q, &state.v),
            kinetic: state.v.iter().map(|&v| 0.5 * wide(v).length_squared()).sum(),
        }
    }
}

impl Dynamics {
    /// The paper's dynamics, if the object has them.
    #[must_use]
    pub fn particles(&self) -> Option<&ParticleDynamics> {
        match self {
            Self::Particles(particles) => Some(particles),
            Self::Generalised(_) => None,
        }
    }

    /// The same, to be changed.
    #[must_use]
    pub fn particles_mut(&mut self) -> Option<&mut ParticleDynamics> {
        match self {
            Self::Particles(particles) => Some(particles),
            Self::Generalised(_) => None,
        }
    }

    /// The law in generalised coordinates, if the object follows one.
    #[must_use]
    pub fn generalised(&self) -> Option<&GeneralisedDynamics> {
        match self {
            Self::Particles(_) => None,
            Self::Generalised(generalised) => Some(generalised),
        }
    }

    /// Supports of local rigid alignment, if there are any.
    #[must_use]
    pub fn supports(&self) -> Option<&Supports> {
        self.particles()?.supports.as_deref()
    }

    /// The potential at places, per mass; nothing where it is no function of a place, as in the angle of a
    /// hinge.
    #[must_use]
    pub fn potentials_at(&self, places: &[[f32; 3]]) -> Option<Vec<f64>> {
        match self {
            Self::Particles(particles) => {
                Some(particles.system.potentials(places).into_iter().map(f64::from).collect())
            }
            Self::Generalised(generalised) => {
                let at = |&place: &[f32; 3]| generalised.at_place(place);
                let states: Option<Vec<coordinates::State>> = places.iter().map(at).collect();
                Some(states?.iter().map(|state| generalised.law.potential_energy(state)).collect())
            }
        }
    }

    /// Gradients of the potential at places, as far as [`Self::potentials_at`] has values.
    #[must_use]
    pub fn potential_gradients_at(&self, places: &[[f32; 3]]) -> Option<Vec<[f32; 3]>> {
        match self {
            Self::Particles(particles) => Some(particles.system.potential_gradients(places)),
            Self::Generalised(generalised) => {
                let system = lgs_mechanics::System::new(&generalised.law, lgs_mechanics::Edit::NONE);
                let gradient = |place: &[f32; 3]| {
                    let [a, _] = system.accelerations(&generalised.at_place(*place)?);
                    Some(narrow(-DVec3::from_slice(&a[a.len() - 3..])))
                };
                places.iter().map(gradient).collect()
            }
        }
    }

    /// Energies and accelerations without an edit, for particles that are at `points` at t = 0 and in `state`
    /// at a time of an edited motion, by another law than the own one if one is given.
    pub(super) fn fields(
        &self,
        points: &[[f32; 3]],
        state: &State,
        (edit, time): (Edit, f64),
        law: Option<&Law>,
    ) -> ObjectFields {
        match self {
            Self::Particles(particles) => particles.fields(state),
            Self::Generalised(generalised) => {
                let law = law.unwrap_or(&generalised.law);
                let configuration = generalised.states_by(law, edit, &[time]).remove(0);
                generalised.fields(points, &configuration)
            }
        }
    }
}

pub(super) fn wide(p: [f32; 3]) -> DVec3 {
    Vec3::from(p).as_dvec3()
}

pub(super) fn narrow(p: DVec3) -> [f32; 3] {
    p.as_vec3().to_array()
}
