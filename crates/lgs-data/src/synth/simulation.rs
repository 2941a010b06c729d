//! Paths of laws by the classical fourth-order Runge–Kutta method, in both directions from t = 0.

use super::laws::Law;
use super::pose::Pose;
use crate::thresholds::SIMULATION_STEP;

/// Steps that are kept: to the ends of the ground truth.
const KEPT_AFTER: usize = 4500;
const KEPT_BEFORE: usize = 1500;

/// A law with its states at multiples of a step.
#[derive(Debug)]
pub(super) struct Simulation {
    pub(super) law: Box<dyn Law>,
    after: Vec<Vec<f64>>,
    before: Vec<Vec<f64>>,
}

impl Simulation {
    pub(super) fn new(law: Box<dyn Law>) -> Self {
        let path = |h: f64, count: usize| -> Vec<Vec<f64>> {
            let next = |state: &Vec<f64>| Some(step(law.as_ref(), state, h));
            std::iter::successors(Some(law.start()), next).take(count + 1).collect()
        };
        let (after, before) = (path(SIMULATION_STEP, KEPT_AFTER), path(-SIMULATION_STEP, KEPT_BEFORE));
        Self { law, after, before }
    }

    /// The state at any time: from the nearest kept one towards t = 0.
    pub(super) fn state(&self, t: f64) -> Vec<f64> {
        let kept = if t < 0.0 { &self.before } else { &self.after };
        let whole = ((t.abs() / SIMULATION_STEP) as usize).min(kept.len() - 1);
        let rest = t - t.signum() * whole as f64 * SIMULATION_STEP;
        let steps = (rest.abs() / SIMULATION_STEP).ceil();
        (0..steps as usize)
            .fold(kept[whole].clone(), |state, _| step(self.law.as_ref(), &state, rest / steps))
    }

    /// The pose of one of the law's bodies.
    pub(super) fn pose(&self, body: usize, t: f64) -> Pose {
        self.law.poses(&self.state(t))[body]
    }
}

fn step(law: &dyn Law, state: &[f64], h: f64) -> Vec<f64> {
    let moved =
        |rate: &[f64], h: f64| -> Vec<f64> { state.iter().zip(rate).map(|(s, r)| s + h * r).collect() };
    let a = law.rate(state);
    let b = law.rate(&moved(&a, 0.5 * h));
    let c = law.rate(&moved(&b, 0.5 * h));
    let d = law.rate(&moved(&c, h));
    let mean = |i: usize| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0;
    state.iter().enumerate().map(|(i, s)| s + h * mean(i)).collect()
}
