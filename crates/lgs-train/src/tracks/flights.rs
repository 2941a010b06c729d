//! Flights: stretches of time over which a thing stands apart from everything else that moves, and goes a
//! long way for its size. People who hold a ball and throw it give its flight away, and nothing else of it.

use lgs_core::linear::{norm, scale, sub};
use rayon::prelude::*;

use super::curve::median_of;
use super::isolated::{Isolated, are_alike, isolated};
use super::silhouettes::Silhouette;
use super::thresholds::{FEWEST_OF_FLIGHT, FLIGHT_STEP, LONGEST_STEP, SWERVE};

/// A thing in flight.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Flight {
    /// Number of the moment at which it begins.
    pub(super) first: usize,
    /// The thing at this moment and those that follow.
    pub(super) things: Vec<Isolated>,
    /// Median radius, world units.
    pub(super) radius: f32,
}

impl Flight {
    fn new(first: usize, things: Vec<Isolated>) -> Option<Self> {
        let radius = median_of(things.iter().map(|thing| thing.radius))?;
        let steps = things.windows(2).map(|pair| norm(sub(pair[1].position, pair[0].position)));
        let is_fast = median_of(steps)? > FLIGHT_STEP * radius;
        (is_fast && things.len() >= FEWEST_OF_FLIGHT).then_some(Self { first, things, radius })
    }
}

/// The silhouettes of every moment, ascending in time.
pub(super) fn by_moment(silhouettes: &[Silhouette]) -> Vec<(f32, Vec<&Silhouette>)> {
    let mut sorted: Vec<&Silhouette> = silhouettes.iter().collect();
    sorted.sort_by(|a, b| a.time.total_cmp(&b.time));
    let mut moments: Vec<(f32, Vec<&Silhouette>)> = Vec::new();
    for silhouette in sorted {
        match moments.last_mut() {
            Some((time, own)) if *time >= silhouette.time => own.push(silhouette),
            _ => moments.push((silhouette.time, vec![silhouette])),
        }
    }
    moments
}

/// The flights that the silhouettes of moments show, the longest first.
pub(super) fn flights(moments: &[(f32, Vec<&Silhouette>)]) -> Vec<Flight> {
    let times: Vec<f32> = moments.iter().map(|(time, _)| *time).collect();
    let mut things: Vec<Vec<Isolated>> = moments.par_iter().map(|(_, own)| isolated(own)).collect();
    let mut found = Vec::new();
    // The longest flight first; of those, the first.
    while let Some(flight) = longest(&times, &things) {
        for (at, thing) in (flight.first..).zip(&flight.things) {
            things[at].retain(|other| other != thing);
        }
        found.push(flight);
    }
    found
}

fn longest(times: &[f32], things: &[Vec<Isolated>]) -> Option<Flight> {
    let starts = (0..things.len().saturating_sub(1)).flat_map(|at| {
        things[at].iter().flat_map(move |a| things[at + 1].iter().map(move |b| (at, [*a, *b])))
    });
    let flights = starts.filter_map(|(at, pair)| Flight::new(at, followed(times, things, (at, pair))?));
    flights.reduce(|a, b| if b.things.len() > a.things.len() { b } else { a })
}

/// The things that continue a pair at successive moments, evenly to within [`SWERVE`] radii.
fn followed(
    times: &[f32],
    things: &[Vec<Isolated>],
    (first, pair): (usize, [Isolated; 2]),
) -> Option<Vec<Isolated>> {
    let way = norm(sub(pair[1].position, pair[0].position));
    if !are_alike(pair[0].radius, pair[1].radius) || way > LONGEST_STEP * pair[0].radius {
        return None;
    }
    let mut own = pair.to_vec();
    for at in first + 2..things.len() {
        let [a, b] = [own[own.len() - 2], own[own.len() - 1]];
        let ratio = (times[at] - times[at - 1]) / (times[at - 1] - times[at - 2]).max(f32::MIN_POSITIVE);
        let expected: [f32; 3] =
            std::array::from_fn(|i| b.position[i] + scale(sub(b.position, a.position), ratio)[i]);
        let off = |thing: &Isolated| norm(sub(thing.position, expected));
        let next = things[at].iter().filter(|thing| are_alike(thing.radius, b.radius));
        match next.min_by(|x, y| off(x).total_cmp(&off(y))).filter(|thing| off(thing) < SWERVE * b.radius) {
            Some(thing) => own.push(*thing),
            None => break,
        }
    }
    Some(own)
}
