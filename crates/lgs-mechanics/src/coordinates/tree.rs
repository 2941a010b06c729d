//! A chain of two bodies on parallel hinges: the double pendulum.
//!
//! With absolute angles `x = (θ₁, θ₂)` the kinetic energy of any two rigid bodies on parallel hinges is, in
//! units of the first one's inertia about the first pivot, `½ v·M v` with
//!
//! ```text
//! M = [ 1                    c cos(θ₁ − θ₂ + φ) ]
//!     [ c cos(θ₁ − θ₂ + φ)   b                  ],      c² < b,
//! ```
//!
//! where `b` is the second body's share of inertia, `c` the coupling, and `φ` the angle between the first
//! body's link and the second one's centre at zero angles. Gravity is a Fourier term on each angle.

use super::State;
use crate::parameter::Parameter;
use serde::{Deserialize, Serialize};

/// Two bodies on parallel hinges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tree {
    /// Unit vector of both hinges, world axes.
    pub axis: [f64; 3],
    /// A point on the first hinge, world units.
    pub pivot: [f64; 3],
    /// From the first hinge to the second at zero angles, world units.
    pub link: [f64; 3],
    /// From the second hinge to the second body's centre at zero angles, world units.
    pub arm: [f64; 3],
}

impl Tree {
    /// Parameters `b`, the correlation `c / √b`, and the phase `φ`.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        vec![
            Parameter::nonlinear("inertia-ratio", 0, 0).within(1e-3, 1e3),
            Parameter::nonlinear("coupling", 0, 0).within(-0.999, 0.999),
            Parameter::nonlinear("phase", 0, 0).within(-3.2, 3.2),
        ]
    }

    /// Two equal point masses on equal massless links, with the phase of the geometry.
    #[must_use]
    pub fn start(&self) -> Vec<f64> {
        vec![0.5, std::f64::consts::FRAC_1_SQRT_2, self.phase()]
    }

    /// The angle from the arm to the link about the axis, at zero angles.
    #[must_use]
    pub fn phase(&self) -> f64 {
        let [axis, link, arm] = [self.axis, self.link, self.arm].map(glam::DVec3::from_array);
        axis.dot(arm.cross(link)).atan2(arm.dot(link) - axis.dot(arm) * axis.dot(link))
    }
}

impl Tree {
    /// The matrix `M` and its derivatives `∂c(θ)/∂(θ₁ − θ₂)`: inertia ratio `b`, `c cos`, `−c sin`.
    pub(crate) fn mass(p: &[f64], x: &[f64]) -> [f64; 3] {
        let coupling = p[1] * p[0].sqrt();
        let (sine, cosine) = (x[0] - x[1] + p[2]).sin_cos();
        [p[0], coupling * cosine, -coupling * sine]
    }

    /// `½ v · M v`.
    pub(crate) fn kinetic_energy(&self, p: &[f64], state: &State) -> f64 {
        let [ratio, mixed, _] = Self::mass(p, &state.x);
        let [first, second] = [state.v[0], state.v[1]];
        0.5 * (first * first + ratio * second * second) + mixed * first * second
    }
}
