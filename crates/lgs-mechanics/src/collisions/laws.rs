//! The law between impacts: one for all flights of a track, each with a start of its own.

use super::body::{Body, Observed};
use super::effort::Effort;
use super::flights::trimmed;
use super::thresholds::{MOST_BLURRED, MOST_STEPS_OF_SAMPLE, OF_SCALE};
use crate::candidate::Candidate;
use crate::choose::{PARSIMONY, simplicity};
use crate::coordinates::{Coordinates, Port, State};
use crate::error::MechanicsError;
use crate::fit::{Shared, Track, first_values, interval, shoot_each};
use crate::law::Law;
use crate::noise::Noise;
use crate::terms::{Scales, Term};
use crate::thresholds::{FEWEST_TIMES, GOOD, SHOTS};
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

/// A law of one half of a body's freedoms, fitted to its flights.
struct Half {
    candidate: Candidate,
    shared: Shared,
    noise: Vec<Noise>,
    samples: f64,
    scales: Scales,
}

/// The law of all flights.
pub(super) struct FlightLaw {
    /// Coordinates and terms of the whole body.
    pub(super) candidate: Candidate,
    pub(super) parameters: Vec<f64>,
    pub(super) bounds: Vec<[f64; 2]>,
    /// Typical sizes of the parameters.
    pub(super) scales: Vec<f64>,
    /// Step that resolves the motion, as far as samples do.
    pub(super) step: f64,
    /// Flights that were fitted, and their states at their first samples.
    pub(super) flights: Vec<(Range<usize>, State)>,
    /// Noise of each component.
    pub(super) noise: Vec<Noise>,
    /// Samples at each side of an impact that smearing spoils.
    pub(super) blurred: usize,
    /// χ² for each independent sample.
    pub(super) chi_square: f64,
    /// What contacts with this law may still cost.
    pub(super) effort: Effort,
}

impl FlightLaw {
    /// The law by itself.
    pub(super) fn motion(&self) -> Result<Law, MechanicsError> {
        let Candidate { coordinates, terms, .. } = &self.candidate;
        Law::new(coordinates.clone(), terms.clone(), self.parameters.clone(), self.step)
    }

    /// Samples that are smeared by an impact: those beside the ends of flights.
    pub(super) fn left_out(&self, flights: &[Range<usize>], samples: usize) -> Vec<bool> {
        let ends = flights.iter().flat_map(|flight| [flight.start, flight.end]);
        let ends: Vec<usize> = ends.filter(|end| (1..samples).contains(end)).collect();
        let is_out = |k: usize| ends.iter().any(|end| k + self.blurred >= *end && k < end + self.blurred);
        (0..samples).map(is_out).collect()
    }

    /// Sizes of changes of the start, of its velocity and of the parameters.
    pub(super) fn scales_of_changes(&self, duration: f64) -> Vec<f64> {
        let places: Vec<f64> = self.noise.iter().map(|noise| noise.deviation).collect();
        let rates = places.iter().map(|place| place / duration);
        places.iter().copied().chain(rates).chain(self.scales.iter().map(|scale| OF_SCALE * scale)).collect()
    }

    /// The noise of the least known component of the place.
    pub(super) fn noise_of_place(&self) -> Noise {
        let [x, y, z] = std::array::from_fn(|i| self.noise[self.noise.len() - 3 + i]);
        [y, z].into_iter().fold(x, |a, b| if b.deviation > a.deviation { b } else { a })
    }
}

/// Laws of the flights of one body, each found once: the same flights come with several planes.
pub(super) struct FlightLaws<'a> {
    body: &'a Body,
    seen: &'a Observed<'a>,
    /// χ² for each independent sample above which a law does not count as one.
    most: f64,
    found: RefCell<Vec<Found>>,
    effort: Effort,
}

/// Flights and their law.
type Found = (Vec<Range<usize>>, Option<Rc<FlightLaw>>);

impl<'a> FlightLaws<'a> {
    pub(super) fn new(body: &'a Body, seen: &'a Observed<'a>, most: f64) -> Self {
        Self { body, seen, most, found: RefCell::default(), effort: Effort::default() }
    }

