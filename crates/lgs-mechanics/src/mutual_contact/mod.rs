//! Contact between bodies: round ones that hit each other (method §5.9).
//!
//! Between hits each body moves by its own law, in whatever coordinates this has, and bounces off its own
//! planes. Two bodies hit where the spheres of their surfaces touch. The impulses of a hit are equal and
//! opposite: along the line of the centres by the restitution, across it by Coulomb's friction; the masses of
//! the bodies share them.

mod fit;
mod hit;
mod motion;
#[cfg(test)]
mod motion_tests;
mod posterior;
mod seen;
mod sphere;
mod thresholds;

pub use fit::{SeenContact, mutual_contact};
pub use motion::Moving;
pub use seen::SeenBody;
pub use sphere::SurfaceGaussian;

use crate::error::MechanicsError;
use serde::{Deserialize, Serialize};

/// Round bodies that may hit each other, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MutualContact {
    /// The bodies, in the order of their motions.
    pub bodies: Vec<RoundBody>,
    /// Restitution: speed at which two bodies part along the line of their centres over that at which they
    /// approach, 0 to 1.
    pub restitution: f64,
    /// Coulomb's coefficient of friction.
    pub friction: f64,
    /// Standard deviations of restitution and friction.
    #[serde(default)]
    pub deviations: [f64; 2],
}

/// One of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundBody {
    /// Centre of its sphere at t = 0, world units; the sphere moves with the points of the body.
    pub center: [f64; 3],
    /// Radius, world units.
    pub radius: f64,
    /// Its mass over that of the first body; for a body about a hinge or a pivot, its moment of inertia, in
    /// the units of that mass.
    pub mass: f64,
    /// Which impulses of its law are hits by others of these bodies.
    #[serde(default)]
    pub hits: Vec<usize>,
}

impl MutualContact {
    /// Checks that all values make sense.
    ///
    /// # Errors
    /// If there are fewer than two bodies, or a value is not finite or out of its bounds.
    pub fn check(&self) -> Result<(), MechanicsError> {
        if self.bodies.len() < 2 {
            let (what, found) = ("bodies of a contact".to_owned(), self.bodies.len());
            return Err(MechanicsError::Size { what, expected: 2, found });
        }
        let bounded = |what: &str, value: f64, allowed: &str, is_in: bool| {
            let (what, allowed) = (what.to_owned(), allowed.to_owned());
            let error = MechanicsError::OutOfBounds { what, value, allowed };
            if is_in && value.is_finite() { Ok(()) } else { Err(error) }
        };
        for body in &self.bodies {
            bounded("radius of a body", body.radius, "a positive number", body.radius > 0.0)?;
            bounded("mass of a body", body.mass, "a positive number", body.mass > 0.0)?;
            for value in body.center {
                bounded("centre of a body", value, "a finite number", true)?;
            }
        }
        let [restitution, friction] = [self.restitution, self.friction];
        bounded("restitution", restitution, "0 to 1", (0.0..=1.0).contains(&restitution))?;
        bounded("friction", friction, "at least 0", friction >= 0.0)?;
        self.deviations.iter().try_for_each(|&value| bounded("deviation", value, "at least 0", value >= 0.0))
    }

    /// Whether another contact is one of as many bodies with the same hits.
    #[must_use]
    pub fn has_hits_of(&self, other: &Self) -> bool {
        self.bodies.iter().map(|body| &body.hits).eq(other.bodies.iter().map(|body| &body.hits))
    }

    /// All pairs of bodies, the first one before the second.
    fn pairs(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let count = self.bodies.len();
        (0..count).flat_map(move |first| (first + 1..count).map(move |second| [first, second]))
    }
}
