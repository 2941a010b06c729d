//! Explanation of one object's motion: law, start, rivals, noise, bands and verdict from its configurations
//! over time.
//!
//! [`explain`] is the one entry for every kind of [`Coordinates`];
//! [`crate::choose::candidates`] lists laws for each of them.

mod blocked;
mod bodies;
mod explanation;
mod forecast;
mod input;
mod judge;
mod options;

pub use bodies::joined_law;
pub use explanation::Explanation;
pub use forecast::Forecast;
pub(crate) use input::check_track;
pub use options::Options;

use crate::bands::Verdict;
use crate::candidate::Candidate;
use crate::choose::choose;
use crate::coordinates::Coordinates;
use crate::error::MechanicsError;
use crate::fit::Track;

/// Explains the configurations `x` of one object at ascending `times` by one of the candidates.
///
/// Each row of `x` is a configuration in the candidates' coordinates, e. g. quaternion and centre of a rigid
/// body. Times may lie unevenly apart and have gaps. All candidates must have coordinates of the same size.
///
/// Errors: fewer than five times, times that do not ascend, rows of the wrong size or not finite, no
/// candidate, and none that could be fitted.
pub fn explain(
    candidates: &[Candidate],
    times: &[f64],
    x: &[Vec<f64>],
    options: &Options,
) -> Result<Explanation, MechanicsError> {
    let x = check_track(candidates, times, x)?;
    let coordinates = &candidates[0].coordinates;
    input::check_options(coordinates, options)?;
    let no_fit = || MechanicsError::NoFit { candidates: candidates.len() };
    let (choice, track) = match coordinates {
        Coordinates::Rigid(_) => bodies::choose(candidates, times, &x).ok_or_else(no_fit)?,
        _ => {
            let track = Track::new(coordinates, times, &x);
            let choice = choose(candidates, &track, &track.scales(coordinates)).ok_or_else(no_fit)?;
            (choice, track)
        }
    };
    let levers = match options.levers.is_empty() {
        true => coordinates.levers(),
        false => options.levers.clone(),
    };
    let first = times[0];
    let mut explanation = Explanation {
        candidates: candidates.to_vec(),
        choice,
        track,
        levers,
        path: 0.0,
        forecasts: [None, None],
        trusted: [first, first],
        verdict: Verdict::Outside,
        seed: options.seed,
    };
    judge::judge(&mut explanation, options);
    Ok(explanation)
}
