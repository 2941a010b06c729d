//! Blocked forecasts: a third of the window by the chosen law, fitted to the other two thirds alone, beside
//! those of free motion in the same coordinates.

use super::known::{distance, points_of};
use super::posterior::Posterior;
use super::rated::Rated;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{FORECAST_DRAWS, UNDESCRIBED_FRACTION};
use glam::DVec3;
use lgs_core::geometry::trace;
use lgs_mechanics::fit::{Settings, Track, shoot};
use lgs_mechanics::noise::SampleTimes;
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Candidate, Edit, FAILS, FORECAST_ERROR, System, TRUSTED_FRACTION};
use std::ops::Range;

/// Errors of the forecasts of the last third and of the first third of the window, over the displacement
/// there from the nearest sample that was seen; root mean squares over particles and samples. `None` for what
/// cannot be fitted without those samples, or not be followed, and for normal modes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ForecastErrors {
    /// By the likeliest law.
    pub(crate) law: Option<f64>,
    /// By free motion.
    pub(super) free: Option<f64>,
    /// Whether the law's are not to be trusted, and wrong by more than three deviations of what its own fits
    /// to the parts that were seen promise.
    pub(super) fails: bool,
}

/// Sums over hidden samples of mean squared distances over the particles, each by how well its pose is known.
#[derive(Clone, Copy, Default)]
struct Squares {
    /// From the observed poses to the forecast ones.
    error: f64,
    /// From the observed poses to the nearest that was seen.
    displacement: f64,
    /// From the forecast poses to those of draws from the posterior of the fit.
    expected: f64,
}

impl Squares {
    fn and(self, other: Self) -> Self {
        Self {
            error: self.error + other.error,
            displacement: self.displacement + other.displacement,
            expected: self.expected + other.expected,
        }
    }

    /// Error over displacement.
    fn relative(&self) -> Option<f64> {
        Some((self.error / self.displacement).sqrt()).filter(|error| error.is_finite())
    }

    fn fails(&self) -> bool {
        self.error > FAILS * FAILS * self.expected
    }
}

impl ForecastErrors {
    pub(super) fn of(rated: &Rated, bodies: &[&SharedMotion]) -> Self {
        let law = &rated.best().judged.fitted.law;
        let Some(blocked) = Blocked::new(rated, bodies) else { return Self::default() };
        let squares = |terms: Vec<Term>, values: &[f64]| {
            let candidate = Candidate::new(law.coordinates.clone(), terms).ok()?;
            blocked.of_both_ends(&candidate, values)
        };
        let (of_coordinates, _) = law.parameters.split_at(law.coordinates.start().len());
        let own = squares(law.terms.clone(), &law.parameters);
        let free = squares(Vec::new(), of_coordinates);
        let [law, free] = [own, free].map(|squares| squares?.relative());
        let fails = law.is_some_and(|law| law > TRUSTED_FRACTION) && own.is_some_and(|own| own.fails());
        Self { law, free, fails }
    }

    /// Whether a law whose forecasts are not to be trusted is none of the motion: free motion forecasts
    /// better, or they fail by so much of the displacement that they say nothing of it.
    pub(super) fn refute(&self) -> bool {
        let free_is_better = |law| self.free.is_some_and(|free| free < law);
        let says_nothing = |law| self.fails && law > UNDESCRIBED_FRACTION;
        self.law.is_some_and(|law| law > TRUSTED_FRACTION && (free_is_better(law) || says_nothing(law)))
    }
}

/// What forecasts are made of.
struct Blocked<'a> {
    rated: &'a Rated,
    track: Track,
    /// The bodies in the order of the coordinates.
    bodies: Vec<&'a SharedMotion>,
    points: Vec<Vec<DVec3>>,
}

