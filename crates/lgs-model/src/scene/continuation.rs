//! How the motion of an object that no law describes goes on beyond its recording.

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, exp, fit_rotation, narrow, outer, rotation_vector, wide};
use lgs_core::linear::quat_mul;
use lgs_dynamics::{Edit, State};
use serde::{Deserialize, Serialize};

use super::dynamics::GeneralisedDynamics;

/// What carries on a recorded motion, before and after its times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Continuation {
    /// The object's dynamics.
    #[default]
    Dynamics,
    /// Nothing acts on the object any more: its centre moves at a constant velocity, and it turns about that
    /// at a constant rate.
    Free,
    /// The object stays where it is.
    Rest,
}

/// The law of a part of a recording, which carries its motion on beyond that end.
#[derive(Clone, Debug, PartialEq)]
pub struct PartDynamics {
    /// First and last time of the part.
    pub times: [f64; 2],
    /// The law, whose start is at the first of them.
    pub dynamics: GeneralisedDynamics,
}

impl PartDynamics {
    /// States at some times under an edit, of particles that are in a state at the first time of the part.
    pub(super) fn states(&self, there: &State, edit: Edit, times: &[f64]) -> Vec<State> {
        let until = times.iter().map(|time| (time - self.times[0]).abs()).fold(0.0, f64::max);
        let law = self.dynamics.law_under(edit, until);
        let since: Vec<f64> = times.iter().map(|time| time - self.times[0]).collect();
        let placed = |state: &_| {
            let mut placed = self.dynamics.placed(&there.q, state);
            let turned = placed.rotation.iter_mut().zip(&there.rotation);
            turned.for_each(|(rotation, &before)| *rotation = quat_mul(*rotation, before));
            placed
        };
        self.dynamics.states_by(&law, edit, &since).iter().map(placed).collect()
    }
}

/// The motion of a free body from a state on.
pub(super) struct FreeMotion {
    center: DVec3,
    velocity: DVec3,
    /// Rotation vector per unit of time, world axes.
    spin: DVec3,
}

impl FreeMotion {
    /// No motion at all.
    pub(super) const REST: Self = Self { center: DVec3::ZERO, velocity: DVec3::ZERO, spin: DVec3::ZERO };

    /// The rigid motion, constant in time, that takes particles from where they were to where they are;
    /// `dt` is negative where they will be there later.
    pub(super) fn between(before: &[[f32; 3]], now: &[[f32; 3]], dt: f64) -> Self {
        let mean =
            |points: &[[f32; 3]]| points.iter().map(|&p| wide(p)).sum::<DVec3>() / points.len().max(1) as f64;
        let (source, center) = (mean(before), mean(now));
        let moment = before.iter().zip(now).map(|(&a, &b)| outer(wide(b) - center, wide(a) - source));
        let turn = fit_rotation(&moment.fold(DMat3::ZERO, |sum, part| sum + part)).rotation;
        Self { center, velocity: (center - source) / dt, spin: rotation_vector(turn) / dt }
    }

    /// The state after a time, from the one in which the motion begins.
    pub(super) fn after(&self, time: f64, start: &State) -> State {
        let turn: DQuat = exp(self.spin * time);
        let center = self.center + self.velocity * time;
        let offsets = start.q.iter().map(|&q| turn * (wide(q) - self.center));
        let rotation = components(turn).map(|c| c as f32);
        State {
            q: offsets.clone().map(|offset| narrow(center + offset)).collect(),
            v: offsets.map(|offset| narrow(self.velocity + self.spin.cross(offset))).collect(),
            rotation: start.rotation.iter().map(|&before| quat_mul(rotation, before)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_body_goes_on_turning_about_its_centre() {
        let corners =
            [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, -1.0, -0.5]].map(DVec3::from);
        let (spin, velocity) = (DVec3::new(0.3, -0.2, 1.1), DVec3::new(0.5, 0.0, -0.4));
        let at = |time: f64| -> Vec<[f32; 3]> {
            let turn = exp(spin * time);
            corners.iter().map(|&corner| narrow(velocity * time + turn * corner)).collect()
        };
        let start = State { q: at(1.0), v: at(1.0), rotation: vec![[1.0, 0.0, 0.0, 0.0]; 4] };
        for (before, dt) in [(0.8, 0.2), (1.2, -0.2)] {
            let motion = FreeMotion::between(&at(before), &at(1.0), dt);
            for time in [-1.5, 0.7, 2.0] {
                let state = motion.after(time, &start);
                for (found, expected) in state.q.iter().zip(at(1.0 + time)) {
                    assert!(wide(*found).distance(wide(expected)) < 1e-5, "{time}: {found:?} {expected:?}");
                }
                let slightly_later = motion.after(time + 1e-3, &start);
                let moved = (wide(slightly_later.q[2]) - wide(state.q[2])) / 1e-3;
                assert!(moved.distance(wide(state.v[2])) < 1e-2, "velocity");
                let expected = components(exp(spin * time));
                let angle: f64 = (0..4).map(|i| f64::from(state.rotation[0][i]) * expected[i]).sum();
                assert!((angle.abs() - 1.0).abs() < 1e-5, "rotation {time}");
            }
        }
    }
}
