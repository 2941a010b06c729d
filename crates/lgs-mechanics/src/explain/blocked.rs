//! Blocked forecasts: a third of the window from the other two.

use super::explanation::Explanation;
use super::forecast::Forecast;
use crate::edit::Edit;
use crate::fit::{Fitted, Settings, Track, shoot};
use crate::system::System;
use std::ops::Range;

/// Forecasts of the last third and of the first third by the chosen candidate.
pub(super) fn forecasts(explanation: &Explanation) -> [Option<Forecast>; 2] {
    let count = explanation.track.times.len();
    let third = count / 3;
    [one(explanation, 0..count - third, count - third..count), one(explanation, third..count, 0..third)]
}

fn one(explanation: &Explanation, seen: Range<usize>, hidden: Range<usize>) -> Option<Forecast> {
    let chosen = explanation.choice.law();
    let candidate = &explanation.candidates[chosen.index];
    let begin = explanation.track.times[seen.start];
    let track = explanation.track.part(seen);
    let scales = explanation.track.scales(&candidate.coordinates);
    let start = explanation.start_at(begin).ok()?;
    let parameters = &chosen.fitted.law.parameters;
    let fitted = shoot(candidate, &track, (&scales, &start), parameters, &Settings::default())?;
    compare(explanation, &fitted, (begin, hidden))
}

/// Error and promised error at samples that a fit has not seen; its start lies at a time.
fn compare(
    explanation: &Explanation,
    fitted: &Fitted,
    (begin, hidden): (f64, Range<usize>),
) -> Option<Forecast> {
    let Track { times, x, noise, .. } = &explanation.track;
    let since: Vec<f64> = times[hidden.clone()].iter().map(|time| time - begin).collect();
    let found = System::new(&fitted.law, Edit::NONE).sensitivities(&fitted.start, &since).ok()?;
    let (mut error, mut expected) = (0.0, 0.0);
    for (sensitivity, observed) in found.iter().zip(&x[hidden]) {
        let change = fitted.law.coordinates.difference(observed, &sensitivity.state.x);
        let spread = &sensitivity.position * &fitted.covariance * sensitivity.position.transpose();
        for (i, lever) in explanation.levers.iter().enumerate() {
            error += (lever * change[i]).powi(2);
            expected += lever * lever * (spread[(i, i)].max(0.0) + noise[i].deviation.powi(2));
        }
    }
    let count = found.len().max(1) as f64;
    Some(Forecast { error: (error / count).sqrt(), expected: (expected / count).sqrt() })
}
