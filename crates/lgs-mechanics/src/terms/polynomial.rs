//! Polynomial potentials of all monomials up to degree three or four: `U = Σ c_m y^m / |m|`, without the
//! constant, whose force is linear in all coefficients. They describe a window and forecast badly beyond
//! it; kinds with fewer parameters come before them.

use super::kind::{At, Derivatives, Role, TermKind};
use super::parameter::{Parameter, Space};

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

impl Polynomial {
    /// Monomials as ascending lists of the axes that they multiply, by degree.
    fn monomials(&self, d: usize) -> Vec<Vec<usize>> {
        let mut all: Vec<Vec<usize>> = (0..d).map(|axis| vec![axis]).collect();
        let mut last = all.clone();
        for _ in 1..self.degree {
            let longer = |axes: &Vec<usize>| -> Vec<Vec<usize>> {
                let first = axes.last().copied().unwrap_or(0);
                (first..d).map(|axis| [axes.as_slice(), &[axis]].concat()).collect()
            };
            last = last.iter().flat_map(longer).collect();
            all.extend(last.clone());
        }
        all
    }
}

/// The product of the coordinates of a monomial without the factors at some places.
fn product(axes: &[usize], y: &[f64], without: &[usize]) -> f64 {
    (0..axes.len()).filter(|place| !without.contains(place)).map(|place| y[axes[place]]).product()
}

impl TermKind for Polynomial {
    fn name(&self) -> &'static str {
        self.name
    }

    fn role(&self) -> Role {
        Role::Conserves
    }

    fn suits(&self, space: Space) -> bool {
        space.has_position() && space.is_straight() && space.dimension <= 3
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let name = |axes: &Vec<usize>| {
            let axes: Vec<String> = axes.iter().map(|&axis| super::axis_name(space.dimension, axis)).collect();
            format!("slope-{}", axes.concat())
        };
        let monomials = self.monomials(space.dimension);
        monomials.iter().map(|axes| Parameter::linear(name(axes), 2 - axes.len() as i32, -2)).collect()
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        let part = |(axes, c): (Vec<usize>, &f64)| c * product(&axes, y, &[]) / axes.len() as f64;
        self.monomials(y.len()).into_iter().zip(p).map(part).sum()
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        force.fill(0.0);
        for (axes, c) in self.monomials(at.y.len()).iter().zip(p) {
            for (place, &axis) in axes.iter().enumerate() {
                force[axis] -= c / axes.len() as f64 * product(axes, at.y, &[place]);
            }
        }
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        for (column, (axes, c)) in self.monomials(at.y.len()).iter().zip(p).enumerate() {
            let share = 1.0 / axes.len() as f64;
            for (place, &axis) in axes.iter().enumerate() {
                out.p[(axis, column)] -= share * product(axes, at.y, &[place]);
                for (other, &second) in axes.iter().enumerate().filter(|&(other, _)| other != place) {
                    out.y[(axis, second)] -= share * c * product(axes, at.y, &[place, other]);
                }
            }
        }
    }
}
