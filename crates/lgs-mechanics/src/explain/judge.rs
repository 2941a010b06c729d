//! The verdict on an explanation.

use super::blocked;
use super::explanation::Explanation;
use super::forecast::Forecast;
use super::options::Options;
use crate::bands::{Verdict, trusted};
use crate::coordinates::State;
use crate::thresholds::COMPARED_TIMES;

/// Fills in path, forecasts, trust and verdict.
pub(super) fn judge(found: &mut Explanation, options: &Options) {
    let smooth = &found.track.smooth;
    found.path = smooth.windows(2).map(|pair| found.distance(&pair[0].0, &pair[1].0)).sum();
    let [first, last] = found.window();
    let compared = COMPARED_TIMES as f64;
    let beyond = (options.horizon * compared).round();
    let count = (compared + 2.0 * beyond) as usize;
    let time = |k: usize| first + (last - first) * (k as f64 - beyond) / compared;
    let times: Vec<f64> = (0..=count).map(time).collect();
    let relative = relative_radius(found, &times, options);
    found.trusted = trusted(&times, &relative, [first, last], options.tolerance);
    found.forecasts = blocked::forecasts(found);
    let failed = |forecast: &Option<Forecast>| {
        forecast.as_ref().is_some_and(|f| f.fails() && f.error > options.tolerance * found.path)
    };
    let known = found.trusted[1] >= last + 0.5 * (last - first) - f64::EPSILON * last.abs();
    found.verdict = match found.choice.describes() {
        false => Verdict::Outside,
        true if known && !found.forecasts.iter().any(failed) => Verdict::Explained,
        true => Verdict::Described,
    };
}

/// Radius of the band over the path that was moved until then from the nearer end of the window, at least
/// the window's own.
fn relative_radius(found: &Explanation, times: &[f64], options: &Options) -> Vec<f64> {
    let Some(band) = found.band(times) else { return vec![f64::INFINITY; times.len()] };
    let [first, last] = found.window();
    let moved = |k: usize| found.distance(&band.middle[k - 1], &band.middle[k]);
    let mut path = vec![found.path; times.len()];
    for k in (1..times.len()).filter(|&k| times[k] > last) {
        path[k] = path[k - 1] + moved(k);
    }
    for k in (1..times.len()).rev().filter(|&k| times[k - 1] < first) {
        path[k - 1] = path[k] + moved(k);
    }
    let radius = band.radius(0.9, &|a: &State, b: &State| found.distance(a, b));
    let relative = |(radius, path): (f64, f64)| match radius <= options.negligible {
        true => 0.0,
        false => radius / path.max(f64::MIN_POSITIVE),
    };
    radius.into_iter().zip(path).map(relative).collect()
}
