//! Drag: forces against the velocity, `Q = −c(|w|) w`, the same in all directions.
//!
//! - Linear drag: `c = d`.
//! - Quadratic drag, as of a fast body in air: `c = k |w|`.
//! - Dry friction, of constant size while the body moves: `c = μ / √(w² + ε²)`. Below the creeping speed `ε`
//!   the force fades, so that a motion comes to rest instead of turning around. Having come to rest, a motion
//!   forgets where it came from: backward in time it is determined only while it slides.

use super::kind::{At, Derivatives, Label, Role, TermKind, default_start};
use super::quadratic::dot;
use crate::parameter::{Entry, Parameter, Scales, Space};
use crate::thresholds::CREEPING;

/// The kind `linear-drag`.
pub(super) const LINEAR: Drag = Drag { name: "linear-drag", growth: Growth::Constant };
/// The kind `quadratic-drag`.
pub(super) const QUADRATIC: Drag = Drag { name: "quadratic-drag", growth: Growth::Proportional };
/// The kind `dry-friction`.
pub(super) const DRY: Drag = Drag { name: "dry-friction", growth: Growth::Inverse };

/// A drag.
#[derive(Debug)]
pub(super) struct Drag {
    name: &'static str,
    growth: Growth,
}

/// How the coefficient `c` depends on the speed.
#[derive(Debug)]
enum Growth {
    Constant,
    Proportional,
    Inverse,
}

/// The coefficient at a velocity.
struct Coefficient {
    value: f64,
    /// Derivative by the speed, divided by the speed.
    slope: f64,
    /// Derivatives by the parameters.
    by_parameter: [f64; 2],
}

impl Drag {
    fn coefficient(&self, p: &[f64], w: &[f64]) -> Coefficient {
        match self.growth {
            Growth::Constant => Coefficient { value: p[0], slope: 0.0, by_parameter: [1.0, 0.0] },
            Growth::Proportional => {
                let speed = dot(w, w).sqrt();
                // The derivative at rest is zero, whatever the direction.
                let slope = if speed > 0.0 { p[0] / speed } else { 0.0 };
                Coefficient { value: p[0] * speed, slope, by_parameter: [speed, 0.0] }
            }
            Growth::Inverse => {
                let speed = (dot(w, w) + p[1] * p[1]).sqrt().max(f64::MIN_POSITIVE);
                let slope = -p[0] / speed.powi(3);
                Coefficient { value: p[0] / speed, slope, by_parameter: [1.0 / speed, slope * p[1]] }
            }
        }
    }
}

impl TermKind for Drag {
    fn label(&self) -> Label {
        Label { name: self.name, role: Role::Dissipates }
    }

    fn suits(&self, _space: Space) -> bool {
        true
    }

    fn parameters(&self, _space: Space) -> Vec<Parameter> {
        let factor = match self.growth {
            Growth::Constant => Parameter::linear("rate", 0, -1),
            Growth::Proportional => Parameter::linear("drag", -1, 0),
            Growth::Inverse => Parameter::linear("deceleration", 1, -2),
        };
        let creeping = matches!(self.growth, Growth::Inverse)
            .then(|| Parameter { entry: Entry::Constant, ..Parameter::nonlinear("creeping-speed", 1, -1) });
        [factor].into_iter().chain(creeping).map(|p| p.within(0.0, f64::INFINITY)).collect()
    }

    /// A point that rubs lies on a surface, whose normal has two. A body that comes to rest on one and a body
    /// that is thrown up are then told apart by no more than the direction of what slows them down.
    fn assumed_unknowns(&self, space: Space) -> usize {
        let is_on_surface = matches!(self.growth, Growth::Inverse) && space == Space::PLACE;
        if is_on_surface { 2 } else { 0 }
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let c = self.coefficient(p, at.w).value;
        force.iter_mut().zip(at.w).for_each(|(f, w)| *f = -c * w);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let Coefficient { value, slope, by_parameter } = self.coefficient(p, at.w);
        for (i, w) in at.w.iter().enumerate() {
            for (j, other) in at.w.iter().enumerate() {
                out.w[(i, j)] = -slope * w * other - if i == j { value } else { 0.0 };
            }
            (0..p.len()).for_each(|parameter| out.p[(i, parameter)] = -by_parameter[parameter] * w);
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let parameters = self.parameters(space);
        let mut start = default_start(&parameters, space, scales);
        if let ([_, value], [_, creeping]) = (&mut start[..], &parameters[..]) {
            *value = CREEPING * scales.of(creeping, space);
        }
        vec![start]
    }
}

#[cfg(test)]
mod tests {
    use super::{At, DRY, QUADRATIC, TermKind};
    use crate::coordinates::{Coordinates, Port, State};
    use crate::edit::Edit;
    use crate::law::Law;
    use crate::system::System;
    use crate::terms::Term;

    #[test]
    fn the_speed_falls_as_the_inverse_of_time() {
        let drag = Term { kind: &QUADRATIC, port: Port::Whole };
        let law = Law::new(Coordinates::Point, vec![drag], vec![0.8], 0.01).unwrap();
        let start = State { x: vec![0.0; 3], v: vec![3.0, 0.0, 4.0] };
        let end = System::new(&law, Edit::NONE).states(&start, &[2.0]).unwrap().remove(0);
        // v = v₀ / (1 + k v₀ t), and the path is ln(1 + k v₀ t) / k.
        let slower: f64 = 1.0 + 0.8 * 5.0 * 2.0;
        assert!((end.v[0] - 3.0 / slower).abs() < 1e-6 && (end.v[2] - 4.0 / slower).abs() < 1e-6);
        assert!((end.x[2] - 0.8 * slower.ln() / 0.8).abs() < 1e-5);
    }

    #[test]
    fn dry_friction_brings_to_rest_whatever_the_step() {
        for step in [0.003, 0.01, 0.05] {
            let drag = Term { kind: &DRY, port: Port::Whole };
            let law = Law::new(Coordinates::Point, vec![drag], vec![1.3, 1e-3], step).unwrap();
            let start = State { x: vec![0.0; 3], v: vec![0.6, 0.0, 0.8] };
            let system = System::new(&law, Edit::NONE);
            let [sliding, resting, later] = &system.states(&start, &[0.5, 1.0, 3.0]).unwrap()[..] else {
                panic!("three states")
            };
            let way = |state: &State| state.x[0].hypot(state.x[2]);
            assert!((way(sliding) - (0.5 - 0.5 * 1.3 * 0.25)).abs() < 1e-3, "step {step}: {}", way(sliding));
            assert!((way(later) - 0.5 / 1.3).abs() < 2.0 * step * step + 1e-3, "step {step}: {}", way(later));
            assert!(way(resting) - way(later) < 1e-3 && later.v[2].abs() < 1e-3);
        }
    }

    #[test]
    fn a_body_at_rest_stays() {
        let mut force = [1.0; 3];
        QUADRATIC.force(&[2.0], At { y: &[0.0; 3], w: &[0.0; 3] }, &mut force);
        assert_eq!(force.map(f64::abs), [0.0; 3]);
    }
}
