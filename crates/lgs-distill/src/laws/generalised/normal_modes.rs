//! Normal modes: amplitudes that move by themselves, each with a stiffness and a damping of its own.
//!
//! In orthogonal modes the mass of a body is taken to be spread as its particles are, and a law with one
//! damping for all modes takes them to be damped alike. Neither is known of a body that is seen from outside,
//! so that normal modes need not be orthogonal, and how far they are from it is fitted with the law.

use super::placed::Placed;
use super::posterior::{Compared, Posterior};
use lgs_mechanics::choose::Judged;
use lgs_mechanics::choose::simplicity;
use lgs_mechanics::coordinates::{AffineMode, Coordinates, Modal, Port, State};
use lgs_mechanics::fit::{Fitted, Track};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Candidate, Law};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Typical changes of first values, of which the fit finds the right ones.
const FIRST_SHARE: f64 = 1e-4;

/// The law of normal modes that a law of orthogonal modes, with a positive stiffness and one damping or none,
/// is a special case of, as a start of its fit; `None` for other laws.
fn first_values(old: &Fitted, track: &Track) -> Option<Fitted> {
    let names: Vec<&str> = old.law.terms.iter().map(|term| term.kind.name()).collect();
    let kinds: &[&str] = match names[..] {
        ["spring-positive"] => &["spring-diagonal"],
        ["spring-positive", "linear-drag"] => &["spring-diagonal", "damping-diagonal"],
        _ => return None,
    };
    let Coordinates::Modal(modal) = &old.law.coordinates else { return None };
    let n = old.start.v.len();
    let (root, rest) = old.law.parameters.split_at(n * (n + 1) / 2);
    let (center, rates) = rest.split_at(n);
    let root = DMatrix::from_fn(n, n, |i, j| if j <= i { root[i * (i + 1) / 2 + j] } else { 0.0 });
    let SymmetricEigen { eigenvectors, eigenvalues } = (&root * root.transpose()).symmetric_eigen();
    let turned = |v: &[f64]| (eigenvectors.transpose() * DVector::from_column_slice(v)).as_slice().to_vec();
    let coordinates = Coordinates::Modal(Modal { affine: mixed(&modal.affine, &eigenvectors), further: 0 });
    let terms: Option<Vec<Term>> = kinds.iter().map(|name| Term::named(name, Port::Whole).ok()).collect();
    let stiffness: Vec<f64> = eigenvalues.iter().map(|k| k.max(0.0)).collect();
    let parameters = [stiffness, turned(center), rates.repeat(n)].concat();
    let (old_priors, first) = (&old.priors, 2 * n + n * (n + 1) / 2);
    let prior_of = |i: usize| old_priors.iter().find(|(at, ..)| *at == first + i).copied();
    let means: Vec<f64> = (0..n).map(|i| prior_of(i).map_or(0.0, |(_, mean, _)| mean)).collect();
    let widths = (0..n).map(|i| prior_of(i).map_or(f64::INFINITY, |(.., width)| width));
    let priors = widths.zip(turned(&means)).enumerate().map(|(i, (w, mean))| (3 * n + i, mean, w)).collect();
    let is_place = |i: usize| (n..2 * n).contains(&i);
    let bound = |i: usize| [if is_place(i) { f64::NEG_INFINITY } else { 0.0 }, f64::INFINITY];
    let bounds = (0..parameters.len()).map(bound).collect();
    let law = Law::new(coordinates, terms?, parameters, old.law.step).ok()?;
    let start = State { x: turned(&old.start.x), v: turned(&old.start.v) };
    let covariance = typical(&law, &start, track);
    Some(Fitted { law, start, loss: old.loss, covariance, bounds, priors })
}

/// Squares of typical changes of the unknowns of a law.
fn typical(law: &Law, start: &State, track: &Track) -> DMatrix<f64> {
    let n = start.v.len();
    let noise = track.noise.iter().take(n).map(|noise| noise.deviation).fold(0.0, f64::max);
    let time = track.times[track.times.len() - 1] - track.times[0];
    let change =
        |(i, p): (usize, &f64)| if (n..2 * n).contains(&i) { noise } else { FIRST_SHARE * (1.0 + p) };
    let parameters = law.parameters.iter().enumerate().map(change);
    let all: Vec<f64> =
        [vec![noise; n], vec![noise / time; n]].concat().into_iter().chain(parameters).collect();
    DMatrix::from_diagonal(&DVector::from_vec(all.iter().map(|size| size * size).collect()))
}

/// Modes whose columns are combinations of others.
fn mixed(modes: &[AffineMode], by: &DMatrix<f64>) -> Vec<AffineMode> {
    let column = |j: usize| {
        let mut sum = AffineMode { linear: [[0.0; 3]; 3], shift: [0.0; 3] };
        modes.iter().enumerate().for_each(|(i, mode)| sum.add(mode, by[(i, j)]));
        sum
    };
    (0..modes.len()).map(column).collect()
}

/// The law of normal modes that belongs to one of orthogonal ones, with all that is known of it. `place` puts
/// a law of rotated modes where the body is.
pub(super) fn freed(
    judged: &Judged,
    track: &Track,
    compared: &Compared<'_>,
    place: &dyn Fn(&Fitted) -> Placed,
) -> Option<(Judged, Posterior)> {
    let first = first_values(&judged.fitted, track)?;
    let posterior = Posterior::joint(&place(&first), &first, compared)?;
    let fitted = posterior.fitted(&first);
    let candidate = Candidate::new(fitted.law.coordinates.clone(), fitted.law.terms.clone()).ok()?;
    let penalty = track.independent_samples().max(1.0).ln() * candidate.unknown_count() as f64;
    let (evidence, simplicity) = (fitted.loss + penalty, simplicity(&candidate));
    Some((Judged { index: judged.index, fitted, evidence, simplicity }, posterior))
}
