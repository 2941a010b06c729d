//! Forecasts of edited motions: laws drawn from what is known of a motion, each with the same edit (method
//! §5.4). A law that explains the motion as it was may say little of another one: thrust and weight that were
//! only ever seen together cannot be told apart once one of them is scaled.

use super::HELD;
use crate::coordinates::{Embedding, State};
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::law::Law;
use crate::system::System;
use glam::DVec3;
use lgs_core::holding;
use serde::{Deserialize, Serialize};

/// A law with the state that its motion starts from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartedLaw {
    /// The law.
    pub law: Law,
    /// Configuration and velocity at t = 0.
    pub start: State,
}

/// Laws drawn from the posterior of one law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawnLaws {
    /// The law in whose posterior they are.
    pub middle: StartedLaw,
    /// For each body of its coordinates, the same body's place in the coordinates of the likeliest law.
    pub order: Vec<usize>,
    /// How far from the middle they are given, as a part of where they were drawn: 1, or little where motions
    /// are followed to first order alone.
    pub part: f64,
    /// The laws.
    pub drawn: Vec<StartedLaw>,
}

/// The posterior of a motion as laws, by which forecasts of edited motions are judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PosteriorLaws {
    /// Draws around the likeliest law, then those around its rivals; each law with as many as its weight asks
    /// for.
    pub laws: Vec<DrawnLaws>,
    /// Duration of the captured window.
    pub window: f64,
    /// Length of the path in the window, world units.
    pub path: f64,
    /// Root mean square radius of the unedited band in the window when the laws were drawn, world units.
    pub radius: f64,
}

/// An edit, and the longest step of the integrator under it.
#[derive(Clone, Copy)]
pub(super) struct Stepped {
    pub(super) scales: Edit,
    pub(super) longest: f64,
}

/// Positions of the points of all bodies of a motion at a time; nothing where it cannot be followed.
type Positions = Option<Vec<DVec3>>;

impl StartedLaw {
    /// Positions at ascending times of points that are given for t = 0, body by body.
    fn positions(&self, edit: Stepped, times: &[f64], points: &[Vec<DVec3>]) -> Vec<Positions> {
        let law = Law { step: self.law.step.min(edit.longest), ..self.law.clone() };
        let system = System::new(&law, edit.scales);
        let embedding = Embedding::new(&law.coordinates, &self.start.x);
        let placed = |state: State| {
            let placed = embedding.placements(&state.x);
            let of_body = placed.iter().zip(points);
            of_body.flat_map(|(place, points)| points.iter().map(|&p| place.apply(p))).collect()
        };
        let states = system.states_followed(&self.start, times);
        states.into_iter().map(|state| state.map(placed)).collect()
    }

    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        self.law.check()?;
        self.law.coordinates.check_state(&self.start)
    }
}

impl DrawnLaws {
    /// Distances of the points of all drawn motions from those of the likeliest one, for each time.
    fn distances(
        &self,
        likeliest: &[Positions],
        (edit, times): (Stepped, &[f64]),
        points: &[Vec<DVec3>],
    ) -> Vec<Vec<f64>> {
        let own: Vec<Vec<DVec3>> = self.order.iter().map(|&body| points[body].clone()).collect();
        let middle = self.middle.positions(edit, times, &own);
        let mut distances = vec![Vec::new(); times.len()];
        for drawn in &self.drawn {
            let drawn = drawn.positions(edit, times, &own);
            for (time, distances) in distances.iter_mut().enumerate() {
                let [Some(middle), Some(drawn), Some(likeliest)] =
                    [&middle[time], &drawn[time], &likeliest[time]]
                else {
                    distances.push(f64::INFINITY);
                    continue;
                };
                let full = middle.iter().zip(drawn).map(|(m, d)| *m + (*d - *m) / self.part);
                let full = in_order(&full.collect::<Vec<_>>(), &self.order, points);
                distances.extend(full.iter().zip(likeliest).map(|(a, b)| a.distance(*b)));
            }
        }
        distances
    }
}

/// Points that are listed by bodies in an order, in the bodies' own.
fn in_order(all: &[DVec3], order: &[usize], points: &[Vec<DVec3>]) -> Vec<DVec3> {
    let mut bodies = vec![&[][..]; points.len()];
    let mut first = 0;
    for &body in order {
        let count = points[body].len();
        bodies[body] = &all[first..first + count];
        first += count;
    }
    bodies.concat()
}

impl PosteriorLaws {
    /// Checks that all laws and states fit together and move so many bodies.
    ///
    /// # Errors
    /// For the first that does not.
    pub fn check(&self, bodies: usize) -> Result<(), MechanicsError> {
        for DrawnLaws { middle, order, part, drawn } in &self.laws {
            let mut sorted = order.clone();
            sorted.sort_unstable();
            let is_order = sorted.iter().copied().eq(0..bodies);
            let all = std::iter::once(middle).chain(drawn);
            all.clone().try_for_each(StartedLaw::check)?;
            let expected = bodies;
            if let Some(law) = all.map(|one| &one.law).find(|law| law.coordinates.bodies() != bodies) {
                let what = "bodies of a drawn law".to_owned();
                return Err(MechanicsError::Size { what, expected, found: law.coordinates.bodies() });
            }
            if !is_order {
                let what = "places in the order of a drawn law's bodies".to_owned();
                return Err(MechanicsError::Size { what, expected, found: order.len() });
            }
            if !(*part > 0.0 && *part <= 1.0) {
                let (what, allowed) = ("the part of drawn laws".to_owned(), "above 0, at most 1".to_owned());
                return Err(MechanicsError::OutOfBounds { what, value: *part, allowed });
            }
        }
        Ok(())
    }

    /// Radius around the edited motion of the likeliest law that holds 90 % of the points of all drawn ones,
    /// at each of some times; infinite where too many cannot be followed.
    pub(super) fn radius(&self, edit: Stepped, times: &[f64], points: &[Vec<DVec3>]) -> Vec<f64> {
        let Some(first) = self.laws.first() else { return vec![f64::INFINITY; times.len()] };
        let likeliest = first.middle.positions(edit, times, points);
        let mut all = vec![Vec::new(); times.len()];
        for law in &self.laws {
            let own = law.distances(&likeliest, (edit, times), points);
            all.iter_mut().zip(own).for_each(|(all, own)| all.extend(own));
        }
        all.into_iter().map(|distances| holding(HELD, distances)).collect()
    }

    /// Multiplies the strengths of the terms of all laws, as far as they are among those of the likeliest
    /// one, which have a factor each.
    pub(super) fn scale_terms(&mut self, factors: &[f64]) {
        let Some(likeliest) = self.laws.first().map(|law| law.middle.law.terms.clone()) else { return };
        for law in &mut self.laws {
            for StartedLaw { law, .. } in std::iter::once(&mut law.middle).chain(&mut law.drawn) {
                let factor = |term| {
                    let place = likeliest.iter().position(|own| own == term);
                    place.and_then(|place| factors.get(place)).copied().unwrap_or(1.0)
                };
                let own: Vec<f64> = law.terms.iter().map(factor).collect();
                // Factors are as many as terms; those that are not allowed leave the law as it is.
                let _ = law.scale_terms(&own);
            }
        }
    }
}
