//! Impacts: sudden changes of velocity, and where they are in a track.

use crate::error::MechanicsError;
use crate::thresholds::{
    FEWEST_OF_SIDE, IMPACT_JUMP, IMPACT_SIDE, LEAST_OF_LARGEST, MEDIAN_OF_THREE, NO_IMPACT, SIDES_OF_WINDOW,
};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A sudden change of velocity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Impact {
    /// Time, in the units of the law.
    pub time: f64,
    /// Change of the velocity, `[freedoms]`, or of the centre's alone, `[3]`, where it was read from a track.
    pub change: Vec<f64>,
}

/// The events that change a velocity, beside the largest change.
pub fn noticeable(events: &[Impact]) -> impl Iterator<Item = &Impact> {
    let size = |event: &Impact| event.change.iter().map(|change| change * change).sum::<f64>().sqrt();
    let largest = events.iter().map(size).fold(0.0, f64::max);
    events.iter().filter(move |event| size(event) > NO_IMPACT * largest)
}

/// Checks that events of a kind have the size of the coordinates, are finite, and their times ascend.
pub(crate) fn check_order(
    kind: &'static str,
    events: &[Impact],
    freedoms: usize,
) -> Result<(), MechanicsError> {
    for (index, event) in events.iter().enumerate() {
        if event.change.len() != freedoms {
            let what = format!("change of velocity of {kind} {index}");
            return Err(MechanicsError::Size { what, expected: freedoms, found: event.change.len() });
        }
        let numbers = event.change.iter().chain([&event.time]);
        if let Some(&value) = numbers.clone().find(|value| !value.is_finite()) {
            let (what, allowed) = (format!("a number of {kind} {index}"), "a finite number".to_owned());
            return Err(MechanicsError::OutOfBounds { what, value, allowed });
        }
        let before = index.checked_sub(1).map(|last| events[last].time);
        if let Some(before) = before.filter(|before| *before >= event.time) {
            return Err(MechanicsError::OutOfOrder { kind, index, time: event.time, before });
        }
    }
    Ok(())
}

/// A jump of the velocity between two samples.
struct Jump {
    /// The sample before it.
    before: usize,
    time: f64,
    change: DVec3,
    /// Length over the deviation that noise of unit deviation makes.
    size: f64,
}

/// Impacts in a path of a body's centre at ascending times, found where the velocities of parabolas through
/// the samples before and after differ by far more than elsewhere along the path, and not by little against
/// the largest difference. Where samples are dense, parabolas through more of them find what noise hides from
/// those through few.
#[must_use]
pub fn impacts(times: &[f64], centers: &[[f64; 3]]) -> Vec<Impact> {
    impacts_above(times, centers, LEAST_OF_LARGEST)
}

/// The same of changes of velocity that are at least a part of the largest one.
pub(crate) fn impacts_above(times: &[f64], centers: &[[f64; 3]], least_of_largest: f64) -> Vec<Impact> {
    let count = times.len().min(centers.len());
    let longest = count / SIDES_OF_WINDOW;
    let sides = std::iter::successors(Some(IMPACT_SIDE), |side| Some(2 * side).filter(|s| *s <= longest));
    let mut found: Vec<Jump> = Vec::new();
    for side in sides {
        for jump in jumps((times, centers), (count, side), least_of_largest) {
            if found.iter().all(|other| other.before.abs_diff(jump.before) >= side) {
                found.push(jump);
            }
        }
    }
    found.sort_by_key(|jump| jump.before);
    found.iter().map(|jump| Impact { time: jump.time, change: jump.change.to_array().to_vec() }).collect()
}

/// Jumps between sides of so many samples that stand out, the clearest first.
fn jumps(
    (times, centers): (&[f64], &[[f64; 3]]),
    (count, side): (usize, usize),
    least_of_largest: f64,
) -> Vec<Jump> {
    let fewest = FEWEST_OF_SIDE * side / IMPACT_SIDE;
    let last = count.saturating_sub(fewest);
    let mut jumps: Vec<Jump> =
        (fewest - 1..last).filter_map(|k| jump((times, centers), k, (count, side))).collect();
    let mut sizes: Vec<f64> = jumps.iter().map(|jump| jump.size).collect();
    sizes.sort_by(f64::total_cmp);
    // Most places are no impacts: their median jump is noise, or what parabolas leave of a smooth path.
    let Some(median) = sizes.get(sizes.len() / 2) else { return Vec::new() };
    let least = IMPACT_JUMP * median / MEDIAN_OF_THREE;
    // What a source wiggles by is small against what it shows of a true impact.
    let largest = jumps.iter().map(|jump| jump.change.length()).fold(0.0, f64::max);
    jumps.retain(|jump| jump.size > least && jump.change.length() >= least_of_largest * largest);
    jumps.sort_by(|a, b| b.size.total_cmp(&a.size));
    jumps
}

/// The jump between samples `k` and `k + 1`.
fn jump((times, centers): (&[f64], &[[f64; 3]]), k: usize, (count, side): (usize, usize)) -> Option<Jump> {
    let middle = 0.5 * (times[k] + times[k + 1]);
    let through = |range: Range<usize>| parabola(&times[range.clone()], &centers[range], middle);
    let (before, speed_before, noise_before) = through((k + 1).saturating_sub(side)..k + 1)?;
    let (after, speed_after, noise_after) = through(k + 1..(k + 1 + side).min(count))?;
    let change = speed_after - speed_before;
    let apart = (after - before).dot(change) / change.length_squared().max(f64::MIN_POSITIVE);
    let time = (middle - apart).clamp(times[k], times[k + 1]);
    let size = change.length() / (noise_before + noise_after).sqrt();
    Some(Jump { before: k, time, change, size })
}

/// Position and velocity at a time of the parabola through samples, and the variance of its velocity for
/// noise of unit variance.
fn parabola(times: &[f64], centers: &[[f64; 3]], at: f64) -> Option<(DVec3, DVec3, f64)> {
    let basis = DMatrix::from_fn(times.len(), 3, |row, power| (times[row] - at).powi(power as i32));
    let inverse = basis.tr_mul(&basis).try_inverse()?;
    let component = |axis: usize| {
        let values = DVector::from_iterator(centers.len(), centers.iter().map(|center| center[axis]));
        &inverse * basis.tr_mul(&values)
    };
    let found = [0, 1, 2].map(component);
    let row = |power: usize| DVec3::from_array([0, 1, 2].map(|axis| found[axis][power]));
    Some((row(0), row(1), inverse[(1, 1)]))
}

/// Ranges of samples between impacts: nothing is smooth across one.
#[must_use]
pub fn pieces(times: &[f64], impacts: &[Impact]) -> Vec<Range<usize>> {
    let at = |impact: &Impact| times.partition_point(|time| *time <= impact.time);
    let mut bounds: Vec<usize> = impacts.iter().map(at).collect();
    bounds.insert(0, 0);
    bounds.push(times.len());
    bounds.windows(2).map(|pair| pair[0]..pair[1]).filter(|range| !range.is_empty()).collect()
}
