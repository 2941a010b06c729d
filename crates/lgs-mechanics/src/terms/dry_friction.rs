//! Dry friction: `Q = −μ w / √(w² + ε²)`, of constant size while the body moves.
//!
//! Below the creeping speed `ε` the force fades, so that a motion comes to rest instead of turning around.
//! Having come to rest, a motion forgets where it came from: backward in time it is determined only while it
//! slides.

use super::kind::{At, Derivatives, Role, TermKind, default_start};
use super::quadratic::dot;
use crate::parameter::{Entry, Parameter, Scales, Space};
use crate::thresholds::CREEPING;

/// The kind `dry-friction`.
pub(super) const DRY_FRICTION: DryFriction = DryFriction;

/// Dry friction.
#[derive(Debug)]
pub(super) struct DryFriction;

impl TermKind for DryFriction {
    fn name(&self) -> &'static str {
        "dry-friction"
    }

    fn role(&self) -> Role {
        Role::Dissipates
    }

    fn suits(&self, _space: Space) -> bool {
        true
    }

    fn parameters(&self, _space: Space) -> Vec<Parameter> {
        let creeping = Parameter::nonlinear("creeping-speed", 1, -1).within(0.0, f64::INFINITY);
        vec![
            Parameter::linear("deceleration", 1, -2).within(0.0, f64::INFINITY),
            Parameter { entry: Entry::Constant, ..creeping },
        ]
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let speed = (dot(at.w, at.w) + p[1] * p[1]).sqrt().max(f64::MIN_POSITIVE);
        force.iter_mut().zip(at.w).for_each(|(f, w)| *f = -p[0] * w / speed);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let speed = (dot(at.w, at.w) + p[1] * p[1]).sqrt().max(f64::MIN_POSITIVE);
        for i in 0..at.w.len() {
            for j in 0..at.w.len() {
                let same = f64::from(u8::from(i == j));
                out.w[(i, j)] = -p[0] * (same - at.w[i] * at.w[j] / (speed * speed)) / speed;
            }
            out.p[(i, 0)] = -at.w[i] / speed;
            out.p[(i, 1)] = p[0] * at.w[i] * p[1] / speed.powi(3);
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let parameters = self.parameters(space);
        let mut start = default_start(&parameters, space, scales);
        start[1] = CREEPING * scales.of(&parameters[1], space);
        vec![start]
    }
}
