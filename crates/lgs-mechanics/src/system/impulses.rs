//! Impulses at given times: changes of velocity by what is outside of a law.

use crate::contact::Impact;
use crate::integrate::Solved;

/// Something that moves freely and whose velocity can be changed.
pub(super) trait Struck {
    /// Motion without impulses over a time that may be negative.
    fn move_freely(&mut self, h: f64) -> Solved;
    /// Adds so many times a change to the velocity.
    fn change(&mut self, velocity: &[f64], sign: f64);
}

/// Moves over a step that may be negative, from a time, through the impulses within it. Forward, one at the
/// end is part of the motion; backward, one at the end is not taken back, so that a motion returns to where
/// it came from. A step without impulses is the step itself, to the last bit.
pub(super) fn pass(moving: &mut impl Struck, impulses: &[Impact], from: f64, h: f64) -> Solved {
    let to = from + h;
    let is_within = |impulse: &&Impact| impulse.time > from.min(to) && impulse.time <= from.max(to);
    let mut within: Vec<&Impact> = impulses.iter().filter(is_within).collect();
    if within.is_empty() {
        return moving.move_freely(h);
    }
    if h < 0.0 {
        within.reverse();
    }
    let mut time = from;
    for impulse in within {
        moving.move_freely(impulse.time - time)?;
        moving.change(&impulse.change, h.signum());
        time = impulse.time;
    }
    moving.move_freely(to - time)
}
