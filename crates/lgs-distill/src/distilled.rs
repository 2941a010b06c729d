//! The result of stage 1 for one object.

use crate::report::DistillReport;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{narrow, wide};
use lgs_dynamics::{RolloutSpec, Supports, System, VelocityPolicy, rollout};
use lgs_mechanics::bands::{Known, Verdict};
use lgs_mechanics::coordinates::{Bodies, Embedding, Placement, State};
use lgs_mechanics::{self as mechanics, Law};
use std::ops::Range;

/// The dynamics of an object with the state that it starts from.
#[derive(Clone, Debug)]
pub enum Distilled {
    /// Every particle by itself under U and Q.
    Particles(Box<DistilledParticles>),
    /// All particles by the generalised coordinates of a law.
    Generalised(Box<DistilledLaw>),
}

/// An object that follows a law in generalised coordinates.
#[derive(Clone, Debug)]
pub struct DistilledLaw {
    /// Coordinates, terms and the values of all parameters.
    pub law: Law,
    /// Configuration and velocity at the first sample.
    pub start: State,
    /// Which particles belong to which body of the coordinates.
    pub bodies: Bodies,
    /// Rotation and shift of the shape of each body at the first sample.
    pub bases: Vec<(DMat3, DVec3)>,
    /// How well the law is known.
    pub known: Known,
    /// `[n]` positions at the first sample, world units.
    pub q0: Vec<[f32; 3]>,
    /// `[n]` velocities at the first sample, world units per unit of time.
    pub v0: Vec<[f32; 3]>,
    /// Figures of the distillation.
    pub report: DistillReport,
}

impl Distilled {
    /// `[n]` positions at the first sample, world units.
    #[must_use]
    pub fn q0(&self) -> &[[f32; 3]] {
        match self {
            Self::Particles(particles) => &particles.q0,
            Self::Generalised(law) => &law.q0,
        }
    }

    /// `[n]` velocities that the motion starts with, world units per unit of time.
    #[must_use]
    pub fn v0(&self) -> &[[f32; 3]] {
        match self {
            Self::Particles(particles) => &particles.v0,
            Self::Generalised(law) => &law.v0,
        }
    }

    /// Figures of the distillation.
    #[must_use]
    pub fn report(&self) -> &DistillReport {
        match self {
            Self::Particles(particles) => &particles.report,
            Self::Generalised(law) => &law.report,
        }
    }

    /// The object as particles, if it is one of particles.
    pub(crate) fn particles(&self) -> Option<&DistilledParticles> {
        match self {
            Self::Particles(particles) => Some(particles),
            Self::Generalised(_) => None,
        }
    }

    /// Positions of all particles after 0 to `steps` steps of `dt`, under the constraint that stage 1 has
    /// found them with.
    #[must_use]
    pub fn rolled(&self, dt: f32, steps: usize) -> Vec<Vec<[f32; 3]>> {
        match self {
            Self::Particles(particles) => particles.rolled(RolloutSpec::new(dt, steps)),
            Self::Generalised(law) => {
                let times: Vec<f64> = (0..=steps).map(|step| f64::from(dt) * step as f64).collect();
                law.edited(mechanics::Edit::NONE, &times)
            }
        }
    }

    /// Groups of particles that stay together in any order: the bodies of a law, else all particles.
    #[must_use]
    pub fn ranges(&self) -> Vec<Range<usize>> {
        match self {
            Self::Particles(particles) => Bodies::default().ranges(particles.q0.len()),
            Self::Generalised(law) => law.bodies.ranges(law.q0.len()),
        }
    }

    /// The same with its particles in another order within their groups: index of the first, of the second,
    /// …, each particle once.
    #[must_use]
    pub fn in_order(self, order: &[u32]) -> Self {
        match self {
            Self::Particles(particles) => Self::Particles(Box::new(particles.in_order(order))),
            Self::Generalised(law) => {
                let (q0, v0) = (in_order(&law.q0, order), in_order(&law.v0, order));
                Self::Generalised(Box::new(DistilledLaw { q0, v0, ..*law }))
            }
        }
    }
}

fn in_order(rows: &[[f32; 3]], order: &[u32]) -> Vec<[f32; 3]> {
    order.iter().map(|&particle| rows[particle as usize]).collect()
}

