//! The motion of a law: states at any time, forward and backward, under an edit, and their derivatives.

mod collide;
mod differences;
mod impulses;
mod sensitivity;

pub use sensitivity::Sensitivity;

use crate::contact::Impact;
use crate::coordinates::State;
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::integrate::{self, NoSolution, Solved, Stepper, Tangent};
use crate::law::Law;
use crate::thresholds::{FINER_STEPS, ON_GRID};
use collide::{Collider, Moment};
use impulses::Struck;
use nalgebra::DMatrix;

/// A law under an edit, started at t = 0.
///
/// States lie on a grid of full steps from t = 0, and a time between two of its points is reached by one
/// shortened step from the point nearer to 0: a state does not depend on which other times are asked for.
#[derive(Clone, Copy, Debug)]
pub struct System<'a> {
    law: &'a Law,
    edit: Edit,
}

impl<'a> System<'a> {
    /// The motion of a law under an edit.
    #[must_use]
    pub fn new(law: &'a Law, edit: Edit) -> Self {
        Self { law, edit }
    }

    /// States at times of any order and sign.
    pub fn states(&self, start: &State, times: &[f64]) -> Result<Vec<State>, MechanicsError> {
        self.visit(&mut self.plain(start)?, times)
    }

    /// States at ascending times, by finer steps where a longer one finds no way; none of the past, or of the
    /// future, where that cannot be followed to its end: what friction stops, or what a push drives to a
    /// cycle, forgets where it came from.
    #[must_use]
    pub fn states_followed(&self, start: &State, times: &[f64]) -> Vec<Option<State>> {
        let (past, future) = times.split_at(times.partition_point(|&time| time < 0.0));
        let with_step = |divisor: f64, times: &[f64]| {
            let law = Law { step: self.law.step / divisor, ..self.law.clone() };
            System::new(&law, self.edit).states(start, times).ok()
        };
        let follow = |times: &[f64]| {
            let found = FINER_STEPS.iter().find_map(|&divisor| with_step(divisor, times));
            found.map_or_else(|| vec![None; times.len()], |states| states.into_iter().map(Some).collect())
        };
        [past, future].map(follow).concat()
    }

    /// States as of [`Self::states`], and how many free motions near the plane of a contact were followed.
    pub(crate) fn states_and_contacts(
        &self,
        start: &State,
        times: &[f64],
    ) -> Result<(Vec<State>, usize), MechanicsError> {
        let mut moving = self.plain(start)?;
        let states = self.visit(&mut moving, times)?;
        Ok((states, moving.collider.map_or(0, |collider| collider.followed())))
    }

    /// Impacts up to a time, in order; none for laws without a contact.
    pub fn impacts(&self, start: &State, until: f64) -> Result<Vec<Impact>, MechanicsError> {
        let mut moving = self.plain(start)?;
        while moving.at.time < until {
            let time = moving.at.time;
            moving.advance(self.law.step).map_err(|NoSolution| MechanicsError::Undetermined { time })?;
        }
        let mut met = moving.collider.map_or_else(Vec::new, |collider| collider.met);
        met.retain(|impact| impact.time <= until);
        Ok(met)
    }

    fn plain(&self, start: &State) -> Result<Plain<'a>, MechanicsError> {
        let at = Moment { state: self.edited(start)?, time: 0.0 };
        let stepper = integrate::stepper(self.law, &self.edit);
        Ok(Plain { at, stepper, collider: Collider::new(self.law), impulses: &self.law.impulses })
    }

    /// States at times of any order and sign, with their derivatives by start and parameters; those of a law
    /// with a contact are central differences, which hold as long as the order of impacts stays.
    pub fn sensitivities(&self, start: &State, times: &[f64]) -> Result<Vec<Sensitivity>, MechanicsError> {
        if self.law.contact.is_some() {
            let motion = |law: &Law, start: &State| System::new(law, self.edit).states(start, times);
            return differences::of(&motion, self.law, start);
        }
        let stepper = integrate::stepper(self.law, &self.edit);
        let (n, m) = (self.law.coordinates.freedoms(), self.law.parameters.len());
        let columns = 2 * n + m;
        let mut tangent = Tangent { columns, x: vec![0.0; n * columns], v: vec![0.0; n * columns] };
        for i in 0..n {
            tangent.x[i * columns + i] = 1.0;
            tangent.v[i * columns + n + i] = self.edit.velocity;
        }
        let impulses = self.law.impulses.as_slice();
        let mut moving = Tangential { state: self.edited(start)?, tangent, time: 0.0, stepper, impulses };
        self.visit(&mut moving, times)
    }

    /// The accelerations at a state, `[freedoms]` each: by the forces that have an energy, and by all others.
    /// The motion without any force is left out.
    #[must_use]
    pub fn accelerations(&self, state: &State) -> [Vec<f64>; 2] {
        let free = Edit { velocity: 1.0, potential: 0.0, force: 0.0 };
        let by = |edit: Edit| integrate::acceleration(self.law, &edit, state);
        let inertial = by(free);
        let without = |a: Vec<f64>| a.iter().zip(&inertial).map(|(a, b)| a - b).collect();
        let [potential, force] = [self.edit.potential, self.edit.force];
        [without(by(Edit { potential, ..free })), without(by(Edit { force, ..free }))]
    }

    /// The start with its velocity scaled by α.
    fn edited(&self, start: &State) -> Result<State, MechanicsError> {
        self.law.coordinates.check_state(start)?;
        let v = start.v.iter().map(|v| v * self.edit.velocity).collect();
        Ok(State { x: start.x.clone(), v })
    }

    /// Moves along the grid in both directions and reads off all times.
    fn visit<M: Moving>(&self, start: &mut M, times: &[f64]) -> Result<Vec<M::Read>, MechanicsError> {
        let mut found: Vec<Option<M::Read>> = times.iter().map(|_| None).collect();
        let origin = start.keep();
        for sign in [1.0, -1.0] {
            start.restore(&origin);
            let mut order: Vec<usize> =
                (0..times.len()).filter(|&i| (times[i] < 0.0) == (sign < 0.0)).collect();
            order.sort_by(|&a, &b| times[a].abs().total_cmp(&times[b].abs()));
            let mut done = 0;
            for index in order {
                let steps = times[index].abs() / self.law.step;
                let whole = (steps + ON_GRID).floor();
                let undetermined =
                    |steps: usize| MechanicsError::Undetermined { time: sign * steps as f64 * self.law.step };
                while (done as f64) < whole {
                    start.advance(sign * self.law.step).map_err(|NoSolution| undetermined(done))?;
                    done += 1;
                }
                let rest = steps - whole;
                if rest > ON_GRID {
                    let grid = start.keep();
                    start.advance(sign * rest * self.law.step).map_err(|NoSolution| undetermined(done))?;
                    found[index] = Some(start.read());
                    start.restore(&grid);
                } else {
                    found[index] = Some(start.read());
                }
            }
        }
        Ok(found.into_iter().flatten().collect())
    }
}