    /// The law of flights, with as few samples left out at impacts as explain the rest; `None` if the first
    /// flight is too short or there is no law.
    pub(super) fn of(&self, flights: &[Range<usize>]) -> Option<Rc<FlightLaw>> {
        if let Some((_, law)) = self.found.borrow().iter().find(|(known, _)| known == flights) {
            return law.clone();
        }
        let blurred = |count: usize| with_blur(self.body, self.seen, flights, count);
        let law = self.sought(&blurred);
        self.found.borrow_mut().push((flights.to_vec(), law.clone()));
        law
    }

    /// The law of flights if it is that of all of them, also where the first one alone has a likelier one.
    pub(super) fn of_all(&self, flights: &[Range<usize>]) -> Option<Rc<FlightLaw>> {
        self.sought(&|count| {
            let parts = trimmed(flights, count, self.seen.times.len());
            let are_long = parts.iter().all(|part| part.len() >= FEWEST_TIMES);
            if are_long { of_parts(self.body, self.seen, &parts, count) } else { None }
        })
    }

    /// The law with as few samples left out as explain the rest, of those by how many are left out.
    fn sought(&self, blurred: &dyn Fn(usize) -> Option<FlightLaw>) -> Option<Rc<FlightLaw>> {
        // What no law describes without the most samples, none describes with more of them.
        let (last, mut best) = (0..=MOST_BLURRED).rev().find_map(|count| Some((count, blurred(count)?)))?;
        if best.chi_square > self.most {
            return None;
        }
        for law in (0..last).map_while(blurred) {
            let good = law.chi_square <= GOOD;
            if good || law.chi_square <= best.chi_square {
                best = law;
            }
            if good {
                break;
            }
        }
        Some(Rc::new(FlightLaw { effort: self.effort.clone(), ..best }))
    }
}

fn with_blur(body: &Body, seen: &Observed, flights: &[Range<usize>], blurred: usize) -> Option<FlightLaw> {
    let parts = trimmed(flights, blurred, seen.times.len());
    let long: Vec<Range<usize>> = parts.iter().filter(|part| part.len() >= FEWEST_TIMES).cloned().collect();
    if long.first()?.start != 0 {
        return None;
    }
    let all = of_parts(body, seen, &long, blurred)?;
    if all.chi_square <= GOOD || long.len() == 1 {
        return Some(all);
    }
    // A later stretch may not be free: the body slides or rests there.
    let first = of_parts(body, seen, &long[..1], blurred)?;
    Some(if first.chi_square < all.chi_square { first } else { all })
}

fn of_parts(body: &Body, seen: &Observed, parts: &[Range<usize>], blurred: usize) -> Option<FlightLaw> {
    let [turn, place] = seen.least;
    let at = body.coordinates.len() - 3;
    let center = chosen(&body.centers, seen, (parts, at..at + 3), [0.0, place])?;
    let mut halves = vec![center];
    if at > 0 {
        halves.insert(0, chosen(&body.spins, seen, (parts, 0..4), [turn, 0.0])?);
    }
    let candidate = whole(&body.coordinates, &halves)?;
    let values = |half: &Half| half.shared.law.parameters.clone();
    let bounds = |half: &Half| half.shared.bounds.clone();
    let scales = |half: &Half| -> Vec<f64> {
        half.candidate.parameters(&half.scales).iter().map(|parameter| parameter.scale).collect()
    };
    let state = |k: usize| State {
        x: halves.iter().flat_map(|half| half.shared.starts[k].x.clone()).collect(),
        v: halves.iter().flat_map(|half| half.shared.starts[k].v.clone()).collect(),
    };
    let samples: f64 = halves.iter().map(|half| half.samples).sum();
    let loss: f64 = halves.iter().map(|half| half.shared.loss).sum();
    Some(FlightLaw {
        candidate,
        parameters: in_order(&body.coordinates, &halves, values),
        bounds: in_order(&body.coordinates, &halves, bounds),
        scales: in_order(&body.coordinates, &halves, scales),
        step: (halves.iter().map(|half| half.shared.law.step).fold(f64::INFINITY, f64::min))
            .max(interval(seen.times) / MOST_STEPS_OF_SAMPLE),
        flights: parts.iter().cloned().enumerate().map(|(k, part)| (part, state(k))).collect(),
        noise: halves.iter().flat_map(|half| half.noise.clone()).collect(),
        blurred,
        chi_square: loss / samples.max(1.0),
        effort: Effort::default(),
    })
}

