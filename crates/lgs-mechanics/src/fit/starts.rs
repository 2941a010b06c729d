//! Starting values: scales of a path, the point where accelerations meet, and regression from several places.

use super::levenberg::{Problem, Settings, Unknown, minimise};
use super::regression::{Regression, regress};
use super::track::Track;
use crate::candidate::{Candidate, FreeParameter};
use crate::terms::{Entry, Scales};
use crate::thresholds::{APART, AROUND, IMPROVED};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{inverse, outer, scalar};
use nalgebra::DVector;

/// The point nearest to the lines along the accelerations of a path in space, the centre of a central force.
fn meeting_point(track: &Track) -> Option<[f64; 3]> {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for (state, acceleration) in &track.smooth {
        let a = DVec3::from_slice(acceleration);
        let across = scalar(a.length_squared()) - outer(a, a);
        matrix += across;
        right += across * DVec3::from_slice(&state.x);
    }
    let point = inverse(&matrix)? * right;
    point.is_finite().then(|| point.to_array())
}

/// Places where the centre of a force on a point may lie: where accelerations meet, and around the path.
fn centers(track: &Track, scales: &Scales) -> Vec<[f64; 3]> {
    let mut found: Vec<[f64; 3]> = meeting_point(track).into_iter().collect();
    for axis in scales.axes {
        for distance in [AROUND, -AROUND] {
            let step = distance * scales.length;
            found.push(std::array::from_fn(|i| scales.origin[i] + step * axis[i]));
        }
    }
    found
}

/// The candidate's own starts, those of them with a fitted centre once more with other centres.
fn all_starts(candidate: &Candidate, track: &Track, scales: &Scales) -> Vec<Vec<f64>> {
    let mut starts = candidate.starts(scales);
    let table = candidate.parameters(scales);
    let places: Vec<usize> = (0..table.len()).filter(|&i| table[i].entry == Entry::Place).collect();
    if candidate.coordinates.freedoms() != 3 || candidate.coordinates.has_rotation() || places.len() != 3 {
        return starts;
    }
    let own = starts.clone();
    for point in centers(track, scales) {
        let moved = |start: &Vec<f64>| {
            let mut start = start.clone();
            places.iter().zip(point).for_each(|(&i, p)| start[i] = p.clamp(table[i].lower, table[i].upper));
            start
        };
        starts.extend(own.iter().map(moved));
    }
    starts
}

/// Regression of what enters linearly, as a function of the other parameters.
struct Places<'a> {
    candidate: &'a Candidate,
    track: &'a Track,
    parameters: &'a [f64],
    /// Parameters that do not enter linearly, and their bounds.
    indices: Vec<usize>,
    unknowns: Vec<Unknown>,
}

impl Places<'_> {
    fn regress(&self, values: &[f64]) -> Option<Regression> {
        let mut parameters = self.parameters.to_vec();
        self.indices.iter().zip(values).for_each(|(&i, value)| parameters[i] = *value);
        regress(self.candidate, self.track, &parameters)
    }
}

impl Problem for Places<'_> {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        self.regress(values).map(|regression| regression.residuals)
    }
}

/// Moves places and exponents such that the regression leaves less.
fn improved(candidate: &Candidate, track: &Track, scales: &Scales, from: Regression) -> Regression {
    let table = candidate.parameters(scales);
    let mut indices: Vec<usize> = (0..table.len()).collect();
    indices.retain(|&i| matches!(table[i].entry, Entry::Place | Entry::Nonlinear));
    let unknown = |&i: &usize| {
        let FreeParameter { scale, lower, upper, .. } = table[i];
        Unknown { scale, lower, upper }
    };
    let unknowns: Vec<Unknown> = indices.iter().map(unknown).collect();
    let values: Vec<f64> = indices.iter().map(|&i| from.parameters[i]).collect();
    // What is left is relative to the forces: a change by a millionth is below any noise.
    let settings =
        Settings { iterations: 12, threshold: f64::INFINITY, tolerance: 1e-6, ..Settings::default() };
    let problem = Places { candidate, track, parameters: &from.parameters, indices, unknowns };
    let minimum = minimise(&problem, &values, &settings);
    let better = minimum.and_then(|m| problem.regress(&m.values)).filter(|r| r.left < from.left);
    better.unwrap_or(from)
}

/// First values of the parameters, the best first, at most `most`.
#[must_use]
pub fn first_values(candidate: &Candidate, track: &Track, scales: &Scales, most: usize) -> Vec<Vec<f64>> {
    let found = regressions(candidate, track, scales);
    found.into_iter().take(most).map(|regression| regression.parameters).collect()
}

/// The regressions behind them, the best first.
pub(crate) fn regressions(candidate: &Candidate, track: &Track, scales: &Scales) -> Vec<Regression> {
    let starts = all_starts(candidate, track, scales);
    let mut found: Vec<Regression> = starts.iter().filter_map(|s| regress(candidate, track, s)).collect();
    found.sort_by(|a, b| a.left.total_cmp(&b.left));
    found.dedup_by(|a, b| a.left - b.left <= APART * b.left);
    if candidate.columns() < candidate.parameter_count() {
        found.truncate(IMPROVED);
        found = found.into_iter().map(|r| improved(candidate, track, scales, r)).collect();
        found.sort_by(|a, b| a.left.total_cmp(&b.left));
        found.dedup_by(|a, b| a.left - b.left <= APART * b.left);
    }
    found
}