impl<'a> Blocked<'a> {
    fn new(rated: &'a Rated, bodies: &[&'a SharedMotion]) -> Option<Self> {
        let system = rated.system();
        // Normal modes that were fitted with their law have no amplitudes of their own at the samples.
        if system.x.len() != bodies[0].times.len() {
            return None;
        }
        let first = bodies[0].times[0];
        let times: Vec<f64> = bodies[0].times.iter().map(|time| time - first).collect();
        let bodies: Vec<&SharedMotion> = system.order.iter().map(|&body| bodies[body]).collect();
        let mut x = system.x.clone();
        if let Some(center) = rated.best().posterior.placed.center_of_mass() {
            let places = bodies[0].poses.iter().map(|pose| pose.apply(center).to_array());
            x.iter_mut().zip(places).for_each(|(x, place)| x[4..].copy_from_slice(&place));
        }
        let coordinates = &rated.best().judged.fitted.law.coordinates;
        let deviation = |k| bodies.iter().map(|body| body.deviation(k)).fold(0.0, f64::max);
        let deviations: Vec<f64> = (0..times.len()).map(deviation).collect();
        let place = FORECAST_ERROR * SharedMotion::rms_displacement_of(&bodies);
        let turn = place / trace(&bodies[0].covariance()).sqrt().max(f64::MIN_POSITIVE);
        let samples = SampleTimes { times: &times, deviations: &deviations };
        let track = Track::new(coordinates, samples, &x).coarsened(coordinates, [turn, place]);
        Some(Self { rated, track, points: points_of(&bodies), bodies })
    }

    /// Both forecasts; `values` are those that the fits start from.
    fn of_both_ends(&self, candidate: &Candidate, values: &[f64]) -> Option<Squares> {
        let count = self.track.times.len();
        let third = count / 3;
        let last = self.squares((candidate, values), 0..count - third, count - third..count)?;
        let first = self.squares((candidate, values), third..count, 0..third)?;
        Some(last.and(first))
    }

    /// The forecast of hidden samples by a law fitted to others.
    fn squares(
        &self,
        (candidate, values): (&Candidate, &[f64]),
        seen: Range<usize>,
        hidden: Range<usize>,
    ) -> Option<Squares> {
        let part = self.track.part(seen.clone());
        let scales = self.track.scales(&candidate.coordinates);
        let begin = self.track.times[seen.start];
        let own = &self.rated.best().judged.fitted;
        // The fit to all samples is a better start than a path of some, and nothing more than a start.
        let states = System::new(&own.law, Edit::NONE).states(&own.start, &[begin]);
        let start = states.map_or_else(|_| part.smooth[0].0.clone(), |mut states| states.remove(0));
        let fitted = shoot(candidate, &part, (&scales, &start), values, &Settings::default())?;
        let times: Vec<f64> = self.track.times[hidden.clone()].iter().map(|time| time - begin).collect();
        let placed = self.rated.best().posterior.placed.with_fit(&fitted);
        let forecast = placed.poses(&times)?;
        let nearest = self.observed(if hidden.start > seen.start { seen.end - 1 } else { seen.start });
        let observed: Vec<Vec<Pose>> = hidden.clone().map(|sample| self.observed(sample)).collect();
        let deviations = &self.track.sampling.deviations()[hidden];
        let square = |(deviation, (a, b)): (&f64, (&Vec<Pose>, &Vec<Pose>))| {
            (distance(&self.points, a, b) / deviation).powi(2)
        };
        let sum = |others: &[Vec<Pose>]| -> f64 {
            deviations.iter().zip(forecast.iter().zip(others)).map(square).sum()
        };
        let posterior = Posterior::of(placed, &fitted).followed_to_first_order();
        let of_draw = |motion: Vec<Option<Vec<Pose>>>| {
            let poses: Option<Vec<Vec<Pose>>> = motion.into_iter().collect();
            poses.map_or(f64::INFINITY, |poses| sum(&poses))
        };
        let drawn = posterior.drawn(self.rated.inflation, FORECAST_DRAWS, &times, (0, 0));
        let expected = drawn.into_iter().map(of_draw).sum::<f64>() / FORECAST_DRAWS as f64;
        Some(Squares {
            error: sum(&observed),
            displacement: deviations.iter().zip(observed.iter().map(|a| (a, &nearest))).map(square).sum(),
            expected,
        })
    }

    fn observed(&self, sample: usize) -> Vec<Pose> {
        self.bodies.iter().map(|motion| motion.poses[sample]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Squares;

    #[test]
    fn a_forecast_fails_beyond_three_of_the_deviations_that_were_expected() {
        let squares = |error: f64| Squares { error: error * error, displacement: 4.0, expected: 0.01 };
        assert!(!squares(0.29).fails() && squares(0.31).fails());
        let both = squares(0.3).and(squares(0.4));
        assert!((both.relative().expect("a ratio") - 0.5 / 8.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(Squares::default().relative(), None, "nothing moved");
    }
}
