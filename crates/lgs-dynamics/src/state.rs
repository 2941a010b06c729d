//! States, edits and what a rollout is asked to do.

use crate::supports::Supports;
use serde::{Deserialize, Serialize};

/// Manipulations of a system (Eq. 9).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edit {
    /// α: multiplies the velocities at the start of a rollout.
    pub velocity_scale: f32,
    /// β: multiplies the potential.
    pub potential_scale: f32,
    /// γ: multiplies the force.
    pub force_scale: f32,
}

impl Default for Edit {
    fn default() -> Self {
        Self { velocity_scale: 1.0, potential_scale: 1.0, force_scale: 1.0 }
    }
}

/// Treatment of velocities when positions are aligned (method §4.6). Without supports all policies are
/// `Keep`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocityPolicy {
    /// They keep their integrated values (the paper).
    #[default]
    Keep,
    /// They become the displacement of the step over its length.
    FromPositions,
    /// The support keeps its momentum and its angular momentum, and the particle gets the velocity that the
    /// support has there as one rigid body, at the midpoint of the step, where the displacement of a rigid
    /// motion is a twist exactly: rigid motions stay as they are.
    Rigid,
}

/// The way in which time runs backwards (method §4.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reversal {
    /// The forward scheme with a negative step (Eq. 8): not the inverse of the forward step.
    NegatedStep,
    /// The inverse of the forward step.
    #[default]
    Exact,
}

/// Particles at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Positions `[n, 3]`, world units.
    pub q: Vec<[f32; 3]>,
    /// Velocities `[n, 3]`, world units per unit of time.
    pub v: Vec<[f32; 3]>,
    /// Rotations since the start `[n, 4]`, unit quaternions `[w, x, y, z]`; they change only where supports
    /// are aligned.
    pub rotation: Vec<[f32; 4]>,
}

impl State {
    /// A state that has not rotated yet.
    #[must_use]
    pub fn at_start(q: Vec<[f32; 3]>, v: Vec<[f32; 3]>) -> Self {
        assert_eq!(q.len(), v.len(), "positions and velocities");
        let rotation = vec![[1.0, 0.0, 0.0, 0.0]; q.len()];
        Self { q, v, rotation }
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.q.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }
}

/// Steps of a rollout.
#[derive(Clone, Copy, Debug)]
pub struct RolloutSpec<'a> {
    /// Length of a step, units of time; negative for the paper's reversal.
    pub dt: f32,
    /// Number of full steps.
    pub steps: usize,
    /// Length of one more, shorter step, for times off the grid (method §4.3).
    pub last_dt: Option<f32>,
    /// Manipulations; `velocity_scale` acts once, on the starting velocities.
    pub edit: Edit,
    /// Supports of the local rigid alignment (Eq. 6) after every step; none: particles are independent.
    pub supports: Option<&'a Supports>,
    /// Treatment of velocities at an alignment.
    pub velocity_policy: VelocityPolicy,
}

impl<'a> RolloutSpec<'a> {
    /// Full steps, no edit, no alignment.
    #[must_use]
    pub fn new(dt: f32, steps: usize) -> Self {
        Self {
            dt,
            steps,
            last_dt: None,
            edit: Edit::default(),
            supports: None,
            velocity_policy: VelocityPolicy::default(),
        }
    }

    /// The rollout with alignment on these supports.
    #[must_use]
    pub fn aligned(self, supports: &'a Supports, velocity_policy: VelocityPolicy) -> Self {
        Self { supports: Some(supports), velocity_policy, ..self }
    }

    /// The rollout with these edits.
    #[must_use]
    pub fn edited(self, edit: Edit) -> Self {
        Self { edit, ..self }
    }

    /// The steps that end at `time` ≥ 0: full ones of `dt`, then a shorter one if `time` is off the grid by
    /// more than a thousandth of a step.
    #[must_use]
    pub fn until(time: f32, dt: f32) -> Self {
        let ratio = f64::from(time) / f64::from(dt);
        let full = (ratio + 1e-3).floor().max(0.0);
        let rest = ((ratio - full) * f64::from(dt)) as f32;
        let last_dt = (rest > 1e-3 * dt).then_some(rest);
        Self { last_dt, ..Self::new(dt, full as usize) }
    }

    /// The lengths of all steps, in order.
    #[must_use]
    pub fn step_lengths(&self) -> Vec<f32> {
        let mut lengths = vec![self.dt; self.steps];
        lengths.extend(self.last_dt);
        lengths
    }
}

/// Cotangents of one state; empty arrays are zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateCotangents {
    /// Cotangents of positions `[n, 3]`.
    pub q: Vec<[f32; 3]>,
    /// Cotangents of velocities `[n, 3]`.
    pub v: Vec<[f32; 3]>,
    /// Cotangents of rotations `[n, 4]`.
    pub rotation: Vec<[f32; 4]>,
}

/// Gradients through a rollout.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutGradients {
    /// Gradient by the flat parameter vector.
    pub params: Vec<f32>,
    /// Gradient by the starting positions `[n, 3]`.
    pub q0: Vec<[f32; 3]>,
    /// Gradient by the starting velocities `[n, 3]`, before they are scaled by α.
    pub v0: Vec<[f32; 3]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_off_the_grid_end_with_a_shorter_step() {
        assert_eq!(RolloutSpec::until(0.75, 0.01).step_lengths(), vec![0.01; 75]);
        let lengths = RolloutSpec::until(29.0 / 60.0, 0.01).step_lengths();
        assert_eq!(lengths.len(), 49);
        assert!((lengths.iter().sum::<f32>() - 29.0 / 60.0).abs() < 1e-6);
        assert!(RolloutSpec::until(0.0, 0.01).step_lengths().is_empty());
    }
}
