//! Multiple shooting: segments of a track with a start each and the same parameters.
//!
//! Over a short segment a motion follows its start closely, so that the loss has few minima; the parameters
//! found there are the first values of longer segments, until one covers the track.

use super::levenberg::{Minimum, Problem, Settings, Unknown, minimise};
use super::shooting::{Shooting, interval};
use super::track::Track;
use crate::candidate::Candidate;
use crate::coordinates::State;
use crate::terms::Scales;
use crate::thresholds::{COARSE, ERROR_OF_DIFFERENCE, FAR, REFINEMENTS, SEGMENTS, STEP_ERROR};
use nalgebra::{DMatrix, DVector};

/// Segments as one problem: the starts of all segments `[segments, 2 n]`, then the parameters.
pub(super) struct Segments<'a> {
    pub(super) parts: Vec<Shooting<'a>>,
    unknowns: Vec<Unknown>,
    /// Unknowns of one start, `2 n`.
    start: usize,
}

impl<'a> Segments<'a> {
    /// Segments that begin at the starts; times of each count from 0.
    pub(super) fn new(
        candidate: &'a Candidate,
        tracks: &'a [Track],
        scales: &Scales,
        starts: &[State],
    ) -> Self {
        let part =
            |(track, start): (&'a Track, &State)| Shooting::new(candidate, track, scales, start.clone());
        let mut parts: Vec<Shooting> = tracks.iter().zip(starts).map(part).collect();
        let start = 2 * candidate.coordinates.freedoms();
        let own = parts.first().map_or(&[][..], |part| part.unknowns());
        let unknowns = [own[..start].repeat(parts.len()), own[start..].to_vec()].concat();
        parts.iter_mut().skip(1).for_each(|part| part.priors.clear());
        Self { parts, unknowns, start }
    }

    /// Values at the starts.
    pub(super) fn values(&self, parameters: &[f64]) -> Vec<f64> {
        let start = |part: &Shooting| [vec![0.0; part.first.v.len()], part.first.v.clone()].concat();
        let mut values: Vec<f64> = self.parts.iter().flat_map(start).collect();
        values.extend(parameters);
        values
    }

    /// Values of one segment.
    pub(super) fn own(&self, segment: usize, values: &[f64]) -> Vec<f64> {
        let first = segment * self.start;
        [&values[first..first + self.start], self.parameters(values)].concat()
    }

    pub(super) fn parameters<'b>(&self, values: &'b [f64]) -> &'b [f64] {
        &values[self.parts.len() * self.start..]
    }

    pub(super) fn starts(&self, values: &[f64]) -> Vec<State> {
        self.parts.iter().enumerate().map(|(i, part)| part.start(&self.own(i, values))).collect()
    }

    fn set_step(&mut self, step: f64) {
        self.parts.iter_mut().for_each(|part| part.step = step);
    }

    /// Takes the longest step, the interval between samples halved at most `finest` times, that resolves the
    /// motion, or the longest one for a motion far from the track; returns how often it was halved.
    fn resolve(&mut self, values: &[f64], finest: u32) -> u32 {
        let interval = self.parts.first().map_or(1.0, |part| interval(&part.track.times));
        self.set_step(interval);
        let mut coarse = self.residuals(values);
        for halvings in 0..finest {
            self.set_step(interval * 0.5_f64.powi(halvings as i32 + 1));
            let fine = self.residuals(values);
            let is_resolved = coarse.as_ref().zip(fine.as_ref()).is_some_and(|(a, b)| is_resolved(a, b));
            let is_hopeless = halvings >= COARSE && fine.as_ref().is_none_or(|fine| size(fine) > FAR);
            if is_resolved || is_hopeless {
                self.set_step(interval * 0.5_f64.powi(halvings as i32));
                return halvings;
            }
            coarse = fine;
        }
        finest
    }

    /// A minimum whose motion is resolved by its steps, or by the finest that are allowed.
    pub(super) fn minimise(&mut self, values: &[f64], settings: &Settings, finest: u32) -> Option<Minimum> {
        let mut halvings = self.resolve(values, finest);
        let mut minimum = minimise(self, values, settings)?;
        for _ in 0..REFINEMENTS {
            let needed = self.resolve(&minimum.values, finest);
            if needed <= halvings {
                break;
            }
            halvings = needed;
            minimum = minimise(self, &minimum.values, settings)?;
        }
        Some(minimum)
    }
}

