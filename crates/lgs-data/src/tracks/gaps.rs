//! Gaps of point tracks: short ones are filled, points with long ones are left out.
//!
//! A gap between two samples of a point is short if it takes at most a twentieth of the recording
//! ([`LONGEST_FILLED_GAP`]). In it the point follows the cubic through the two samples before and the two
//! after: constant acceleration is reproduced exactly. A point that is not seen at the recording's first or
//! last time is left out: nothing says where it was. The recording begins and ends where any point is seen.

use super::error::TracksProblem;
use super::recording::PointTracks;
use crate::thresholds::LONGEST_FILLED_GAP;

/// Points that are known at every time.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeTracks {
    /// Names of the points, `[n]`.
    pub labels: Vec<String>,
    /// Times `[T]`, strictly ascending from 0.
    pub times: Vec<f64>,
    /// Positions `[T][n]`: metres where the file's unit is known, its own lengths otherwise.
    pub positions: Vec<Vec<[f32; 3]>>,
    /// Number of samples that stand in filled gaps.
    pub filled: usize,
    /// Names of the points that are left out.
    pub left_out: Vec<String>,
}

impl PointTracks {
    /// The points that are seen throughout, but for short gaps.
    ///
    /// # Errors
    /// If there is no such point.
    pub fn whole(&self) -> Result<WholeTracks, TracksProblem> {
        let is_seen = |row: &Vec<Option<[f32; 3]>>| row.iter().any(Option::is_some);
        let first = self.points.iter().position(is_seen).ok_or(TracksProblem::Empty("seen points"))?;
        let last = self.points.iter().rposition(is_seen).unwrap_or(first);
        let times: Vec<f64> = self.times[first..=last].iter().map(|t| t - self.times[first]).collect();
        let end = times.last().copied().unwrap_or(0.0);
        let longest = LONGEST_FILLED_GAP * end;
        let (mut labels, mut columns, mut left_out, mut filled) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for (point, label) in self.labels.iter().enumerate() {
            let column = self.points[first..=last].iter().map(|row| row[point]).collect::<Vec<_>>();
            match whole_column(&times, &column, longest) {
                Some(positions) => {
                    filled += column.iter().filter(|sample| sample.is_none()).count();
                    labels.push(label.clone());
                    columns.push(positions);
                }
                None => left_out.push(label.clone()),
            }
        }
        if columns.is_empty() {
            return Err(TracksProblem::NoWholeTrack { end, longest, points: self.labels.len() });
        }
        let scale = self.unit.scale();
        let row = |t: usize| columns.iter().map(|column| column[t].map(|v| (scale * v) as f32)).collect();
        let positions = (0..times.len()).map(row).collect();
        Ok(WholeTracks { labels, times, positions, filled, left_out })
    }
}

/// A point's positions at all times; nothing if it is not seen at both ends, or has a gap that is too long.
fn whole_column(times: &[f64], column: &[Option<[f32; 3]>], longest: f64) -> Option<Vec<[f64; 3]>> {
    let known: Vec<usize> = (0..column.len()).filter(|&t| column[t].is_some()).collect();
    if known.first() != Some(&0) || known.last() != Some(&(column.len() - 1)) {
        return None;
    }
    let sample = |t: usize| column[t].unwrap_or_default().map(f64::from);
    let mut positions = vec![sample(0)];
    for (at, pair) in known.windows(2).enumerate() {
        if pair[1] > pair[0] + 1 {
            if times[pair[1]] - times[pair[0]] > longest {
                return None;
            }
            let around = &known[at.saturating_sub(1)..known.len().min(at + 3)];
            positions.extend((pair[0] + 1..pair[1]).map(|t| through(times, around, &sample, times[t])));
        }
        positions.push(sample(pair[1]));
    }
    Some(positions)
}

/// The polynomial through some samples, at a time (Lagrange's form).
fn through(times: &[f64], nodes: &[usize], sample: &impl Fn(usize) -> [f64; 3], time: f64) -> [f64; 3] {
    let share = |node: usize| -> f64 {
        let others = nodes.iter().filter(|&&other| other != node);
        others.map(|&other| (time - times[other]) / (times[node] - times[other])).product()
    };
    let mut position = [0.0; 3];
    for &node in nodes {
        let (share, value) = (share(node), sample(node));
        (0..3).for_each(|axis| position[axis] += share * value[axis]);
    }
    position
}
