//! Flights: stretches of a track between impacts.

use crate::contact::{Impact, impacts_above, pieces};
use glam::DVec3;
use std::ops::Range;

/// Sets of impacts that a track may hold, each at least a part of the largest: none, the most sudden jump of
/// the centre's velocity, the two most sudden ones, and so on. A learned track also wiggles at the ends of
/// its window and beside an impact, so that the evidence of the motions tells which of the jumps are impacts.
pub(super) fn nested_impacts(times: &[f64], centers: &[[f64; 3]], least: f64) -> Vec<Vec<Impact>> {
    let mut all = impacts_above(times, centers, least);
    let size = |impact: &Impact| DVec3::from_slice(&impact.change).length();
    all.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let first = |count: usize| {
        let mut set = all[..count].to_vec();
        set.sort_by(|a, b| a.time.total_cmp(&b.time));
        set
    };
    (0..=all.len()).map(first).collect()
}

/// Sets of impacts with hits at some times beside them; none if there are no such times within the track.
pub(super) fn with_hits(sets: &[Vec<Impact>], hits: &[f64], times: &[f64]) -> Vec<Vec<Impact>> {
    let is_within = |hit: &&f64| **hit > times[0] && **hit < times[times.len() - 1];
    let hits: Vec<f64> = hits.iter().filter(is_within).copied().collect();
    let sample = |time: f64| times.partition_point(|other| *other < time);
    let with = |set: &Vec<Impact>| {
        let is_new = |hit: &&f64| set.iter().all(|impact| sample(impact.time).abs_diff(sample(**hit)) > 1);
        let new = hits.iter().filter(is_new).map(|&time| Impact { time, change: Vec::new() });
        let mut all: Vec<Impact> = set.iter().cloned().chain(new).collect();
        all.sort_by(|a, b| a.time.total_cmp(&b.time));
        all
    };
    if hits.is_empty() { Vec::new() } else { sets.iter().map(with).collect() }
}

/// Stretches between impacts, in order, of samples at ascending times: a flight ends at an impact, and
/// samples that touch a known plane are in none.
pub(super) fn flights(times: &[f64], impacts: &[Impact], touching: &[bool]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    for piece in pieces(times, impacts) {
        let mut begin = piece.start;
        for k in piece.clone() {
            if touching[k] {
                found.push(begin..k);
                begin = k + 1;
            }
        }
        found.push(begin..piece.end);
    }
    found.retain(|range| !range.is_empty());
    found
}

/// The flights without a number of samples at each of their ends where an impact is: a source that smears
/// motion over time has the impact there.
pub(super) fn trimmed(flights: &[Range<usize>], count: usize, samples: usize) -> Vec<Range<usize>> {
    let one = |range: &Range<usize>| {
        let start = range.start + if range.start > 0 { count } else { 0 };
        let end = range.end.saturating_sub(if range.end < samples { count } else { 0 });
        start..end.max(start)
    };
    flights.iter().map(one).collect()
}
