//! Things that fly freely for parts of the window and are handled else: no law is theirs for all of it, and
//! those of its beginning and its end are sought where these are flights.

use std::ops::Range;

use crate::config::DistillConfig;
use crate::distilled::Distilled;
use crate::error::DistillError;
use crate::laws::generalised::{GeneralisedLaw, PartSearch};
use crate::motion::denoise::denoise;
use crate::motion::shared_motion::SharedMotion;
use crate::object::{check, laws};
use crate::particles::distill_particles;
use crate::progress::DistillProgress;
use crate::report::{PartLaw, PartLaws};
use crate::thresholds::{FEWEST_SAMPLES, KNOWN_FRACTION, PART_SHARES};
use crate::trajectories::Trajectories;

/// Whether a thing is handled: none of its free flights takes up most of the window.
#[must_use]
pub fn is_handled(flights: &[[f32; 2]], [first, last]: [f32; 2]) -> bool {
    let longest = flights.iter().map(|flight| flight[1] - flight[0]).fold(0.0, f32::max);
    f64::from(longest) < PART_SHARES[PART_SHARES.len() - 1] * f64::from(last - first)
}

/// Finds the dynamics behind the trajectories of a thing that is handled, given first and last time of each
/// of its free flights: particles by themselves, and laws of the flights at either end of the window that
/// explain these.
///
/// # Errors
/// If trajectories or configuration are malformed, or a fit left the finite numbers.
pub fn distill_handled(
    trajectories: &Trajectories,
    flights: &[[f32; 2]],
    (config, seed): (&DistillConfig, u64),
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<Distilled, DistillError> {
    check(trajectories, config)?;
    // Networks would learn what hands do.
    let alone = DistillConfig { neural_remainder: false, ..config.clone() };
    let mut particles = distill_particles(denoise(trajectories, &alone), &alone, seed, progress)?;
    particles.report.parts = flight_laws(trajectories, flights, config, seed);
    Ok(Distilled::Particles(Box::new(particles)))
}

/// Laws of the flights with which the window begins and ends.
fn flight_laws(
    trajectories: &Trajectories,
    flights: &[[f32; 2]],
    config: &DistillConfig,
    seed: u64,
) -> PartLaws {
    let Some(laws) = laws(config) else { return PartLaws::default() };
    let (times, slack) = (&trajectories.times, 0.5 * trajectories.dt());
    let resolution = KNOWN_FRACTION * f64::from(config.forecast_tolerance);
    let search = PartSearch { laws, resolution, slow_error: 0.0, impacts: &[], seed };
    let samples = |&[first, last]: &[f32; 2]| -> Range<usize> {
        times.partition_point(|t| *t < first - slack)..times.partition_point(|t| *t <= last + slack)
    };
    let ranges = || flights.iter().map(samples).filter(|samples| samples.len() >= FEWEST_SAMPLES);
    let law_of = |samples: Range<usize>, law: &dyn Fn(&SharedMotion) -> Option<GeneralisedLaw>| {
        // Those of the samples themselves: a recording knows no others.
        let times = [samples.start, samples.end - 1].map(|sample| f64::from(times[sample]));
        let motion = denoise(&trajectories.part(samples), config).shared?.shared;
        let GeneralisedLaw { law, start, known, .. } = law(&motion)?;
        tracing::debug!(?times, ?law, ?known, "a law of a flight");
        Some(PartLaw { times, law, start, known })
    };
    let (first, last) = (ranges().find(|own| own.start == 0), ranges().find(|own| own.end == times.len()));
    PartLaws {
        first: first.and_then(|own| law_of(own, &|motion| search.first_part(motion))),
        last: last.and_then(|own| law_of(own, &|motion| search.last_part(motion))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube that lies still until t = 0.5 and is thrown then, to fall until the end.
    fn thrown() -> Trajectories {
        let times: Vec<f32> = (0..=80).map(|i| 0.01 * i as f32).collect();
        let place = |i: i32, t: f32| {
            let s = (t - 0.5).max(0.0);
            let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2].map(|c| 0.2 * c as f32);
            let noise = 2e-4 * (4001.0 * t + i as f32).sin();
            [x + 2.0 * s + noise, y + noise, z + 3.0 * s - 6.0 * s * s]
        };
        let positions = times.iter().map(|&t| (0..8).map(|i| place(i, t)).collect()).collect();
        Trajectories::unweighted(times, positions)
    }

    #[test]
    fn a_thing_that_is_let_go_late_has_the_law_of_its_flight() {
        let (trajectories, config) = (thrown(), DistillConfig::default());
        let distilled =
            distill_handled(&trajectories, &[[0.5, 0.8]], (&config, 1), &mut |_| {}).expect("a thing");
        let parts = &distilled.report().parts;
        let last = parts.last.as_ref().expect("the law of the flight");
        assert!(parts.first.is_none() && (last.times[0] - 0.5).abs() < 1e-6, "{parts:?}");
        assert_eq!(last.law.terms.len(), 1, "{:?}", last.law);
        let resting = distill_handled(&trajectories, &[], (&config, 1), &mut |_| {}).expect("a thing");
        assert!(resting.report().parts.is_empty());
    }

    #[test]
    fn what_flies_for_most_of_the_window_is_not_handled() {
        assert!(is_handled(&[], [0.0, 1.0]) && is_handled(&[[0.0, 0.3], [0.6, 1.0]], [0.0, 1.0]));
        assert!(!is_handled(&[[0.1, 0.9]], [0.0, 1.0]));
    }
}
