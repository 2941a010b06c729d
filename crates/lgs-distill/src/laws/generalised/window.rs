//! Laws drawn from a posterior, by the window that the law was fitted to.
//!
//! A posterior is normal to first order. Where a law is not linear in its unknowns, a change that is likely
//! to first order may leave the window, and is not likely then: dry friction may hold a body fast. Where
//! hardly any change stays, as the unknowns are bound together along a curve, it is the unknowns that bend
//! and not the motion (parameter effects, Bates and Watts 1980), which is followed to first order instead.

use super::observed::ObservedPoses;
use super::placed::Placed;
use crate::motion::pose::Pose;

/// The poses of bodies that a law was fitted to, in the order of its coordinates.
#[derive(Clone)]
pub(super) struct Window {
    bodies: Vec<ObservedPoses>,
    /// χ² of the fitted law.
    least: f64,
}

impl Window {
    /// The window of a law; `None` if its motion cannot be followed.
    pub(super) fn of(placed: &Placed, bodies: Vec<ObservedPoses>) -> Option<Self> {
        let window = Self { bodies, least: 0.0 };
        let least = window.chi_square(placed)?;
        Some(Self { least, ..window })
    }

    fn chi_square(&self, placed: &Placed) -> Option<f64> {
        let poses = placed.poses(&self.bodies[0].times)?;
        let of_body = |(place, body): (usize, &ObservedPoses)| {
            body.chi_square(&poses.iter().map(|of_time| of_time[place]).collect::<Vec<Pose>>())
        };
        Some(self.bodies.iter().enumerate().map(of_body).sum())
    }

    /// How likely another law is, over what it is to first order, to which χ² rises by a square: at most 1,
    /// and 0 if its motion cannot be followed. The variance of the noise is so many times as large as it
    /// looks.
    pub(super) fn probability(&self, changed: &Placed, square: f64, inflation: f64) -> f64 {
        let rise = self.chi_square(changed).map_or(f64::INFINITY, |chi_square| chi_square - self.least);
        (0.5 * (square - rise / inflation)).exp().min(1.0)
    }
}