/// The likeliest of the laws of some components of the configurations.
fn chosen(
    list: &[Candidate],
    seen: &Observed,
    (parts, components): (&[Range<usize>], Range<usize>),
    least: [f64; 2],
) -> Option<Half> {
    let coordinates = &list.first()?.coordinates;
    let track = |part: &Range<usize>| {
        let rows: Vec<Vec<f64>> =
            seen.x[part.clone()].iter().map(|x| x[components.clone()].to_vec()).collect();
        Track::new(coordinates, seen.samples(part.clone()), &rows)
    };
    let mut tracks: Vec<Track> = parts.iter().map(track).collect();
    Track::share_noise(&mut tracks);
    let tracks: Vec<Track> = tracks.into_iter().map(|track| track.coarsened(coordinates, least)).collect();
    let longest = tracks.iter().max_by_key(|track| track.times.len())?;
    let scales = longest.scales(coordinates);
    let samples: f64 = tracks.iter().map(Track::independent_samples).sum();
    let mut best: Option<(f64, Candidate, Shared)> = None;
    for candidate in list {
        let Some(shared) = fitted(candidate, (&tracks, longest), &scales, samples) else { continue };
        let penalty = samples.max(1.0).ln() * candidate.unknown_count() as f64;
        let score = shared.loss + penalty + PARSIMONY * simplicity(candidate) as f64;
        if best.as_ref().is_none_or(|(least, ..)| score < *least) {
            best = Some((score, candidate.clone(), shared));
        }
    }
    let (_, candidate, shared) = best?;
    let noise = tracks[0].noise.clone();
    Some(Half { candidate, shared, noise, samples, scales })
}

/// The best fit of a candidate from several first values.
fn fitted(
    candidate: &Candidate,
    (tracks, longest): (&[Track], &Track),
    scales: &Scales,
    samples: f64,
) -> Option<Shared> {
    let mut best: Option<Shared> = None;
    for first in first_values(candidate, longest, scales, SHOTS) {
        let found = shoot_each(candidate, tracks, scales, &first);
        best = best.into_iter().chain(found).min_by(|a, b| a.loss.total_cmp(&b.loss));
        if best.as_ref().is_some_and(|shared| shared.loss <= GOOD * samples) {
            break;
        }
    }
    best
}

/// The candidate of the whole body: terms of the centre, then those of the rotation.
fn whole(coordinates: &Coordinates, halves: &[Half]) -> Option<Candidate> {
    let [spin, center] = halves else { return Some(halves.first()?.candidate.clone()) };
    let inertia = *spin.candidate.coordinates.inertia()?;
    debug_assert!(matches!(coordinates, Coordinates::Rigid(_)));
    let on_center = |term: &Term| Term { kind: term.kind, port: Port::Center };
    let terms = center.candidate.terms.iter().map(on_center).chain(spin.candidate.terms.iter().copied());
    Candidate::new(Coordinates::Rigid(inertia), terms.collect()).ok()
}

/// Values of all parameters of the whole body: those of the inertia, of the centre's terms, of the
/// rotation's.
fn in_order<T>(coordinates: &Coordinates, halves: &[Half], values: impl Fn(&Half) -> Vec<T>) -> Vec<T> {
    if !coordinates.has_rotation() {
        return halves.first().map(values).unwrap_or_default();
    }
    let [spin, center] = halves else { return Vec::new() };
    let mut all = values(spin);
    let of_terms = all.split_off(spin.candidate.coordinates.parameters().len());
    all.extend(values(center));
    all.extend(of_terms);
    all
}