/// An object of particles: a system with the state that it starts from.
#[derive(Clone, Debug)]
pub struct DistilledParticles {
    /// U and Q.
    pub system: System,
    /// `[n]` positions at the first sample, world units.
    pub q0: Vec<[f32; 3]>,
    /// `[n]` velocities that Eq. 5 starts from, world units per unit of time.
    pub v0: Vec<[f32; 3]>,
    /// Members of the support that all particles share, if the object is under the rigid constraint.
    pub shared_support: Option<Vec<u32>>,
    /// Figures of the distillation.
    pub report: DistillReport,
}

impl DistilledLaw {
    /// Positions of all particles under an edit at some times, as far as the law can be followed, with a step
    /// that resolves the edited motion.
    #[must_use]
    pub fn edited(&self, edit: mechanics::Edit, times: &[f64]) -> Vec<Vec<[f32; 3]>> {
        let embedding = Embedding::new(&self.law.coordinates, &self.start.x);
        let placed = |state: State| {
            let placed: Vec<Placement> = embedding.placements(&state.x);
            let at = |body: usize, row: usize| narrow(placed[body].apply(wide(self.q0[row])));
            self.bodies.of_points(self.q0.len(), at)
        };
        let law = self.law.under(edit, &self.start, times.last().copied().unwrap_or_default());
        let states = mechanics::System::new(&law, edit).states(&self.start, times);
        states.unwrap_or_default().into_iter().map(placed).collect()
    }

    /// The same with its bodies' particles in another order: the first body is the one with the first index
    /// among them, and so on.
    pub(crate) fn with_bodies_at(self, order: &[usize]) -> Self {
        let own = self.bodies.ranges(self.q0.len());
        let mut ranges = own.clone();
        order.iter().zip(&own).for_each(|(&at, rows)| ranges[at] = rows.clone());
        let sizes: Vec<usize> = ranges.iter().map(ExactSizeIterator::len).collect();
        let rows: Vec<u32> = ranges.into_iter().flatten().map(|row| row as u32).collect();
        let (q0, v0) = (in_order(&self.q0, &rows), in_order(&self.v0, &rows));
        Self { q0, v0, bodies: Bodies::of_sizes(&sizes).taken_in_order(order), ..self }
    }

    /// Times between which the forecast of an edited motion is trusted: none where the law does not explain
    /// the motion, those of the unedited one where no laws were drawn to judge edits by.
    #[must_use]
    pub fn trusted_under(&self, edit: mechanics::Edit) -> [f64; 2] {
        if self.known.verdict != Verdict::Explained {
            return [0.0; 2];
        }
        let under = self.known.trusted_under(edit, (&self.law, &self.start), (&self.bodies, &self.q0));
        under.unwrap_or(self.known.trusted)
    }
}

impl DistilledParticles {
    fn rolled(&self, spec: RolloutSpec<'_>) -> Vec<Vec<[f32; 3]>> {
        let supports = self.shared_support.as_ref().map(|_| self.supports(0));
        let spec = match &supports {
            Some(supports) => spec.aligned(supports, VelocityPolicy::Rigid),
            None => spec,
        };
        let start = lgs_dynamics::State::at_start(self.q0.clone(), self.v0.clone());
        rollout(&self.system, &start, &spec).into_iter().map(|state| state.q).collect()
    }

    /// Supports for Eq. 6: the shared one for every particle under the rigid constraint, else `k` nearest
    /// neighbours.
    ///
    /// Shared supports belong with [`lgs_dynamics::VelocityPolicy::Rigid`].
    #[must_use]
    pub fn supports(&self, k: usize) -> Supports {
        match &self.shared_support {
            Some(members) => Supports::shared(members, self.q0.len()),
            None => Supports::nearest(&self.q0, k),
        }
    }

    fn in_order(self, order: &[u32]) -> Self {
        let mut place = vec![0; order.len()];
        for (at, &particle) in (0..).zip(order) {
            place[particle as usize] = at;
        }
        let shared_support =
            self.shared_support.map(|members| members.iter().map(|&member| place[member as usize]).collect());
        Self { q0: in_order(&self.q0, order), v0: in_order(&self.v0, order), shared_support, ..self }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let finite = |rows: &[[f32; 3]]| rows.as_flattened().iter().all(|v| v.is_finite());
        finite(&self.q0) && finite(&self.v0) && self.system.params.iter().all(|p| p.is_finite())
    }
}
