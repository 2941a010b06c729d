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
use super::solve::{Eliminated, add_scaled, finite, norm};
use super::stepper::{NoSolution, Solved, Stepper, Tangent};
use crate::coordinates::State;
use crate::thresholds::{FAST_DECREASE, KICK_STEPS, LEAST_DECREASE, SOLVED_STEP};

/// The scheme for constant kinetic energy, and for rotations with a drift of their own.
///
/// A step begins where the one before it has ended, so that what is known there is not evaluated again.
#[derive(Debug)]
pub(crate) struct KickDrift<F> {
    field: F,
    depends_on_velocity: bool,
    /// The derivatives at a state.
    at: Linearised,
    known: Option<State>,
    /// The acceleration, at a position if it depends on nothing else.
    a: Vec<f64>,
    a_at: Option<Vec<f64>>,
    /// Memory of the implicit kick.
    by_velocity: Linearised,
    kicked: Vec<f64>,
    from: Vec<f64>,
    change: Vec<f64>,
    /// Memory of a tangent's kick, and of matrices to solve with.
    kicks: Vec<f64>,
    eliminated: Eliminated,
}

impl<F: KickField> KickDrift<F> {
    pub(crate) fn new(field: F) -> Self {
        let a = vec![0.0; field.freedoms()];
        let [kicked, from, change] = [a.clone(), a.clone(), a.clone()];
        Self {
            depends_on_velocity: field.depends_on_velocity(),
            field,
            at: Linearised::default(),
            known: None,
            a,
            a_at: None,
            by_velocity: Linearised::default(),
            kicked,
            from,
            change,
            kicks: Vec::new(),
            eliminated: Eliminated::default(),
        }
    }

    /// The derivatives at a state.
    fn linearise(&mut self, state: &State) {
        let is_at = |known: &State| known.x == state.x && (!self.depends_on_velocity || known.v == state.v);
        if self.known.as_ref().is_some_and(is_at) {
            return;
        }
        self.field.linearise(&state.x, &state.v, &mut self.at);
        match &mut self.known {
            Some(known) => known.clone_from(state),
            None => self.known = Some(state.clone()),
        }
    }

    /// The acceleration at a state.
    fn accelerate(&mut self, state: &State) {
        if self.depends_on_velocity {
            return self.field.acceleration(&state.x, &state.v, &mut self.a);
        }
        if self.a_at.as_ref() == Some(&state.x) {
            return;
        }
        self.field.acceleration(&state.x, &state.v, &mut self.a);
        self.a_at.get_or_insert_default().clone_from(&state.x);
    }

    /// `v⁺ = u + s a(x, v⁺)`, where `v` holds `u` at first.
    fn implicit_kick(&mut self, state: &mut State, s: f64) -> Solved {
        self.kicked.copy_from_slice(&state.v);
        self.accelerate(state);
        add_scaled(&mut state.v, &self.a, s);
        if !self.depends_on_velocity {
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
            self.accelerate(state);
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
                self.field.linearise_by_velocity(&state.x, &state.v, &mut self.by_velocity);
                self.eliminated.shifted(&self.by_velocity.v, s)?;
            }
            last = size;
            self.from.copy_from_slice(&state.v);
            self.eliminated.solve(change);
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
        self.accelerate(state);
        state.v.iter_mut().zip(&self.a).for_each(|(v, a)| *v += 0.5 * h * a);
        self.field.drift(state, h);
        self.implicit_kick(state, 0.5 * h)
    }

    fn step_with_tangent(&mut self, state: &mut State, tangent: &mut Tangent, h: f64) -> Solved {
        self.linearise(state);
        self.kicks.clear();
        self.kicks.resize(tangent.v.len(), 0.0);
        self.at.add_by_position(tangent, 0.5 * h, &mut self.kicks);
        self.at.add_by_velocity(tangent, 0.5 * h, &mut self.kicks);
        add_scaled(&mut tangent.v, &self.kicks, 1.0);
        state.v.iter_mut().zip(&self.at.a).for_each(|(v, a)| *v += 0.5 * h * a);
        self.field.drift_tangent(state, tangent, h);
        self.field.drift(state, h);
        self.implicit_kick(state, 0.5 * h)?;
        self.linearise(state);
        let mut kicked = std::mem::take(&mut tangent.v);
        self.at.add_by_position(tangent, 0.5 * h, &mut kicked);
        tangent.v = kicked;
        if !self.depends_on_velocity {
            return Ok(());
        }
        self.eliminated.shifted(&self.at.v, 0.5 * h)?;
        self.eliminated.solve(&mut tangent.v);
        Ok(())
    }
}
