//! Laws of a free rigid body, put together from those of its centre and of its rotation, which do not act on
//! each other.

use super::choice::judged;
use crate::thresholds::NO_RIVAL;
use lgs_mechanics::Law;
use lgs_mechanics::choose::{Choice, Judged};
use lgs_mechanics::coordinates::{Coordinates, Inertia, Port, State};
use lgs_mechanics::fit::Fitted;
use lgs_mechanics::terms::Term;
use nalgebra::DMatrix;

/// All laws of the centre with all laws of the rotation.
pub(super) fn combined(of_center: &Choice, of_spin: &Choice, inertia: &Inertia) -> Option<Choice> {
    let near = |choice: &Choice| -> Vec<Judged> {
        let best = choice.judged.first().map_or(0.0, Judged::score);
        choice.judged.iter().filter(|judged| judged.score() <= best + NO_RIVAL).cloned().collect()
    };
    let (centers, spins) = (near(of_center), near(of_spin));
    let pairs = centers.iter().flat_map(|center| spins.iter().map(move |spin| (center, spin)));
    let fitted = |(index, (center, spin)): (usize, (&Judged, &Judged))| {
        let fitted = together(&center.fitted, &spin.fitted, inertia)?;
        Some(judged(index, [center, spin], fitted))
    };
    let mut all: Vec<Judged> = pairs.enumerate().filter_map(fitted).collect();
    all.sort_by(|a, b| a.score().total_cmp(&b.score()));
    let samples = of_center.samples + of_spin.samples;
    (!all.is_empty()).then_some(Choice { judged: all, chosen: 0, samples })
}

/// One law of both motions.
fn together(center: &Fitted, spin: &Fitted, inertia: &Inertia) -> Option<Fitted> {
    let own = inertia.parameters().len();
    let on_center = center.law.terms.iter().map(|term| Term { kind: term.kind, port: Port::Center });
    let terms: Vec<Term> = on_center.chain(spin.law.terms.iter().copied()).collect();
    let join = |spin: &[f64], center: &[f64]| -> Vec<f64> {
        let (inertia, of_terms) = spin.split_at(own.min(spin.len()));
        [inertia, center, of_terms].concat()
    };
    let mut law = Law::new(
        Coordinates::Rigid(*inertia),
        terms,
        join(&spin.law.parameters, &center.law.parameters),
        spin.law.step.min(center.law.step),
    )
    .ok()?;
    law.deviations = join(&spin.law.deviations, &center.law.deviations);
    let both = |spin: &[f64], center: &[f64]| [spin, center].concat();
    let start = State { x: both(&spin.start.x, &center.start.x), v: both(&spin.start.v, &center.start.v) };
    let bounds = [&spin.bounds[..own], &center.bounds, &spin.bounds[own..]].concat();
    let covariance = joined_covariance(&center.covariance, &spin.covariance, own);
    Some(Fitted { law, start, loss: center.loss + spin.loss, covariance, bounds })
}

/// The covariance of the unknowns of both: rotation, centre, their velocities, inertia, terms of the centre,
/// terms of the rotation.
fn joined_covariance(center: &DMatrix<f64>, spin: &DMatrix<f64>, own: usize) -> DMatrix<f64> {
    let of_spin = |range: std::ops::Range<usize>| range.map(|i| (true, i));
    let of_center = |range: std::ops::Range<usize>| range.map(|i| (false, i));
    let order: Vec<(bool, usize)> = of_spin(0..3)
        .chain(of_center(0..3))
        .chain(of_spin(3..6))
        .chain(of_center(3..6))
        .chain(of_spin(6..6 + own))
        .chain(of_center(6..center.nrows()))
        .chain(of_spin(6 + own..spin.nrows()))
        .collect();
    DMatrix::from_fn(order.len(), order.len(), |row, column| match (order[row], order[column]) {
        ((true, i), (true, j)) => spin[(i, j)],
        ((false, i), (false, j)) => center[(i, j)],
        _ => 0.0,
    })
}
