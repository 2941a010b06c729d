//! The planes that a body collides with, and the surface by which it does.

use super::plane::Plane;
use super::points::Surface;
use crate::coordinates::Coordinates;
use crate::error::MechanicsError;
use crate::thresholds::{EXPECTED_FRICTION, EXPECTED_RESTITUTION};
use serde::{Deserialize, Serialize};

/// Where the first plane of a contact comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// It was given.
    #[default]
    Given,
    /// Points at rest lie in it.
    Observed,
    /// The impacts of a track tell of it.
    Fitted,
}

/// The planes that a body collides with, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// The plane; the body is on the side that its normal points to.
    pub plane: Plane,
    /// Further planes of the same restitution and friction, each with the body on the side of its normal.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Plane>,
    /// Points of the body that may touch, from its centre, principal axes, world units.
    pub points: Vec<[f64; 3]>,
    /// Radius of the spheres around the points, world units: 0 for corners.
    #[serde(default)]
    pub radius: f64,
    /// Restitution: normal velocity after an impact over the one before, 0 to 1.
    pub restitution: f64,
    /// Coulomb's coefficient of friction.
    pub friction: f64,
    /// Speed of approach below which a contact stays closed, world units per time: that of a fall by less
    /// than the noise of the track, see [`Contact::resting_speed`].
    pub resting_speed: f64,
    /// Standard deviations of restitution and friction; 0 where they are given.
    #[serde(default)]
    pub deviations: [f64; 2],
    /// Where the first plane comes from.
    #[serde(default)]
    pub origin: Origin,
}

impl Contact {
    /// A contact of a surface with a plane whose restitution and friction are to be found.
    #[must_use]
    pub fn of(plane: Plane, surface: &Surface, resting_speed: f64) -> Self {
        let Surface { points, radius } = surface.clone();
        Self {
            plane,
            walls: Vec::new(),
            points,
            radius,
            restitution: 0.0,
            friction: 0.0,
            resting_speed,
            deviations: [0.0; 2],
            origin: Origin::Given,
        }
    }

    /// Speed of a fall by the length `noise` under an acceleration: bounces below it cannot be seen.
    #[must_use]
    pub fn resting_speed(acceleration: f64, noise: f64) -> f64 {
        (2.0 * acceleration * noise).sqrt()
    }

    /// The contact with restitution and friction as they are for most dull solids, where no impact has been
    /// seen: each could be anything between none and twice that.
    #[must_use]
    pub fn expected(plane: Plane, surface: &Surface, resting_speed: f64) -> Self {
        Self {
            restitution: EXPECTED_RESTITUTION,
            friction: EXPECTED_FRICTION,
            deviations: [EXPECTED_RESTITUTION, EXPECTED_FRICTION],
            origin: Origin::Observed,
            ..Self::of(plane, surface, resting_speed)
        }
    }

    /// Checks that coordinates can collide and that all values make sense.
    pub fn check(&self, coordinates: &Coordinates) -> Result<(), MechanicsError> {
        if !matches!(coordinates, Coordinates::Point | Coordinates::Rigid(_)) {
            let (term, port) = ("contact".to_owned(), "plane");
            return Err(MechanicsError::NoSuchPort { term, port, coordinates: coordinates.name() });
        }
        self.planes().try_for_each(Plane::check)?;
        if self.points.is_empty() {
            let what = "points of a contact".to_owned();
            return Err(MechanicsError::Size { what, expected: 1, found: 0 });
        }
        let [restitution, friction] = self.deviations;
        let all = [self.radius, self.friction, self.resting_speed, restitution, friction];
        let numbers = self.points.iter().flatten().map(|value| value.abs()).chain(all);
        for value in numbers.chain([self.restitution, 1.0 - self.restitution]) {
            if !(value >= 0.0 && value.is_finite()) {
                let what = "a value of a contact".to_owned();
                let allowed = "at least 0, a restitution at most 1".to_owned();
                return Err(MechanicsError::OutOfBounds { what, value, allowed });
            }
        }
        Ok(())
    }

    /// All planes: the first one, then the further ones.
    pub fn planes(&self) -> impl Iterator<Item = &Plane> {
        std::iter::once(&self.plane).chain(&self.walls)
    }

    /// Largest distance of the surface from the centre.
    #[must_use]
    pub fn extent(&self) -> f64 {
        let length = |point: &[f64; 3]| point.iter().map(|p| p * p).sum::<f64>().sqrt();
        self.points.iter().map(length).fold(0.0, f64::max) + self.radius
    }
}
