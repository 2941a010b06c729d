//! A step of an integrator.

use crate::coordinates::State;

/// Derivatives of a state by some unknowns: matrices `[freedoms, columns]`, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tangent {
    pub(crate) columns: usize,
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
}

/// A step's equations could not be solved, or gave something that is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoSolution;

/// The result of solving a step's equations.
pub(crate) type Solved<T = ()> = Result<T, NoSolution>;

/// A symmetric step of second order: the step by `-h` undoes the one by `h`.
pub(crate) trait Stepper {
    /// Advances a state by a time that may be negative.
    fn step(&mut self, state: &mut State, h: f64) -> Solved;

    /// Advances a state and its tangent; the last columns of the tangent belong to the law's parameters.
    fn step_with_tangent(&mut self, state: &mut State, tangent: &mut Tangent, h: f64) -> Solved;
}
