//! Free bodies: the laws of rotation, or of deformation, and of the centre are chosen apart, since no term
//! couples them.

use crate::candidate::Candidate;
use crate::choose::{Choice, Effort, Judged, among, judge, simplicity};
use crate::coordinates::{Ball, Coordinates, Inertia, Port, State};
use crate::fit::{Fitted, Track};
use crate::law::Law;
use crate::law::ranges;
use crate::terms::Term;
use nalgebra::DMatrix;

/// Degrees of freedom of a rotation or a centre.
const HALF: usize = 3;

/// A candidate of one half, and what came of it.
struct Half {
    candidate: Candidate,
    judged: Option<Judged>,
}

/// Chooses among the laws of a rigid body; the track of the whole body is the second value.
pub(super) fn choose(list: &[Candidate], times: &[f64], x: &[Vec<f64>]) -> Option<(Choice, Track)> {
    let part = |range: std::ops::Range<usize>| -> Vec<Vec<f64>> {
        x.iter().map(|x| x[range.clone()].to_vec()).collect()
    };
    let inertia = list.first()?.coordinates.inertia()?;
    let turning = Track::new(&turning_coordinates(inertia), times, &part(0..4));
    let moving = Track::new(&Coordinates::Point, times, &part(4..7));
    let whole = joined_track(&turning, &moving, x);
    if list.iter().any(|candidate| candidate.terms.iter().any(|term| term.port == Port::BodyAxes)) {
        let scales = whole.scales(&list[0].coordinates);
        return crate::choose::choose(list, &whole, &scales).map(|choice| (choice, whole));
    }
    let samples = turning.independent_samples() + moving.independent_samples();
    let [mut turns, mut moves]: [Vec<Half>; 2] = [Vec::new(), Vec::new()];
    let mut judged = Vec::new();
    for (index, candidate) in list.iter().enumerate() {
        let Some((turn, translation)) = halves(candidate) else { continue };
        let turn = fitted(&mut turns, turn, &turning);
        let translation = fitted(&mut moves, translation, &moving);
        if let (Some(turn), Some(translation)) = (turn, translation) {
            judged.extend(joined_law(index, candidate, [&turn, &translation]));
        }
    }
    among(judged, samples).map(|choice| (choice, whole))
}

/// A body's rotation alone is a ball joint without an arm.
fn turning_coordinates(inertia: &Inertia) -> Coordinates {
    Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.0; 3], inertia: *inertia })
}

/// The candidates of rotation and centre.
fn halves(candidate: &Candidate) -> Option<(Candidate, Candidate)> {
    let (moves, turns): (Vec<Term>, Vec<Term>) =
        candidate.terms.iter().copied().partition(|term| term.port == Port::Center);
    let moves = moves.into_iter().map(|term| Term { port: Port::Whole, ..term }).collect();
    let turning = turning_coordinates(candidate.coordinates.inertia()?);
    Some((Candidate::new(turning, turns).ok()?, Candidate::new(Coordinates::Point, moves).ok()?))
}

/// The fit of a candidate of one half, which is made once.
fn fitted(known: &mut Vec<Half>, candidate: Candidate, track: &Track) -> Option<Judged> {
    if let Some(half) = known.iter().find(|half| half.candidate == candidate) {
        return half.judged.clone();
    }
    let judged = judge(known.len(), &candidate, (track, &track.scales(&candidate.coordinates)), Effort::Full);
    known.push(Half { candidate, judged: judged.clone() });
    judged
}

/// The track of the whole body with the noise of both halves.
fn joined_track(turning: &Track, moving: &Track, x: &[Vec<f64>]) -> Track {
    let join = |a: &[f64], b: &[f64]| [a, b].concat();
    let mut smooth = turning.smooth.clone();
    for ((state, acceleration), (center, pull)) in smooth.iter_mut().zip(&moving.smooth) {
        state.x = join(&state.x, &center.x);
        state.v = join(&state.v, &center.v);
        *acceleration = join(acceleration, pull);
    }
    Track {
        times: turning.times.clone(),
        x: x.to_vec(),
        noise: [turning.noise.as_slice(), &moving.noise].concat(),
        sampling: turning.sampling.clone(),
        smooth,
    }
}

/// Where the unknowns of both halves stand among those of the whole: starts, velocities, own parameters of
/// the inertia, then those of the terms in their order. The centre comes last.
fn places(candidate: &Candidate) -> [Vec<usize>; 2] {
    let inertia = candidate.coordinates.parameters().len();
    let freedoms = candidate.coordinates.freedoms();
    let first = freedoms - HALF;
    let both = |own: std::ops::Range<usize>| own.clone().chain(own.start + freedoms..own.end + freedoms);
    let (mut turn, mut translation): (Vec<usize>, Vec<usize>) =
        (both(0..first).collect(), both(first..freedoms).collect());
    turn.extend((0..inertia).map(|k| 2 * freedoms + k));
    for (term, range) in candidate.terms.iter().zip(ranges(&candidate.coordinates, &candidate.terms)) {
        let half = if term.port == Port::Center { &mut translation } else { &mut turn };
        half.extend(range.map(|k| 2 * freedoms + k));
    }
    [turn, translation]
}

/// The fit of a law of the whole body from those of its rotation, as a ball joint without an arm, or of its
/// deformation, and of its centre, as a point; `None` if its parameters are out of range.
pub fn joined_law(index: usize, candidate: &Candidate, [turn, translation]: [&Judged; 2]) -> Option<Judged> {
    let places = places(candidate);
    let size = places.iter().map(Vec::len).sum();
    let mut covariance = DMatrix::zeros(size, size);
    let mut values = vec![0.0; size];
    let mut bounds = vec![[0.0; 2]; size];
    let mut priors = Vec::new();
    let first = 2 * candidate.coordinates.freedoms();
    for (places, half) in places.iter().zip([&turn.fitted, &translation.fitted]) {
        priors.extend(half.priors.iter().map(|&(i, centre, deviation)| (places[i], centre, deviation)));
        for (i, &row) in places.iter().enumerate() {
            places.iter().enumerate().for_each(|(j, &column)| {
                covariance[(row, column)] = half.covariance[(i, j)];
            });
            if let Some(parameter) = i.checked_sub(2 * half.start.v.len()) {
                values[row] = half.law.parameters[parameter];
                bounds[row] = half.bounds[parameter];
            }
        }
    }
    let step = turn.fitted.law.step.min(translation.fitted.law.step);
    let (coordinates, terms) = (candidate.coordinates.clone(), candidate.terms.clone());
    let mut law = Law::new(coordinates, terms, values.split_off(first), step).ok()?;
    law.deviations = (first..size).map(|i| covariance[(i, i)].max(0.0_f64).sqrt()).collect();
    let [one, other] = [&turn.fitted, &translation.fitted];
    let start = State {
        x: [one.start.x.as_slice(), &other.start.x].concat(),
        v: [one.start.v.as_slice(), &other.start.v].concat(),
    };
    let (loss, bounds) = (one.loss + other.loss, bounds.split_off(first));
    let fitted = Fitted { law, start, loss, covariance, bounds, priors };
    let evidence = turn.evidence + translation.evidence;
    Some(Judged { index, fitted, evidence, simplicity: simplicity(candidate) })
}
