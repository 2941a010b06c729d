//! Joints of one body with the world.

use super::{Inertia, InertiaForm};
use crate::parameter::Parameter;
use crate::thresholds::INERTIA_SPREAD;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A body that turns by `θ` about a fixed axis: `q = pivot + exp(θ axis) (q₀ − pivot)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    /// Unit vector, world axes.
    pub axis: [f64; 3],
    /// A point on the axis, world units.
    pub pivot: [f64; 3],
}

/// A body that moves by `s` along a line: `q = q₀ + s direction`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slider {
    /// Unit vector, world axes.
    pub direction: [f64; 3],
}

/// A round body that rolls by `s` along a line: its centre moves by `s direction`, and it turns by
/// `s / radius` about the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rolling {
    /// Unit vector along which the centre moves, world axes.
    pub direction: [f64; 3],
    /// Unit vector about which the body turns, world axes.
    pub axis: [f64; 3],
    /// Path of the centre per radian, world units.
    pub radius: f64,
    /// Centre at `s = 0`, world units.
    pub center: [f64; 3],
}

/// A body that turns about a fixed point, with its inertia about that point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// The fixed point, world units.
    pub pivot: [f64; 3],
    /// From the pivot to the centre, principal axes of the inertia, world units; where the law's parameters
    /// have its direction, before these, see [`Ball::arm`].
    pub arm: [f64; 3],
    /// Inertia about the pivot.
    pub inertia: Inertia,
}

impl Ball {
    /// Parameters of the inertia, then those of the direction to the centre, where there is one.
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        let mut all = self.inertia.parameters();
        if self.inertia.form == InertiaForm::Whole && DVec3::from(self.arm) != DVec3::ZERO {
            let across = |name| Parameter::nonlinear(name, 0, 0).spread(INERTIA_SPREAD);
            all.extend(["arm-1", "arm-2"].map(across));
        }
        all
    }

    /// From the pivot to the centre with a law's parameters, in the axes of the prior.
    #[must_use]
    pub fn arm(&self, p: &[f64]) -> DVec3 {
        let slopes = self.arm_slopes().into_iter().zip(p);
        DVec3::from(self.arm) + slopes.map(|(slope, value)| slope * *value).sum::<DVec3>()
    }

    /// Derivatives of the vector to the centre by each of the coordinates' parameters.
    pub(crate) fn arm_slopes(&self) -> Vec<DVec3> {
        let arm = DVec3::from(self.arm);
        let mut slopes = vec![DVec3::ZERO; self.parameters().len()];
        let length = arm.length();
        match self.inertia.form {
            // The centre lies on the axis of a round body.
            InertiaForm::Round => slopes[1..].copy_from_slice(&[DVec3::X * length, DVec3::Y * length]),
            InertiaForm::Whole if length > 0.0 => {
                let (first, second) = (arm / length).any_orthonormal_pair();
                let own = slopes.len() - 2;
                slopes[own..].copy_from_slice(&[first * length, second * length]);
            }
            _ => {}
        }
        slopes
    }
}
