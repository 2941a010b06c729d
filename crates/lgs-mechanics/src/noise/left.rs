//! Noise by what a fitted law leaves of a track.
//!
//! A smooth path has to be as free as any motion is, and takes up noise for motion or leaves motion for
//! noise, by as much as the two look alike. A law has few unknowns. What it leaves is noise alone where it
//! explains the track, but for what its fit has taken up: only what no change of the unknowns does counts.

use super::Noise;
use super::sampling::Sampling;
use super::smooth::{freed, mean_correlation};
use crate::thresholds::{CORRELATION_STEP, CORRELATIONS, FEWEST_LEFT, NOT_TAKEN_UP};
use nalgebra::DMatrix;

/// Noise of one coordinate, as a fit has left it.
#[derive(Clone, Copy, Debug)]
pub struct LeftNoise {
    /// The noise, by the restricted likelihood.
    pub noise: Noise,
    /// −2 ln of the likelihood of the residuals, at its largest.
    pub likelihood: f64,
}

impl LeftNoise {
    /// The noise of `residuals` of a coordinate, one for each sample, that a fit has left whose unknowns move
    /// the coordinate by the columns of `changes`, `[samples][unknowns]`, each within about a deviation of
    /// the unknown. `None` if the unknowns take up nearly all.
    #[must_use]
    pub fn of(residuals: &[f64], changes: &DMatrix<f64>, sampling: &Sampling) -> Option<Self> {
        let count = residuals.len();
        let mut values = DMatrix::from_column_slice(count, 1, residuals);
        let mut changes = changes.clone();
        for (k, deviation) in sampling.deviations().iter().enumerate() {
            values.row_mut(k).unscale_mut(*deviation);
            changes.row_mut(k).unscale_mut(*deviation);
        }
        let taken_up = taken_up(changes, NOT_TAKEN_UP * values.norm())?;
        let left = count.checked_sub(taken_up.ncols()).filter(|&left| left >= FEWEST_LEFT)? as f64;
        let at = |k: usize| {
            let correlation = CORRELATION_STEP * k as f64;
            let scales = sampling.innovations(correlation);
            let log_correlation: f64 = scales.iter().map(|[scale, _]| -2.0 * scale.ln()).sum();
            let (own, basis) = (freed(&values, &scales), freed(&taken_up, &scales).qr());
            let square = own.norm_squared().max(f64::MIN_POSITIVE);
            let rest = (square - basis.q().tr_mul(&own).norm_squared()).max(f64::EPSILON * square);
            let log_taken: f64 = basis.r().diagonal().iter().map(|r| 2.0 * r.abs().ln()).sum();
            let restricted = left * (rest / left).ln() + log_correlation + log_taken;
            let all = count as f64;
            (restricted, all * (square / all).ln() + log_correlation, rest / left)
        };
        let all: Vec<(f64, f64, f64)> = (0..CORRELATIONS).map(at).collect();
        let chosen = mean_correlation(&all.iter().map(|one| one.0).collect::<Vec<_>>());
        let likelihood = all.iter().map(|one| one.1).fold(f64::INFINITY, f64::min);
        let noise = Noise { deviation: all[chosen].2.sqrt(), correlation: CORRELATION_STEP * chosen as f64 };
        Some(Self { noise, likelihood })
    }
}

/// An orthonormal basis of the changes that are larger than `least`. `None` if they are not finite.
fn taken_up(changes: DMatrix<f64>, least: f64) -> Option<DMatrix<f64>> {
    if changes.is_empty() || changes.iter().any(|value| !value.is_finite()) {
        return changes.is_empty().then_some(DMatrix::zeros(changes.nrows(), 0));
    }
    let svd = changes.svd(true, false);
    let u = svd.u?;
    let kept: Vec<usize> = (0..u.ncols()).filter(|&i| svd.singular_values[i] > least).collect();
    Some(u.select_columns(&kept))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::normal;
    use lgs_core::stream;

    /// Noise of correlation ρ that a polynomial of some coefficients was fitted to, and what these change.
    fn left_of(correlation: f64, coefficients: usize, seed: u64) -> LeftNoise {
        let mut stream = stream(seed, "noise left by a law", 0);
        let count = 46;
        let mut error = normal(&mut stream);
        let fresh = (1.0 - correlation * correlation).sqrt();
        let values = DMatrix::from_fn(count, 1, |_, _| {
            error = correlation * error + fresh * normal(&mut stream);
            0.003 * error
        });
        let power = |k: usize, power: usize| (2.0 * k as f64 / 45.0 - 1.0).powi(power as i32);
        let changes = DMatrix::from_fn(count, coefficients, power);
        let q = changes.clone().qr().q();
        let residuals = &values - &q * q.tr_mul(&values);
        let times: Vec<f64> = (0..count).map(|k| k as f64).collect();
        LeftNoise::of(residuals.as_slice(), &changes, &Sampling::of(&times)).expect("noise")
    }

    #[test]
    fn noise_is_found_though_the_fit_has_taken_up_some() {
        for correlation in [0.0, 0.7] {
            let found: Vec<Noise> = (0..40).map(|seed| left_of(correlation, 6, seed).noise).collect();
            let mean = |f: &dyn Fn(&Noise) -> f64| found.iter().map(f).sum::<f64>() / 40.0;
            let level = mean(&|n| n.deviation.powi(2)).sqrt();
            assert!((level / 0.003 - 1.0).abs() < 0.2, "{level} at {correlation}");
            // None below 0 is tried: where there is none, known to 1/√40, the mean of what is found is 0.13.
            let own = mean(&|n| n.correlation);
            assert!((own - correlation).abs() < 0.2, "{own} for {correlation}");
        }
    }

    #[test]
    fn nothing_is_known_of_noise_that_the_fit_has_taken_up() {
        let times: Vec<f64> = (0..8).map(f64::from).collect();
        let all = DMatrix::identity(8, 8);
        assert!(LeftNoise::of(&[1.0; 8], &all, &Sampling::of(&times)).is_none());
    }
}