/// Something that moves along the grid and can be read.
trait Moving {
    type Kept;
    type Read;
    fn advance(&mut self, h: f64) -> Solved;
    fn keep(&self) -> Self::Kept;
    fn restore(&mut self, kept: &Self::Kept);
    fn read(&self) -> Self::Read;
}

/// A state alone.
struct Plain<'a> {
    at: Moment,
    stepper: Box<dyn Stepper + 'a>,
    collider: Option<Collider<'a>>,
    impulses: &'a [Impact],
}

impl Struck for Plain<'_> {
    fn move_freely(&mut self, h: f64) -> Solved {
        if h == 0.0 {
            return Ok(());
        }
        if let Some(collider) = &mut self.collider {
            return collider.advance(self.stepper.as_mut(), &mut self.at, h);
        }
        integrate::advance(self.stepper.as_mut(), &mut self.at.state, h)?;
        self.at.time += h;
        Ok(())
    }

    fn change(&mut self, velocity: &[f64], sign: f64) {
        self.at.state.v.iter_mut().zip(velocity).for_each(|(v, change)| *v += sign * change);
    }
}

impl Moving for Plain<'_> {
    /// Moment, and number of impacts met.
    type Kept = (Moment, usize);
    type Read = State;

    fn advance(&mut self, h: f64) -> Solved {
        let (impulses, from) = (self.impulses, self.at.time);
        impulses::pass(self, impulses, from, h)
    }

    fn keep(&self) -> Self::Kept {
        (self.at.clone(), self.collider.as_ref().map_or(0, |collider| collider.met.len()))
    }

    fn restore(&mut self, (at, met): &Self::Kept) {
        self.at.clone_from(at);
        self.collider.iter_mut().for_each(|collider| collider.met.truncate(*met));
    }

    fn read(&self) -> State {
        self.at.state.clone()
    }
}

/// A state with its tangent.
struct Tangential<'a> {
    state: State,
    tangent: Tangent,
    time: f64,
    stepper: Box<dyn Stepper + 'a>,
    impulses: &'a [Impact],
}

impl Struck for Tangential<'_> {
    fn move_freely(&mut self, h: f64) -> Solved {
        if h == 0.0 {
            return Ok(());
        }
        integrate::advance_with_tangent(self.stepper.as_mut(), &mut self.state, &mut self.tangent, h)
    }

    /// What is added whatever the state is changes no derivative.
    fn change(&mut self, velocity: &[f64], sign: f64) {
        self.state.v.iter_mut().zip(velocity).for_each(|(v, change)| *v += sign * change);
    }
}

impl Moving for Tangential<'_> {
    type Kept = (State, Tangent, f64);
    type Read = Sensitivity;

    fn advance(&mut self, h: f64) -> Solved {
        let (impulses, from) = (self.impulses, self.time);
        self.time += h;
        impulses::pass(self, impulses, from, h)
    }

    fn keep(&self) -> (State, Tangent, f64) {
        (self.state.clone(), self.tangent.clone(), self.time)
    }

    fn restore(&mut self, (state, tangent, time): &(State, Tangent, f64)) {
        self.state.clone_from(state);
        self.tangent.clone_from(tangent);
        self.time = *time;
    }

    fn read(&self) -> Sensitivity {
        let rows = self.state.v.len();
        let block = |values: &[f64]| DMatrix::from_row_slice(rows, self.tangent.columns, values);
        Sensitivity {
            state: self.state.clone(),
            position: block(&self.tangent.x),
            velocity: block(&self.tangent.v),
        }
    }
}
