//! What two flights tell of the impact between them.

use super::body::Observed;
use super::laws::FlightLaw;
use super::thresholds::MEETINGS;
use crate::contact::Impact;
use crate::coordinates::State;
use crate::edit::Edit;
use crate::system::System;
use glam::DVec3;
use std::ops::Range;

/// An impact as the flights before and after it have it.
pub(super) struct Met {
    /// Configuration.
    pub(super) x: Vec<f64>,
    /// Velocity of the centre before, if there are flights on both sides.
    pub(super) before: Option<DVec3>,
    /// Change of that velocity.
    pub(super) change: DVec3,
    /// Time since the start of the track and change of all velocities, if there are flights on both sides.
    pub(super) impulse: Option<Impact>,
}

/// The impact at the end of a flight: where it meets the next one, or as the samples around it have it.
pub(super) fn meeting(
    seen: &Observed,
    law: &FlightLaw,
    (flights, impacts): (&[Range<usize>], &[Impact]),
    index: usize,
) -> Option<Met> {
    let since = seen.since();
    let end = flights[index].end;
    let fitted = |flight: &Range<usize>| law.flights.iter().find(|(own, _)| flight.contains(&own.start));
    let both = fitted(&flights[index]).zip(flights.get(index + 1).and_then(fitted));
    let Some(((earlier, start), (later, after))) = both else {
        let is_next = |impact: &&Impact| impact.time >= seen.times[end - 1];
        let change = DVec3::from(*impacts.iter().find(is_next)?.change.last_chunk::<3>()?);
        return Some(Met { x: seen.x.get(end)?.clone(), before: None, change, impulse: None });
    };
    let motion = law.motion().ok()?;
    let system = System::new(&motion, Edit::NONE);
    let at = |state: &State, time: f64| Some(system.states(state, &[time]).ok()?.swap_remove(0));
    let tail = |values: &[f64]| DVec3::from_slice(&values[values.len() - 3..]);
    let mut time = 0.5 * (since[end - 1] + since[end.min(since.len() - 1)]);
    let mut found = None;
    for _ in 0..MEETINGS {
        let before = at(start, time - since[earlier.start])?;
        let after = at(after, time - since[later.start])?;
        let change = tail(&after.v) - tail(&before.v);
        let changes = after.v.iter().zip(&before.v).map(|(after, before)| after - before).collect();
        let impulse = Some(Impact { time, change: changes });
        found = Some(Met { x: before.x.clone(), before: Some(tail(&before.v)), change, impulse });
        let apart =
            (tail(&after.x) - tail(&before.x)).dot(change) / change.length_squared().max(f64::MIN_POSITIVE);
        time = (time - apart).clamp(since[earlier.end - 1], since[later.start]);
    }
    found
}
