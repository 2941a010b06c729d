//! How an object moves that follows a law: states, particles carried by them, energies.

use super::dynamics::{GeneralisedDynamics, ObjectFields, narrow, wide};
use glam::DVec3;
use lgs_dynamics::{Edit, State};
use lgs_mechanics::coordinates::{self, Coordinates, Embedding};
use lgs_mechanics::{Law, MechanicsError};
use std::borrow::Cow;

impl GeneralisedDynamics {
    /// Configurations and velocities at some times. Where the motion cannot be followed (the past of a body
    /// that friction has brought to rest is not determined), it stays as it was at the last time where it
    /// can.
    #[must_use]
    pub fn states(&self, edit: Edit, times: &[f64]) -> Vec<coordinates::State> {
        self.states_by(&self.law, edit, times)
    }

    /// The law with a step that resolves an edited motion up to a time, see [`Law::under`].
    pub(super) fn law_under(&self, edit: Edit, until: f64) -> Cow<'_, Law> {
        self.law.under(exact(edit), &self.start, until)
    }

    /// [`Self::states`] by a law that differs from the own one in its step.
    pub(super) fn states_by(&self, law: &Law, edit: Edit, times: &[f64]) -> Vec<coordinates::State> {
        let system = lgs_mechanics::System::new(law, exact(edit));
        if let Ok(states) = system.states(&self.start, times) {
            return states;
        }
        let at = |&time: &f64| match system.states(&self.start, &[time]) {
            Ok(mut states) => states.remove(0),
            Err(MechanicsError::Undetermined { time }) => {
                let last = system.states(&self.start, &[time]).map(|mut states| states.remove(0));
                last.unwrap_or_else(|_| self.start.clone())
            }
            Err(_) => self.start.clone(),
        };
        times.iter().map(at).collect()
    }

    /// Multiplies the strengths of the terms of the law, and of those that are drawn from its posterior, by a
    /// factor for each.
    ///
    /// # Errors
    /// If there are not as many factors as terms, or one is negative or not finite.
    pub fn scale_terms(&mut self, factors: &[f64]) -> Result<(), MechanicsError> {
        self.law.scale_terms(factors)?;
        self.known.scale_terms(factors);
        Ok(())
    }

    /// The same with the record of its own impacts up to a time, by which the way back past them is known.
    #[must_use]
    pub fn with_impacts(mut self, until: f64) -> Self {
        if self.law.contact.is_some() {
            let system = lgs_mechanics::System::new(&self.law, lgs_mechanics::Edit::NONE);
            self.law.impacts = system.impacts(&self.start, until).unwrap_or_default();
        }
        self
    }

    /// Particles that are at `points` at t = 0, in a configuration.
    #[must_use]
    pub fn placed(&self, points: &[[f32; 3]], state: &coordinates::State) -> State {
        let embedding = Embedding::new(&self.law.coordinates, &self.start.x);
        let (placed, rates) = (embedding.placements(&state.x), embedding.rates(&state.x, &state.v));
        let turn = |body: usize| {
            let turn = placed[body].rotation;
            [turn.w, turn.x, turn.y, turn.z].map(|c| c as f32)
        };
        let n = points.len();
        State {
            q: self.bodies.of_points(n, |body, row| narrow(placed[body].apply(wide(points[row])))),
            v: self.bodies.of_points(n, |body, row| narrow(rates[body].apply(wide(points[row])))),
            rotation: self.bodies.of_points(n, |body, _| turn(body)),
        }
    }

    /// Velocities at t = 0 of particles at `points`, those of an edited motion with α.
    #[must_use]
    pub fn start_velocities(&self, points: &[[f32; 3]], edit: Edit) -> Vec<[f32; 3]> {
        let mut start = self.start.clone();
        start.v.iter_mut().for_each(|v| *v *= f64::from(edit.velocity_scale));
        self.placed(points, &start).v
    }

    /// The object at rest with its centre at a place; nothing where the coordinates have no free centre.
    pub(super) fn at_place(&self, place: [f32; 3]) -> Option<coordinates::State> {
        let mut state = self.start.clone();
        state.v.fill(0.0);
        let first = match self.law.coordinates {
            Coordinates::Point => 0,
            Coordinates::Rigid(_) => 4,
            _ => return None,
        };
        state.x[first..first + 3].copy_from_slice(&place.map(f64::from));
        Some(state)
    }

    /// Energies and accelerations of particles that are at `points` at t = 0.
    pub(super) fn fields(&self, points: &[[f32; 3]], state: &coordinates::State) -> ObjectFields {
        let system = lgs_mechanics::System::new(&self.law, lgs_mechanics::Edit::NONE);
        let [conservative, force] = system
            .accelerations(state)
            .map(|a| self.carried(points, state, &a).into_iter().map(narrow).collect());
        let inertia = self.inertia(points, state);
        ObjectFields {
            potential: self.law.potential_energy(state) * inertia,
            conservative,
            force,
            kinetic: self.law.kinetic_energy(state) * inertia,
        }
    }

    /// A change of the configuration carried to particles that are at `points` at t = 0.
    #[must_use]
    pub fn carried(&self, points: &[[f32; 3]], state: &coordinates::State, change: &[f64]) -> Vec<DVec3> {
        let rates = Embedding::new(&self.law.coordinates, &self.start.x).rates(&state.x, change);
        self.bodies.of_points(points.len(), |body, row| rates[body].apply(wide(points[row])))
    }

    /// Kinetic energy of the particles, of unit mass each, over that of the law: the number of particles
    /// where the law's energies are per mass (of the first body), their moment of inertia where they are per
    /// moment of inertia about the first hinge.
    fn inertia(&self, points: &[[f32; 3]], state: &coordinates::State) -> f64 {
        let mut change = vec![0.0; state.v.len()];
        match self.law.coordinates {
            Coordinates::Tree(_) => change[0] = 1.0,
            _ if change.len() == 1 => change[0] = 1.0,
            _ => return self.bodies.ranges(points.len())[0].len() as f64,
        }
        self.carried(points, state, &change).iter().map(|rate| rate.length_squared()).sum()
    }
}

/// An edit in double precision.
pub(super) fn exact(edit: Edit) -> lgs_mechanics::Edit {
    lgs_mechanics::Edit {
        velocity: f64::from(edit.velocity_scale),
        potential: f64::from(edit.potential_scale),
        force: f64::from(edit.force_scale),
    }
}
