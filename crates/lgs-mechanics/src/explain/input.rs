//! Checks of what an explanation is asked for.

use super::options::Options;
use crate::candidate::Candidate;
use crate::coordinates::Coordinates;
use crate::error::MechanicsError;
use crate::thresholds::FEWEST_TIMES;

fn size(what: &str, expected: usize, found: usize) -> MechanicsError {
    MechanicsError::Size { what: what.to_owned(), expected, found }
}

fn bounds(what: &str, value: f64, allowed: &str) -> MechanicsError {
    MechanicsError::OutOfBounds { what: what.to_owned(), value, allowed: allowed.to_owned() }
}

/// Checks that all candidates have the same kind of coordinates and that the track suits them; returns its
/// configurations with unit quaternions whose signs are continuous.
pub(crate) fn check_track(
    candidates: &[Candidate],
    times: &[f64],
    x: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>, MechanicsError> {
    let first = candidates.first().ok_or_else(|| size("candidates of an explanation", 1, 0))?;
    let coordinates = &first.coordinates;
    if times.len() < FEWEST_TIMES {
        return Err(size("times of a track", FEWEST_TIMES, times.len()));
    }
    if x.len() != times.len() {
        return Err(size("configurations of a track", times.len(), x.len()));
    }
    let odd = candidates.iter().find(|candidate| candidate.coordinates.name() != coordinates.name());
    let mut rows = x.iter().map(Vec::len).chain(odd.map(|candidate| candidate.coordinates.len()));
    if let Some(found) = rows.find(|&found| found != coordinates.len()) {
        return Err(size("coordinates of a track", coordinates.len(), found));
    }
    if let Some(&value) = times.iter().chain(x.iter().flatten()).find(|value| !value.is_finite()) {
        return Err(bounds("a number of a track", value, "a finite number"));
    }
    if let Some(pair) = times.windows(2).find(|pair| pair[1] <= pair[0]) {
        return Err(bounds("a time of a track", pair[1], &format!("more than {}, the one before", pair[0])));
    }
    Ok(continuous(coordinates, x))
}

/// Checks the options of an explanation.
pub(super) fn check_options(coordinates: &Coordinates, options: &Options) -> Result<(), MechanicsError> {
    if !options.levers.is_empty() && options.levers.len() != coordinates.freedoms() {
        return Err(size("levers", coordinates.freedoms(), options.levers.len()));
    }
    if options.tolerance.is_nan() || options.tolerance <= 0.0 {
        return Err(bounds("the tolerance of a forecast", options.tolerance, "a positive number"));
    }
    Ok(())
}

/// Configurations with unit quaternions whose signs are continuous.
fn continuous(coordinates: &Coordinates, x: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut rows = x.to_vec();
    if !coordinates.has_rotation() {
        return rows;
    }
    let mut last: Option<[f64; 4]> = None;
    for row in &mut rows {
        let length = row[..4].iter().map(|q| q * q).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let flipped =
            last.is_some_and(|last| last.iter().zip(row.iter()).map(|(a, b)| a * b).sum::<f64>() < 0.0);
        let factor = if flipped { -1.0 } else { 1.0 } / length;
        row[..4].iter_mut().for_each(|q| *q *= factor);
        last = row[..4].try_into().ok();
    }
    rows
}