/// Whether residuals with a step and with half of it differ so little that the longer one will do.
fn is_resolved(coarse: &DVector<f64>, fine: &DVector<f64>) -> bool {
    ERROR_OF_DIFFERENCE * (coarse - fine).amax() <= STEP_ERROR * size(fine).max(1.0)
}

/// Root mean square of residuals.
fn size(residuals: &DVector<f64>) -> f64 {
    (residuals.norm_squared() / residuals.len().max(1) as f64).sqrt()
}

impl Problem for Segments<'_> {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let mut all = Vec::new();
        for (segment, part) in self.parts.iter().enumerate() {
            all.extend(part.residuals(&self.own(segment, values))?.iter());
        }
        Some(DVector::from_vec(all))
    }

    fn linearised(&self, values: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let found: Vec<(DVector<f64>, DMatrix<f64>)> = (self.parts.iter().enumerate())
            .map(|(segment, part)| part.linearised(&self.own(segment, values)))
            .collect::<Option<_>>()?;
        let rows = found.iter().map(|(residuals, _)| residuals.len()).sum();
        let mut residuals = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, self.unknowns.len());
        let mut row = 0;
        for (segment, (own, by)) in found.iter().enumerate() {
            let (count, start) = (own.len(), self.start);
            residuals.rows_mut(row, count).copy_from(own);
            jacobian.view_mut((row, segment * start), (count, start)).copy_from(&by.columns(0, start));
            let (parameters, first) = (by.ncols() - start, self.parts.len() * start);
            jacobian.view_mut((row, first), (count, parameters)).copy_from(&by.columns(start, parameters));
            row += count;
        }
        Some((residuals, jacobian))
    }
}

/// Parameters and loss of a fit in segments that begin on the smooth path, which is of use below a loss;
/// `None` if no motion could be followed.
pub(super) fn in_segments(
    candidate: &Candidate,
    track: &Track,
    scales: &Scales,
    (parameters, count, most): (&[f64], usize, f64),
    starts: Option<&[State]>,
) -> Option<(f64, Vec<f64>, Vec<State>)> {
    let samples = track.times.len();
    let bounds: Vec<usize> = (0..=count).map(|k| k * samples / count).collect();
    let tracks: Vec<Track> = bounds.windows(2).map(|pair| track.part(pair[0]..pair[1])).collect();
    let smooth: Vec<State> = tracks.iter().map(|part| part.smooth[0].0.clone()).collect();
    let mut segments = Segments::new(candidate, &tracks, scales, starts.unwrap_or(&smooth));
    let values = segments.values(parameters);
    let settings = Settings { iterations: 15, useful: most, ..Settings::default() };
    let minimum = segments.minimise(&values, &settings, COARSE)?;
    let parameters = segments.parameters(&minimum.values).to_vec();
    Some((minimum.loss, parameters, segments.starts(&minimum.values)))
}

/// Parameters and start of the whole track from ever longer segments; `None` if segments leave more than a
/// loss, which a law that describes the track does not.
#[must_use]
pub fn approach(
    candidate: &Candidate,
    track: &Track,
    scales: &Scales,
    (parameters, most): (&[f64], f64),
) -> Option<(State, Vec<f64>)> {
    let mut parameters = parameters.to_vec();
    let mut starts: Option<Vec<State>> = None;
    for count in SEGMENTS {
        let found = in_segments(candidate, track, scales, (&parameters, count, most), starts.as_deref())?;
        if found.0 > most {
            return None;
        }
        parameters = found.1;
        starts = Some(found.2.into_iter().step_by(2).collect());
    }
    Some((starts?.swap_remove(0), parameters))
}
