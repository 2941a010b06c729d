//! Shooting: start and parameters such that the motion of a law passes through a track.

use super::levenberg::{Problem, Unknown};
use super::track::Track;
use crate::candidate::Candidate;
use crate::coordinates::State;
use crate::edit::Edit;
use crate::law::Law;
use crate::system::System;
use crate::terms::{Entry, Scales};
use crate::thresholds::CENTRE_PRIOR;
use nalgebra::{DMatrix, DVector};

/// Start and parameters as unknowns: changes of the first configuration, then velocities and parameters.
pub(super) struct Shooting<'a> {
    candidate: &'a Candidate,
    pub(super) track: &'a Track,
    pub(super) first: State,
    pub(super) step: f64,
    unknowns: Vec<Unknown>,
    /// Index of the unknown, centre and deviation of each normal prior.
    pub(super) priors: Vec<(usize, f64, f64)>,
    /// Weights of the components `[n]` of each sample.
    weights: Vec<Vec<f64>>,
}

impl<'a> Shooting<'a> {
    /// Compares motions from near `first` to a track; the step is the mean interval between samples.
    pub(super) fn new(candidate: &'a Candidate, track: &'a Track, scales: &Scales, first: State) -> Self {
        let (unknowns, priors) = unknowns(candidate, scales);
        let weights = track.weights();
        Self { candidate, track, first, step: interval(&track.times), unknowns, priors, weights }
    }

    pub(super) fn start(&self, values: &[f64]) -> State {
        let n = self.first.v.len();
        let x = self.candidate.coordinates.retract(&self.first.x, &values[..n]);
        State { x, v: values[n..2 * n].to_vec() }
    }

    pub(super) fn law(&self, values: &[f64]) -> Option<Law> {
        self.candidate.law(values[2 * self.first.v.len()..].to_vec(), self.step).ok()
    }

    /// Writes the weighted differences of states from the track, then the priors.
    fn compare<'b>(&self, states: impl Iterator<Item = &'b State>, values: &[f64]) -> DVector<f64> {
        let n = self.first.v.len();
        let mut residuals = Vec::with_capacity(self.track.x.len() * n + self.priors.len());
        for ((state, observed), weights) in states.zip(&self.track.x).zip(&self.weights) {
            let difference = self.candidate.coordinates.difference(observed, &state.x);
            residuals.extend(difference.iter().zip(weights).map(|(d, w)| d * w));
        }
        residuals.extend(self.priors.iter().map(|&(i, centre, deviation)| (values[i] - centre) / deviation));
        DVector::from_vec(residuals)
    }
}

impl Problem for Shooting<'_> {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let law = self.law(values)?;
        let states = System::new(&law, Edit::NONE).states(&self.start(values), &self.track.times).ok()?;
        let residuals = self.compare(states.iter(), values);
        residuals.iter().all(|r| r.is_finite()).then_some(residuals)
    }

    fn linearised(&self, values: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let law = self.law(values)?;
        let system = System::new(&law, Edit::NONE);
        let found = system.sensitivities(&self.start(values), &self.track.times).ok()?;
        let residuals = self.compare(found.iter().map(|s| &s.state), values);
        let n = self.first.v.len();
        let mut jacobian = DMatrix::zeros(residuals.len(), self.unknowns.len());
        for (sample, (sensitivity, weights)) in found.iter().zip(&self.weights).enumerate() {
            for (i, weight) in weights.iter().enumerate() {
                jacobian.row_mut(sample * n + i).copy_from(&(sensitivity.position.row(i) * *weight));
            }
        }
        let first = found.len() * n;
        for (row, &(unknown, _, deviation)) in self.priors.iter().enumerate() {
            jacobian[(first + row, unknown)] = 1.0 / deviation;
        }
        jacobian.iter().all(|j| j.is_finite()).then_some((residuals, jacobian))
    }
}

/// The mean interval between samples.
pub(crate) fn interval(times: &[f64]) -> f64 {
    (times[times.len() - 1] - times[0]) / (times.len() - 1).max(1) as f64
}

/// Unknowns and priors of a candidate.
fn unknowns(candidate: &Candidate, scales: &Scales) -> (Vec<Unknown>, Vec<(usize, f64, f64)>) {
    let n = candidate.coordinates.freedoms();
    let free = |scale| Unknown { scale, lower: f64::NEG_INFINITY, upper: f64::INFINITY };
    // Rotations are in radians.
    let turns = if candidate.coordinates.has_rotation() { 3 } else { 0 };
    let sizes: Vec<f64> = (0..n).map(|i| if i < turns { 1.0 } else { scales.length }).collect();
    let mut unknowns: Vec<Unknown> = sizes.iter().map(|&size| free(size)).collect();
    unknowns.extend(sizes.iter().map(|&size| free(size / scales.time)));
    // Along one axis the path has a middle and an extent, whatever is measured along it.
    let along_one_axis = (n == 1).then_some((scales.origin[0], scales.length));
    let constants = candidate.starts(scales).swap_remove(0);
    let mut priors = Vec::new();
    for (parameter, constant) in candidate.parameters(scales).into_iter().zip(constants) {
        if parameter.entry == Entry::Place {
            let (middle, extent) = along_one_axis.unwrap_or((parameter.origin, parameter.scale));
            priors.push((unknowns.len(), middle, CENTRE_PRIOR * extent));
        }
        if parameter.spread.is_finite() {
            priors.push((unknowns.len(), constant, parameter.spread));
        }
        let (lower, upper) = match parameter.entry {
            Entry::Constant => (constant, constant),
            _ => (parameter.lower, parameter.upper),
        };
        unknowns.push(Unknown { scale: parameter.scale, lower, upper });
    }
    (unknowns, priors)
}
