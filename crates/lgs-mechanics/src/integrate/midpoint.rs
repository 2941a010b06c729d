//! The implicit midpoint rule, for kinetic energies that depend on the position.
//!
//! ```text
//! x⁺ = x + h (v + v⁺)/2,      v⁺ = v + h a((x + x⁺)/2, (v + v⁺)/2)
//! ```
//!
//! The mean velocity is solved for by Newton's method to rounding: with `x̄ = x + h/2 v̄` it is
//! `v̄ = v + h/2 a(x̄, v̄)`.

use super::field::VectorField;
use super::kick_field::{KickField, Linearised};
use super::solve::{Eliminated, add_scaled, finite, norm};
use super::stepper::{NoSolution, Solved, Stepper, Tangent};
use crate::coordinates::State;
use crate::terms::Block;
use crate::thresholds::{MIDPOINT_STEPS, SOLVED_STEP};

/// The scheme for kinetic energies that depend on the position.
#[derive(Debug)]
pub(crate) struct Midpoint<'a> {
    field: VectorField<'a>,
    at: Linearised,
    /// `h/2 A_x + A_v`: derivative of the acceleration by the mean velocity.
    by_mean: Block,
    /// Memory of a matrix to solve with.
    eliminated: Eliminated,
}

impl<'a> Midpoint<'a> {
    pub(crate) fn new(field: VectorField<'a>) -> Self {
        Self {
            field,
            at: Linearised::default(),
            by_mean: Block::default(),
            eliminated: Eliminated::default(),
        }
    }

    /// The mean velocity of a step; leaves the linearisation at the middle behind.
    fn mean_velocity(&mut self, state: &State, h: f64) -> Solved<Vec<f64>> {
        let n = self.field.freedoms();
        let mut mean = state.v.clone();
        for _ in 0..MIDPOINT_STEPS {
            let middle: Vec<f64> = state.x.iter().zip(&mean).map(|(x, v)| x + 0.5 * h * v).collect();
            self.field.linearise(&middle, &mean, &mut self.at);
            self.by_mean.reset(n, n);
            for i in 0..n {
                for j in 0..n {
                    self.by_mean[(i, j)] = 0.5 * h * self.at.x[(i, j)] + self.at.v[(i, j)];
                }
            }
            let mut change: Vec<f64> =
                (0..n).map(|i| state.v[i] + 0.5 * h * self.at.a[i] - mean[i]).collect();
            self.eliminated.shifted(&self.by_mean, 0.5 * h)?;
            self.eliminated.solve(&mut change);
            add_scaled(&mut mean, &change, 1.0);
            finite(&mean)?;
            if norm(&change) <= SOLVED_STEP * (norm(&mean) + norm(&state.v)) + f64::MIN_POSITIVE {
                return Ok(mean);
            }
        }
        Err(NoSolution)
    }
}

/// The step's end: `x + h v̄`, `2 v̄ − v`.
fn finish(state: &mut State, mean: &[f64], h: f64) {
    add_scaled(&mut state.x, mean, h);
    state.v.iter_mut().zip(mean).for_each(|(v, mean)| *v = 2.0 * mean - *v);
}

impl Stepper for Midpoint<'_> {
    fn step(&mut self, state: &mut State, h: f64) -> Solved {
        let mean = self.mean_velocity(state, h)?;
        finish(state, &mean, h);
        Ok(())
    }

    fn step_with_tangent(&mut self, state: &mut State, tangent: &mut Tangent, h: f64) -> Solved {
        let mean = self.mean_velocity(state, h)?;
        // (I − h/2 (h/2 A_x + A_v)) V̄ = V + h/2 (A_x X + A_p).
        let mut by_mean = tangent.v.clone();
        self.at.add_by_position(tangent, 0.5 * h, &mut by_mean);
        self.eliminated.shifted(&self.by_mean, 0.5 * h)?;
        self.eliminated.solve(&mut by_mean);
        add_scaled(&mut tangent.x, &by_mean, h);
        tangent.v.iter_mut().zip(&by_mean).for_each(|(v, mean)| *v = 2.0 * mean - *v);
        finish(state, &mean, h);
        Ok(())
    }
}
