//! Flights: stretches of a track between impacts.

use crate::contact::{impacts, pieces};
use std::ops::Range;

/// Stretches between impacts, in order, of samples at ascending times: a flight ends at a jump of the
/// centre's velocity, and samples that touch a known plane are in none.
pub(super) fn flights(times: &[f64], centers: &[[f64; 3]], touching: &[bool]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    for piece in pieces(times, &impacts(times, centers)) {
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
