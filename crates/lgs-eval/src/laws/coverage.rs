//! How often the truth lies inside of a band.

use lgs_model::{LagrangianScene, Motion, SceneState};

use crate::metrics::ObjectSummary;
use crate::object_law::{BandCoverage, PositionBand};
use crate::physics::trajectory::TIMES;
use crate::physics::{Truth, distance, long_steps};
use crate::thresholds::{STATE_STRIDE, TIME_TOLERANCE};

impl BandCoverage {
    /// At all [`TIMES`], for objects with their records.
    #[must_use]
    pub fn of(
        (scene, objects): (&LagrangianScene, &[ObjectSummary]),
        motion: &mut Motion<'_>,
        truth: &Truth<'_>,
    ) -> Self {
        let bands: Vec<(usize, &PositionBand)> = objects
            .iter()
            .enumerate()
            .filter_map(|(i, o)| Some((i, o.law.as_ref()?.band.as_ref()?)))
            .collect();
        let matched: Vec<Matched> =
            bands.iter().map(|(object, _)| Matched::of(scene, *object, truth)).collect();
        let (low, high) = scene.motion.time_range();
        let mut at = |time: f32| {
            let is_allowed = time >= low - TIME_TOLERANCE && time <= high + TIME_TOLERANCE;
            let state = (is_allowed && !bands.is_empty()).then(|| motion.state_at(time))?;
            let counts = bands.iter().zip(&matched).filter_map(|((_, band), matched)| {
                counted(band, &[matched.errors(scene, &state, time, truth)?])
            });
            let (inside, count) = counts.fold((0, 0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
            (count > 0).then(|| inside as f64 / count as f64)
        };
        Self { coverage_90: TIMES.iter().map(|&time| (format!("{time:?}"), at(time))).collect() }
    }
}

/// An object's Gaussians with the points of the truth that they are matched to.
struct Matched {
    rows: std::ops::Range<usize>,
    points: Vec<usize>,
}

impl Matched {
    fn of(scene: &LagrangianScene, object: usize, truth: &Truth<'_>) -> Self {
        let rows = scene.objects[object].members.clone();
        let points = truth.matches_of_object(&scene.dynamic_gaussians.means[rows.clone()]);
        Self { rows, points }
    }

    /// Errors at a time, where the truth knows it.
    fn errors(
        &self,
        scene: &LagrangianScene,
        state: &SceneState,
        time: f32,
        truth: &Truth<'_>,
    ) -> Option<PositionErrors> {
        let at = truth.at(time)?;
        let starts = &scene.dynamic_gaussians.means[self.rows.clone()];
        let expected =
            starts.iter().zip(&self.points).map(|(&start, &point)| truth.carried(&at, point, start));
        let predicted = state.q[self.rows.clone()].iter();
        let errors = predicted.zip(expected).map(|(&q, expected)| distance(q, expected)).collect();
        Some(PositionErrors { time: f64::from(time), errors })
    }
}

/// Distances of an object's Gaussians from where the truth has them, at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PositionErrors {
    /// Time of the positions.
    pub time: f64,
    /// Distance of every Gaussian, world units.
    pub errors: Vec<f64>,
}

/// Errors of an object's Gaussians at states in (0, 3 τ_max] that the truth knows. Gaussians are matched to
/// the truth at t = 0 and carried with it, as for the trajectory error (method §7).
#[must_use]
pub fn position_errors(
    scene: &LagrangianScene,
    object: usize,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
) -> Vec<PositionErrors> {
    let matched = Matched::of(scene, object, truth);
    let states = motion.states(long_steps(&scene.motion)).iter().enumerate().skip(STATE_STRIDE);
    let measured = |(step, state): (usize, &SceneState)| {
        matched.errors(scene, state, step as f32 * scene.motion.dt, truth)
    };
    states.step_by(STATE_STRIDE).filter_map(measured).collect()
}

/// Fraction of the errors that a band contains; nothing where the band and the errors share no time. A
/// position that is not finite is outside of any band.
#[must_use]
pub fn covered(band: &PositionBand, errors: &[PositionErrors]) -> Option<f64> {
    counted(band, errors).map(|(inside, count)| inside as f64 / count as f64)
}

/// How many of the errors a band contains, and how many there are at times that it has; nothing if none.
fn counted(band: &PositionBand, errors: &[PositionErrors]) -> Option<(usize, usize)> {
    let (mut inside, mut count) = (0_usize, 0_usize);
    for at in errors {
        let Some(radius) = band.radius_at(at.time) else { continue };
        inside += at.errors.iter().filter(|error| error.is_finite() && **error <= radius).count();
        count += at.errors.len();
    }
    (count > 0).then_some((inside, count))
}

/// Fraction of the true positions of an object inside of the band around its predicted ones, over Gaussians
/// and times in (0, 3 τ_max]; nothing without Gaussians or a common time.
#[must_use]
pub fn band_coverage(
    (scene, object): (&LagrangianScene, usize),
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
    band: &PositionBand,
) -> Option<f64> {
    covered(band, &position_errors(scene, object, motion, truth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_inside_of_the_band_are_counted_at_the_times_that_it_has() {
        let band = PositionBand { times: vec![0.0, 2.0, 3.0], radius: vec![Some(0.0), Some(0.2), None] };
        let at = |time: f64, errors: &[f64]| PositionErrors { time, errors: errors.to_vec() };
        let errors = [at(1.0, &[0.05, 0.11]), at(2.0, &[0.2, f64::NAN]), at(2.5, &[7.0]), at(4.0, &[0.0])];
        assert_eq!(covered(&band, &errors), Some(3.0 / 5.0));
        assert_eq!(covered(&band, &errors[3..]), None);
        assert_eq!(covered(&PositionBand::default(), &errors), None);
    }
}
