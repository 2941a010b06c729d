//! Impulses at given times: changes of velocity by what is outside of a law.

use crate::contact::Impact;
use crate::integrate::Solved;

/// Something that moves freely and whose velocity can be changed.
pub(super) trait Struck {
    /// Free motion over a time that may be negative.
    fn move_freely(&mut self, h: f64) -> Solved;
    /// Adds so many times a change to the velocity.
    fn change(&mut self, velocity: &[f64], sign: f64);
}

/// Moves from one time to another through the impulses between them. Forward, one at the end is part of the
/// motion; backward, one at the end is not taken back, so that a motion returns to where it came from.
pub(super) fn pass(moving: &mut impl Struck, impulses: &[Impact], [from, to]: [f64; 2]) -> Solved {
    let [low, high] = [from.min(to), from.max(to)];
    let is_between = |impulse: &&Impact| impulse.time > low && impulse.time <= high;
    let sign = if to < from { -1.0 } else { 1.0 };
    let mut between: Vec<&Impact> = impulses.iter().filter(is_between).collect();
    if sign < 0.0 {
        between.reverse();
    }
    let mut time = from;
    for impulse in between {
        moving.move_freely(impulse.time - time)?;
        moving.change(&impulse.change, sign);
        time = impulse.time;
    }
    moving.move_freely(to - time)
}
