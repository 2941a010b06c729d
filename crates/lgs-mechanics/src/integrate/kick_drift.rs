//! Half a kick, a drift, half a kick: semi-implicit Euler (Eq. 5) with velocities read half a kick later.
//!
//! ```text
//! u  = v + h/2 a(x, v),      x⁺ = x + h u,      v⁺ = u + h/2 a(x⁺, v⁺)
//! ```
//!
//! Two steps after each other kick by `h/2 a + h/2 a = h a`, as Eq. 5 does, from a start half a kick back.
//! Where forces depend on the velocity the second half is implicit, solved by Newton's method to rounding, so
//! that the step by `−h` is the exact inverse.

use super::kick_field::{KickField, Linearised};
use super::solve::{self, add_scaled, finite, norm};
use super::stepper::{NoSolution, Solved, Stepper, Tangent};
use crate::coordinates::State;
use crate::terms::Block;
use crate::thresholds::{FAST_DECREASE, KICK_STEPS, LEAST_DECREASE, SOLVED_STEP};

/// The scheme for constant kinetic energy, and for rotations with a drift of their own.
#[derive(Debug)]
pub(crate) struct KickDrift<F> {
    field: F,
    at: Linearised,
    a: Vec<f64>,
    /// Memory of the implicit kick.
    kicked: Vec<f64>,
    from: Vec<f64>,
    change: Vec<f64>,
    /// Memory of a tangent's kick and of its matrix.
    kicks: Vec<f64>,
    matrix: Block,
}

impl<F: KickField> KickDrift<F> {
    pub(crate) fn new(field: F) -> Self {
        let a = vec![0.0; field.freedoms()];
        let [kicked, from, change] = [a.clone(), a.clone(), a.clone()];
        Self {
            field,
            at: Linearised::default(),
            a,
            kicked,
            from,
            change,
            kicks: Vec::new(),
            matrix: Block::default(),
        }
    }

    /// Solves `(I − s ∂a/∂v) u = r` for all columns of `r`, in place.
    fn solve_velocity(&mut self, s: f64, r: &mut [f64]) -> Solved {
        match self.field.depends_on_velocity() {
            true => solve::shifted(&self.at.v, s, &mut self.matrix, r),
            false => Ok(()),
        }
    }

    /// `v⁺ = u + s a(x, v⁺)`, where `v` holds `u` at first.
    fn implicit_kick(&mut self, state: &mut State, s: f64) -> Solved {
        self.field.acceleration(&state.x, &state.v, &mut self.a);
        self.kicked.copy_from_slice(&state.v);
        add_scaled(&mut state.v, &self.a, s);
        if !self.field.depends_on_velocity() {
            return finite(&state.v);
        }
        let mut change = std::mem::take(&mut self.change);
        let solved = self.solve_kick(state, s, &mut change);
        self.change = change;
        solved
    }

    /// Newton's method, with derivatives that are kept while what is left falls fast.
    fn solve_kick(&mut self, state: &mut State, s: f64, change: &mut [f64]) -> Solved {
        self.from.copy_from_slice(&state.v);
        let mut last = f64::INFINITY;
        for _ in 0..KICK_STEPS {
            self.field.acceleration(&state.x, &state.v, &mut self.a);
            for (i, change) in change.iter_mut().enumerate() {
                *change = self.kicked[i] + s * self.a[i] - state.v[i];
            }
            let size = norm(change);
            if size > LEAST_DECREASE * last {
                // Beyond a kink of dry friction, half of the way is tried.
                state.v.iter_mut().zip(&self.from).for_each(|(v, from)| *v = 0.5 * (*v + from));
                continue;
            }
            if last.is_infinite() || size > FAST_DECREASE * last {
                self.field.linearise(&state.x, &state.v, &mut self.at);
            }
            last = size;
            self.from.copy_from_slice(&state.v);
            self.solve_velocity(s, change)?;
            add_scaled(&mut state.v, change, 1.0);
            if norm(change) <= SOLVED_STEP * norm(&state.v) + f64::MIN_POSITIVE {
                return finite(&state.v);
            }
        }
        if last <= 1e6 * SOLVED_STEP * norm(&state.v) { finite(&state.v) } else { Err(NoSolution) }
    }
}

impl<F: KickField> Stepper for KickDrift<F> {
    fn step(&mut self, state: &mut State, h: f64) -> Solved {
        self.field.acceleration(&state.x, &state.v, &mut self.a);
        state.v.iter_mut().zip(&self.a).for_each(|(v, a)| *v += 0.5 * h * a);
        self.field.drift(state, h);
        self.implicit_kick(state, 0.5 * h)
    }

    fn step_with_tangent(&mut self, state: &mut State, tangent: &mut Tangent, h: f64) -> Solved {
        self.field.linearise(&state.x, &state.v, &mut self.at);
        self.kicks.clear();
        self.kicks.resize(tangent.v.len(), 0.0);
        self.at.add_by_position(tangent, 0.5 * h, &mut self.kicks);
        self.at.add_by_velocity(tangent, 0.5 * h, &mut self.kicks);
        add_scaled(&mut tangent.v, &self.kicks, 1.0);
        state.v.iter_mut().zip(&self.at.a).for_each(|(v, a)| *v += 0.5 * h * a);
        self.field.drift_tangent(state, tangent, h);
        self.field.drift(state, h);
        self.implicit_kick(state, 0.5 * h)?;
        self.field.linearise(&state.x, &state.v, &mut self.at);
        let mut kicked = std::mem::take(&mut tangent.v);
        self.at.add_by_position(tangent, 0.5 * h, &mut kicked);
        tangent.v = kicked;
        self.solve_velocity(0.5 * h, &mut tangent.v)
    }
}
