//! One law fitted to several tracks, each with a start of its own.

use super::levenberg::{Problem, Settings, Unknown};
use super::segments::Segments;
use super::track::Track;
use crate::candidate::Candidate;
use crate::coordinates::State;
use crate::law::Law;
use crate::terms::Scales;
use crate::thresholds::FINEST;

/// A law that several tracks share.
#[derive(Clone, Debug)]
pub struct Shared {
    /// The law.
    pub law: Law,
    /// State at the first time of each track.
    pub starts: Vec<State>,
    /// χ² of all tracks, robust and whitened, with the prior of centres.
    pub loss: f64,
    /// Smallest and largest allowed value of each parameter.
    pub bounds: Vec<[f64; 2]>,
}

/// Fits a candidate to several tracks from the starts of their smooth paths and first values of its
/// parameters; `None` if no motion could be followed.
#[must_use]
pub fn shoot_each(
    candidate: &Candidate,
    tracks: &[Track],
    scales: &Scales,
    parameters: &[f64],
) -> Option<Shared> {
    let tracks: Vec<Track> = tracks.iter().map(|track| track.part(0..track.times.len())).collect();
    let starts: Vec<State> = tracks.iter().map(|track| track.smooth[0].0.clone()).collect();
    let mut segments = Segments::new(candidate, &tracks, scales, &starts);
    let values = segments.values(parameters);
    let minimum = segments.minimise(&values, &Settings::default(), FINEST)?;
    let starts = segments.starts(&minimum.values);
    let own = segments.own(0, &minimum.values);
    let first = segments.parts.first()?;
    let parameters = 2 * candidate.coordinates.freedoms();
    let bound = |unknown: &Unknown| [unknown.lower, unknown.upper];
    let bounds = first.unknowns()[parameters..].iter().map(bound).collect();
    Some(Shared { law: first.law(&own)?, starts, loss: minimum.loss, bounds })
}
