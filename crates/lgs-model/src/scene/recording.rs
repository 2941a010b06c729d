//! The recorded motion of an object that no law describes: its particles as the source model had them inside
//! the captured window.

use lgs_core::linear::{add, mat_vec, matrix_from_quat, quat_mul, quat_normalize, scale, sub};
use lgs_dynamics::{Edit, State};

use super::continuation::{Continuation, FreeMotion, PartDynamics};
use crate::thresholds::{END_OF_RECORDING, HANDOVER};

/// States of an object's particles at ascending times, from t = 0 to the end of the captured window.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    times: Vec<f32>,
    /// `[T][n]`, world units.
    positions: Vec<Vec<[f32; 3]>>,
    /// `[T][n]` rotations since t = 0, unit quaternions `[w, x, y, z]`.
    rotations: Vec<Vec<[f32; 4]>>,
    /// What carries the motion on before and after.
    continuation: Continuation,
    /// Laws of its beginning and its end, which do so where there are any.
    parts: [Option<PartDynamics>; 2],
    /// Whether it is that of a body that deforms as a whole, whose Gaussians are stretched with it.
    deforms: bool,
    /// Whether it is that of a thing that is made to do what it does outside of its free flights.
    is_handled: bool,
}

impl Recording {
    /// A recording that the dynamics carry on; nothing if it has fewer than two times, or they do not ascend
    /// from 0 with a state each.
    #[must_use]
    pub fn new(
        times: Vec<f32>,
        positions: Vec<Vec<[f32; 3]>>,
        rotations: Vec<Vec<[f32; 4]>>,
    ) -> Option<Self> {
        let n = positions.first()?.len();
        let ascends = times.first() == Some(&0.0) && times.windows(2).all(|pair| pair[0] < pair[1]);
        let is_whole = times.len() == positions.len()
            && times.len() == rotations.len()
            && positions.iter().all(|row| row.len() == n)
            && rotations.iter().all(|row| row.len() == n);
        let continuation = Continuation::default();
        let parts = [None, None];
        let (deforms, is_handled) = (false, false);
        let recording = Self { times, positions, rotations, continuation, parts, deforms, is_handled };
        (recording.times.len() > 1 && ascends && is_whole).then_some(recording)
    }

    /// The same of a body that deforms as a whole, or of none.
    #[must_use]
    pub fn of_deforming(mut self, deforms: bool) -> Self {
        self.deforms = deforms;
        self
    }

    /// Whether it is the recording of a body that deforms as a whole, whose Gaussians are stretched with it.
    #[must_use]
    pub fn deforms(&self) -> bool {
        self.deforms
    }

    /// The same of a thing that is made to do what it does outside of its free flights, so that no law is to
    /// be sought for all of it, or of none.
    #[must_use]
    pub fn of_handled(mut self, is_handled: bool) -> Self {
        self.is_handled = is_handled;
        self
    }

    /// Whether it is the recording of a thing that is made to do what it does outside of its free flights.
    #[must_use]
    pub fn is_handled(&self) -> bool {
        self.is_handled
    }

    /// The same with laws of its beginning and its end.
    #[must_use]
    pub fn with_parts(mut self, parts: [Option<PartDynamics>; 2]) -> Self {
        self.parts = parts;
        self
    }

    /// Laws of its beginning and its end.
    #[must_use]
    pub fn parts(&self) -> &[Option<PartDynamics>; 2] {
        &self.parts
    }

    /// Whether a law of its beginning or its end carries it on.
    #[must_use]
    pub fn has_parts(&self) -> bool {
        self.parts.iter().any(Option::is_some)
    }

    /// The same with another continuation.
    #[must_use]
    pub fn continued_by(mut self, continuation: Continuation) -> Self {
        self.continuation = continuation;
        self
    }

    /// What carries the motion on before and after the recording.
    #[must_use]
    pub fn continuation(&self) -> Continuation {
        self.continuation
    }

    /// Its times, ascending from 0.
    #[must_use]
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// Positions at each of its times.
    #[must_use]
    pub fn positions(&self) -> &[Vec<[f32; 3]>] {
        &self.positions
    }

    /// Rotations since t = 0 at each of its times.
    #[must_use]
    pub fn rotations(&self) -> &[Vec<[f32; 4]>] {
        &self.rotations
    }

    /// The first of its samples; nothing if these are fewer than two.
    #[must_use]
    pub fn beginning(&self, samples: usize) -> Option<Self> {
        let first = 0..samples.min(self.times.len());
        let begun = Self::new(
            self.times[first.clone()].to_vec(),
            self.positions[first.clone()].to_vec(),
            self.rotations[first].to_vec(),
        );
        begun.map(|begun| {
            begun.continued_by(self.continuation).of_deforming(self.deforms).of_handled(self.is_handled)
        })
    }

    /// Positions at t = 0.
    #[must_use]
    pub fn start(&self) -> &[[f32; 3]] {
        &self.positions[0]
    }

    /// The same with its particles in another order: index of the first, of the second, ….
    #[must_use]
    pub fn in_order(self, order: &[u32]) -> Self {
        let positions = self.positions.iter().map(|row| picked(row, order)).collect();
        let rotations = self.rotations.iter().map(|row| picked(row, order)).collect();
        Self { positions, rotations, ..self }
    }

