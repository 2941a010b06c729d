//! Quadratic drag: `Q = −k |w| w`, as of a fast body in air.

use super::kind::{At, Derivatives, Role, TermKind};
use super::quadratic::dot;
use crate::parameter::{Parameter, Space};

/// The kind `quadratic-drag`.
pub(super) const QUADRATIC_DRAG: QuadraticDrag = QuadraticDrag;

/// Quadratic drag.
#[derive(Debug)]
pub(super) struct QuadraticDrag;

impl TermKind for QuadraticDrag {
    fn name(&self) -> &'static str {
        "quadratic-drag"
    }

    fn role(&self) -> Role {
        Role::Dissipates
    }

    fn suits(&self, _space: Space) -> bool {
        true
    }

    fn parameters(&self, _space: Space) -> Vec<Parameter> {
        vec![Parameter::linear("drag", -1, 0).within(0.0, f64::INFINITY)]
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let speed = dot(at.w, at.w).sqrt();
        force.iter_mut().zip(at.w).for_each(|(f, w)| *f = -p[0] * speed * w);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let speed = dot(at.w, at.w).sqrt();
        // The derivative at rest is zero, whatever the direction.
        let part = if speed > 0.0 { p[0] / speed } else { 0.0 };
        for i in 0..at.w.len() {
            let same = p[0] * speed;
            for j in 0..at.w.len() {
                out.w[(i, j)] = -part * at.w[i] * at.w[j] - if i == j { same } else { 0.0 };
            }
            out.p[(i, 0)] = -speed * at.w[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{At, QUADRATIC_DRAG, TermKind};
    use crate::coordinates::{Coordinates, Port, State};
    use crate::edit::Edit;
    use crate::law::Law;
    use crate::system::System;
    use crate::terms::Term;

    #[test]
    fn the_speed_falls_as_the_inverse_of_time() {
        let drag = Term { kind: &QUADRATIC_DRAG, port: Port::Whole };
        let law = Law::new(Coordinates::Point, vec![drag], vec![0.8], 0.01).unwrap();
        let start = State { x: vec![0.0; 3], v: vec![3.0, 0.0, 4.0] };
        let end = System::new(&law, Edit::NONE).states(&start, &[2.0]).unwrap().remove(0);
        // v = v₀ / (1 + k v₀ t), and the path is ln(1 + k v₀ t) / k.
        let slower: f64 = 1.0 + 0.8 * 5.0 * 2.0;
        assert!((end.v[0] - 3.0 / slower).abs() < 1e-6 && (end.v[2] - 4.0 / slower).abs() < 1e-6);
        assert!((end.x[2] - 0.8 * slower.ln() / 0.8).abs() < 1e-5);
    }

    #[test]
    fn a_body_at_rest_stays() {
        let mut force = [1.0; 3];
        QUADRATIC_DRAG.force(&[2.0], At { y: &[0.0; 3], w: &[0.0; 3] }, &mut force);
        assert_eq!(force.map(f64::abs), [0.0; 3]);
    }
}
