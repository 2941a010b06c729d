//! Polynomial potentials of all monomials up to degree three or four: `U = Σ c_m y^m / |m|`, without the
//! constant, whose force is linear in all coefficients. They describe a window and forecast badly beyond
//! it; kinds with fewer parameters come before them.

use super::kind::{At, Derivatives, Label, Role, TermKind};
use crate::parameter::{Parameter, Space, axis_name};

/// The kind `polynomial-three`.
pub(super) const CUBIC: Polynomial = Polynomial { name: "polynomial-three", degree: 3 };
/// The kind `polynomial-four`.
pub(super) const QUARTIC: Polynomial = Polynomial { name: "polynomial-four", degree: 4 };

/// A polynomial potential.
#[derive(Debug)]
pub(super) struct Polynomial {
    name: &'static str,
    degree: usize,
}

/// Exponents of a monomial.
type Exponents = [usize; 3];

impl Polynomial {
    /// Exponents of all monomials of `d` coordinates, by degree.
    fn monomials(&self, d: usize) -> Vec<Exponents> {
        let mut all = Vec::new();
        for degree in 1..=self.degree {
            for first in (0..=degree).rev() {
                for second in (0..=degree - first).rev() {
                    let exponents = [first, second, degree - first - second];
                    if exponents[d..].iter().all(|&exponent| exponent == 0) {
                        all.push(exponents);
                    }
                }
            }
        }
        all
    }
}

/// The monomial over its degree.
fn value(exponents: Exponents, y: &[f64]) -> f64 {
    power(exponents, y) / exponents.iter().sum::<usize>() as f64
}

fn power(exponents: Exponents, y: &[f64]) -> f64 {
    y.iter().zip(exponents).map(|(y, exponent)| (0..exponent).fold(1.0, |product, _| product * y)).product()
}

/// The exponents of the derivative by an axis with its factor; `None` if it vanishes.
fn lowered(mut exponents: Exponents, axis: usize) -> Option<(f64, Exponents)> {
    let factor = exponents[axis];
    exponents[axis] = factor.checked_sub(1)?;
    Some((factor as f64, exponents))
}

impl TermKind for Polynomial {
    fn label(&self) -> Label {
        Label { name: self.name, role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.has_position() && space.is_straight() && space.dimension <= 3
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let d = space.dimension;
        let describe = |exponents: Exponents| {
            let axes: String = (0..d).map(|axis| axis_name(d, axis).repeat(exponents[axis])).collect();
            let degree = exponents.iter().sum::<usize>();
            Parameter::linear(format!("slope-{axes}"), 2 - degree as i32, -2)
        };
        self.monomials(d).into_iter().map(describe).collect()
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        self.monomials(y.len()).into_iter().zip(p).map(|(exponents, c)| c * value(exponents, y)).sum()
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        force.fill(0.0);
        for (exponents, c) in self.monomials(at.y.len()).into_iter().zip(p) {
            let part = c / exponents.iter().sum::<usize>() as f64;
            for (axis, force) in force.iter_mut().enumerate() {
                if let Some((factor, rest)) = lowered(exponents, axis) {
                    *force -= part * factor * power(rest, at.y);
                }
            }
        }
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let d = at.y.len();
        for (column, (exponents, c)) in self.monomials(d).into_iter().zip(p).enumerate() {
            let share = 1.0 / exponents.iter().sum::<usize>() as f64;
            for axis in 0..d {
                let Some((factor, rest)) = lowered(exponents, axis) else { continue };
                out.p[(axis, column)] = -share * factor * power(rest, at.y);
                for second in 0..d {
                    if let Some((next, rest)) = lowered(rest, second) {
                        out.y[(axis, second)] -= share * c * factor * next * power(rest, at.y);
                    }
                }
            }
        }
    }
}