    /// The state at a time, between the two nearest ones; nothing outside of the recording.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<State> {
        let (first, last) = (f64::from(self.times[0]), f64::from(self.times[self.times.len() - 1]));
        if !(first..=last + 1e-6).contains(&time) {
            return None;
        }
        let next = self.times.partition_point(|&t| f64::from(t) <= time).clamp(1, self.times.len() - 1);
        let span = self.times[next] - self.times[next - 1];
        let part = ((time as f32 - self.times[next - 1]) / span).clamp(0.0, 1.0);
        let pairs = self.positions[next - 1].iter().zip(&self.positions[next]);
        let (q, v) =
            pairs.map(|(&a, &b)| (add(a, scale(sub(b, a), part)), scale(sub(b, a), 1.0 / span))).unzip();
        let turns = self.rotations[next - 1].iter().zip(&self.rotations[next]);
        let rotation = turns.map(|(a, b)| between(a, b, part)).collect();
        Some(State { q, v, rotation })
    }

    /// The recorded states at as many of the times as there are, in order, of particles that are at `points`
    /// at t = 0: what these are off the recording's first positions turns with each particle.
    pub(super) fn played(&self, points: &[[f32; 3]], times: &[f64]) -> Vec<State> {
        let placed = |mut state: State| {
            let moved = points.iter().zip(self.start()).zip(&state.rotation);
            for (q, ((&point, &start), &rotation)) in state.q.iter_mut().zip(moved) {
                let offset = sub(point, start);
                if offset != [0.0; 3] {
                    *q = add(*q, mat_vec(&matrix_from_quat(rotation), offset));
                }
            }
            state
        };
        times.iter().map_while(|&time| self.at(time)).map(placed).collect()
    }

    /// The states at times before or after the recording, of particles that are at `points` at t = 0; nothing
    /// where the dynamics carry it on. All times lie on one side of it.
    pub(super) fn carried_on(&self, points: &[[f32; 3]], times: &[f64]) -> Option<Vec<State>> {
        let is_later = times.first().is_some_and(|&time| time > 0.0);
        if let Some(part) = &self.parts[usize::from(is_later)] {
            return self.by_part(part, points, times);
        }
        if self.continuation == Continuation::Dynamics {
            return None;
        }
        let last = self.times.len() - 1;
        let near = (((last + 1) as f64 * END_OF_RECORDING).ceil() as usize).clamp(1, last);
        let motion_at = |end: usize, inside: usize| match self.continuation {
            Continuation::Free => {
                let dt = f64::from(self.times[end] - self.times[inside]);
                FreeMotion::between(&self.positions[inside], &self.positions[end], dt)
            }
            _ => FreeMotion::REST,
        };
        let ends = [(0, near), (last, last - near)].map(|(end, inside)| {
            let time = f64::from(self.times[end]);
            (time, motion_at(end, inside), self.played(points, &[time]))
        });
        let state = |&time: &f64| {
            let (from, motion, start) = &ends[usize::from(time > 0.0)];
            start.first().map(|start| motion.after(time - from, start))
        };
        times.iter().map(state).collect()
    }

    /// The states by the law of a part, brought to where the recording ends if they come after it.
    fn by_part(&self, part: &PartDynamics, points: &[[f32; 3]], times: &[f64]) -> Option<Vec<State>> {
        let there = self.played(points, &[part.times[0]]).pop()?;
        let mut states = part.states(&there, Edit::default(), times);
        if times.first().is_some_and(|&time| time > 0.0) {
            let end = [self.end()];
            let recorded = self.played(points, &end).pop()?;
            let moved = part.states(&there, Edit::default(), &end).pop()?;
            self.hand_over([&recorded, &moved], &mut states, times);
        }
        Some(states)
    }

    /// The states at later times of an edited motion whose end follows a law: as recorded until that begins,
    /// and by the edited law from then on; nothing if there is none.
    pub(super) fn edited(&self, points: &[[f32; 3]], edit: Edit, times: &[f64]) -> Option<Vec<State>> {
        let part = self.parts[1].as_ref().filter(|_| times.iter().all(|&time| time >= 0.0))?;
        let (before, after) = times.split_at(times.partition_point(|&time| time <= part.times[0]));
        let there = self.played(points, &[part.times[0]]).pop()?;
        let mut states = self.played(points, before);
        states.extend(part.states(&there, edit, after));
        Some(states)
    }

    /// Last time of the recording.
    pub(super) fn end(&self) -> f64 {
        f64::from(self.times[self.times.len() - 1])
    }

    /// Brings later states of a motion that takes no notice of the recording nearer to it, the less the later
    /// they are, so that nothing jumps where the recording ends; `there` are the states at its end, the
    /// recorded one first.
    pub(super) fn hand_over(&self, there: [&State; 2], later: &mut [State], times: &[f64]) {
        let [recorded, moved] = there;
        let turn = |(&[w, x, y, z], &to): (&[f32; 4], &[f32; 4])| quat_mul(to, [w, -x, -y, -z]);
        let turns: Vec<[f32; 4]> = moved.rotation.iter().zip(&recorded.rotation).map(turn).collect();
        for (state, time) in later.iter_mut().zip(times) {
            let part = 1.0 - (time - self.end()) / (HANDOVER * self.end());
            if part <= 0.0 {
                return;
            }
            for (q, (&from, &to)) in state.q.iter_mut().zip(moved.q.iter().zip(&recorded.q)) {
                *q = add(*q, scale(sub(to, from), part as f32));
            }
            for (rotation, turn) in state.rotation.iter_mut().zip(&turns) {
                *rotation = quat_mul(between(&[1.0, 0.0, 0.0, 0.0], turn, part as f32), *rotation);
            }
        }
    }
}

fn picked<T: Copy>(row: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&i| row[i as usize]).collect()
}

/// The normalised mean of two rotations.
fn between(a: &[f32; 4], b: &[f32; 4], part: f32) -> [f32; 4] {
    let near = a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>().signum();
    quat_normalize(std::array::from_fn(|i| a[i] * (1.0 - part) + near * b[i] * part))
}

#[cfg(test)]
mod tests;
