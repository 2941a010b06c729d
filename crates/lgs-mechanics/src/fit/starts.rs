//! Starting values: scales of a path, the point where accelerations meet, and regression from several places.

use super::Track;
use super::regression::{Regression, regress};
use crate::Candidate;
use crate::terms::{Entry, Scales};
use nalgebra::{Matrix3, Vector3};

/// Scales of a path: its root mean square extent in each direction makes the axes, twice the largest one the
/// length.
pub(super) fn scales_of(places: &[&[f64]], times: &[f64]) -> Scales {
    let point = |p: &&[f64]| Vector3::from_fn(|i, _| p.get(i).copied().unwrap_or(0.0));
    let count = places.len().max(1) as f64;
    let mean = places.iter().map(point).sum::<Vector3<f64>>() / count;
    let spread: Matrix3<f64> = places.iter().map(|p| (point(p) - mean) * (point(p) - mean).transpose()).sum();
    let eigen = (spread / count).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let axis = |i: usize| {
        let column = eigen.eigenvectors.column(order[i]);
        [column[0], column[1], column[2]]
    };
    let length = 2.0 * eigen.eigenvalues[order[0]].max(0.0).sqrt();
    let time = times.last().zip(times.first()).map_or(1.0, |(last, first)| last - first);
    Scales {
        length: length.max(f64::MIN_POSITIVE),
        time,
        origin: mean.into(),
        axes: [axis(0), axis(1), axis(2)],
    }
}

/// The point nearest to the lines along the accelerations of a path in space, the centre of a central force.
fn meeting_point(track: &Track) -> Option<[f64; 3]> {
    let mut matrix = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for (state, acceleration) in &track.smooth {
        let a = Vector3::from_column_slice(acceleration);
        let across = Matrix3::identity() * a.norm_squared() - a * a.transpose();
        matrix += across;
        right += across * Vector3::from_column_slice(&state.x);
    }
    let point = matrix.try_inverse()? * right;
    point.iter().all(|p| p.is_finite()).then(|| point.into())
}

/// The candidate's own starts, those of them with a fitted centre once more with the centre where the
/// accelerations meet.
fn all_starts(candidate: &Candidate, track: &Track, scales: &Scales) -> Vec<Vec<f64>> {
    let mut starts = candidate.starts(scales);
    let table = candidate.parameters(scales);
    let places: Vec<usize> = (0..table.len()).filter(|&i| table[i].entry == Entry::Place).collect();
    if candidate.coordinates.freedoms() != 3 || candidate.coordinates.has_rotation() || places.len() != 3 {
        return starts;
    }
    if let Some(point) = meeting_point(track) {
        let moved = |start: &Vec<f64>| {
            let mut start = start.clone();
            places.iter().zip(point).for_each(|(&i, p)| start[i] = p.clamp(table[i].lower, table[i].upper));
            start
        };
        let mut more: Vec<Vec<f64>> = starts.iter().map(moved).collect();
        more.dedup();
        starts.extend(more);
    }
    starts
}

/// First values of the parameters, the best first, at most `most`.
#[must_use]
pub fn first_values(candidate: &Candidate, track: &Track, scales: &Scales, most: usize) -> Vec<Vec<f64>> {
    let starts = all_starts(candidate, track, scales);
    let mut found: Vec<Regression> = starts.iter().filter_map(|s| regress(candidate, track, s)).collect();
    found.sort_by(|a, b| a.left.total_cmp(&b.left));
    let mut values: Vec<Vec<f64>> = found.into_iter().map(|regression| regression.parameters).collect();
    values.dedup();
    values.truncate(most);
    values
}
