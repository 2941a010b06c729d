//! Smooth paths of all coordinates of an object and the noise around them, by marginal likelihood.
//!
//! A coordinate is a series of Legendre polynomials over the window. Position and velocity are free; the
//! coefficient of degree k ≥ 2 is normal with deviation `s rᵏ`, as those of smooth functions fall off. The
//! coefficients are integrated out: `s`, `r` and the noise's variance are found for each coordinate, ρ for
//! the object, where the likelihood of the track is largest. A path therefore never takes up noise for motion
//! because its degree was chosen too high.

use super::Noise;
use super::polynomial::Window;
use super::sampling::{SampleTimes, Sampling};
use crate::coordinates::{Coordinates, State};
use crate::thresholds::{
    CORRELATION_STEP, CORRELATIONS, DECAYS, FREE_COEFFICIENTS, MOST_POLYNOMIALS, NO_NOISE, STRENGTHS,
};
use lgs_core::geometry::quaternion;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// A polynomial in time for each coordinate, with the noise around it.
#[derive(Clone, Debug)]
pub struct SmoothPath {
    window: Window,
    coefficients: Vec<DVector<f64>>,
    pub(super) noise: Vec<Noise>,
}

/// Polynomials at the samples of a track, freed of the noise's correlation, as an orthogonal basis `Q` and a
/// triangle: `L⁻¹ B = Q T`.
struct Basis {
    correlation: f64,
    scales: Vec<[f64; 2]>,
    q: DMatrix<f64>,
    triangle: DMatrix<f64>,
    /// `ln` of the determinants of the correlations and of what the free coefficients see.
    log_determinant: f64,
    /// Eigenvectors and eigenvalues of `T R² Tᵀ` without the free coefficients, for each decay.
    decays: Vec<SymmetricEigen<f64, nalgebra::Dyn>>,
}

/// Best prior and variance of a coordinate at one ρ.
struct Fit {
    /// −2 ln of the marginal likelihood.
    likelihood: f64,
    variance: f64,
    decay: usize,
    strength: f64,
}

impl Basis {
    fn new(rows: &DMatrix<f64>, sampling: &Sampling, correlation: f64) -> Self {
        let scales = sampling.innovations(correlation);
        let freed = freed(rows, &scales);
        let qr = freed.qr();
        let triangle = qr.r();
        let count = triangle.ncols();
        let part = triangle
            .view(
                (FREE_COEFFICIENTS, FREE_COEFFICIENTS),
                (count - FREE_COEFFICIENTS, count - FREE_COEFFICIENTS),
            )
            .into_owned();
        let eigen = |decay: &f64| {
            let mut scaled = part.clone();
            for k in 0..scaled.ncols() {
                scaled.column_mut(k).scale_mut(decay.powi(k as i32));
            }
            (&scaled * scaled.transpose()).symmetric_eigen()
        };
        // The innovation of unit variance is the difference divided by √(1 − ρ²).
        let log_correlation: f64 = scales.iter().map(|[scale, _]| -2.0 * scale.ln()).sum();
        let log_free: f64 = (0..FREE_COEFFICIENTS).map(|k| 2.0 * triangle[(k, k)].abs().ln()).sum();
        Self {
            correlation,
            q: qr.q(),
            decays: DECAYS.iter().map(eigen).collect(),
            log_determinant: log_correlation + log_free,
            triangle,
            scales,
        }
    }

    /// Components of a coordinate along `Q`, and the square of what is not in its span.
    fn components(&self, values: &DVector<f64>) -> (DVector<f64>, f64) {
        let column = DMatrix::from_column_slice(values.len(), 1, values.as_slice());
        let freed = freed(&column, &self.scales).column(0).into_owned();
        let along = self.q.tr_mul(&freed);
        let rest = (&freed - &self.q * &along).norm_squared();
        (along, rest.max(values.len() as f64 * (NO_NOISE * values.amax()).powi(2)).max(f64::MIN_POSITIVE))
    }

    /// The prior under which a coordinate is most likely.
    fn fit(&self, values: &DVector<f64>) -> Fit {
        let (along, rest) = self.components(values);
        let left = (values.len() - FREE_COEFFICIENTS) as f64;
        let bent = along.rows(FREE_COEFFICIENTS, along.len() - FREE_COEFFICIENTS);
        let mut best = Fit { likelihood: f64::INFINITY, variance: 1.0, decay: 0, strength: 0.0 };
        for (decay, eigen) in self.decays.iter().enumerate() {
            let turned = eigen.eigenvectors.tr_mul(&bent);
            for power in 0..=STRENGTHS {
                let strength = 16.0_f64.powi(power);
                let spread = eigen.eigenvalues.map(|value| 1.0 + strength * value.max(0.0));
                let square = rest + turned.component_mul(&turned).component_div(&spread).sum();
                let logs = spread.iter().map(|s| s.ln()).sum::<f64>() + self.log_determinant;
                let likelihood = left * (square / left).ln() + logs;
                if likelihood < best.likelihood {
                    best = Fit { likelihood, variance: square / left, decay, strength };
                }
            }
        }
        best
    }

    /// Mean coefficients of the polynomials under a prior.
    fn coefficients(&self, values: &DVector<f64>, fit: &Fit) -> Option<DVector<f64>> {
        let (along, _) = self.components(values);
        let eigen = &self.decays[fit.decay];
        // The mean of `T c` is `S (1 + S)⁻¹` times the components, with `S` the prior's covariance of `T c`.
        let shrink = eigen.eigenvalues.map(|value| {
            let spread = fit.strength * value.max(0.0);
            spread / (1.0 + spread)
        });
        let bent = along.rows(FREE_COEFFICIENTS, along.len() - FREE_COEFFICIENTS);
        let mean = &eigen.eigenvectors * eigen.eigenvectors.tr_mul(&bent).component_mul(&shrink);
        let mut right = along;
        right.rows_mut(FREE_COEFFICIENTS, mean.len()).copy_from(&mean);
        self.triangle.solve_upper_triangular(&right)
    }
}

/// Rows freed of their correlation: innovations in units of the noise's own variance.
pub(super) fn freed(rows: &DMatrix<f64>, scales: &[[f64; 2]]) -> DMatrix<f64> {
    let mut found = rows.clone();
    for (k, [scale, correlation]) in scales.iter().enumerate().skip(1) {
        found.row_mut(k).copy_from(&((rows.row(k) - rows.row(k - 1) * *correlation) * *scale));
    }
    found
}

/// Fits of all coordinates at one ρ, and the sum of their likelihoods.
fn fits(basis: &Basis, tracks: &[DVector<f64>]) -> (f64, Vec<Fit>) {
    let fits: Vec<Fit> = tracks.iter().map(|track| basis.fit(track)).collect();
    (fits.iter().map(|fit| fit.likelihood).sum(), fits)
}

/// Number of the value of ρ that is nearest to its mean under the likelihood.
pub(super) fn mean_correlation(likelihoods: &[f64]) -> usize {
    let best = likelihoods.iter().copied().fold(f64::INFINITY, f64::min);
    let weights = likelihoods.iter().map(|likelihood| (0.5 * (best - likelihood)).exp());
    let (sum, total) = weights
        .enumerate()
        .fold((0.0, 0.0), |(sum, total), (k, weight)| (sum + k as f64 * weight, total + weight));
    (sum / total).round() as usize
}

impl SmoothPath {
    /// Fits tracks `[T][coordinates]` at at least five ascending times; ρ is shared by all coordinates of an
    /// object. Values and polynomials are divided by the samples' deviations, so that noise is alike in all.
    #[must_use]
    pub fn fit<'a>(samples: impl Into<SampleTimes<'a>>, tracks: &[Vec<f64>]) -> Self {
        let samples = samples.into();
        let (times, sampling) = (samples.times, Sampling::of(samples));
        let window = Window::of(times);
        let count = (2 * times.len() / 3).clamp(FREE_COEFFICIENTS + 1, MOST_POLYNOMIALS);
        let rows: Vec<Vec<f64>> =
            times.iter().map(|&time| window.polynomials(time, count)[0].clone()).collect();
        let alike = |rows: &[Vec<f64>], i: usize| {
            let values = rows.iter().zip(sampling.deviations()).map(|(row, deviation)| row[i] / deviation);
            DVector::from_iterator(rows.len(), values)
        };
        let coordinate = |i: usize| alike(tracks, i);
        let rows = DMatrix::from_columns(&(0..count).map(|k| alike(&rows, k)).collect::<Vec<_>>());
        let tracks: Vec<DVector<f64>> = (0..tracks.first().map_or(0, Vec::len)).map(coordinate).collect();
        let bases = |k: usize| Basis::new(&rows, &sampling, CORRELATION_STEP * k as f64);
        let bases: Vec<Basis> = (0..CORRELATIONS).map(bases).collect();
        let (likelihoods, mut found): (Vec<f64>, Vec<Vec<Fit>>) =
            bases.iter().map(|basis| fits(basis, &tracks)).unzip();
        let chosen = mean_correlation(&likelihoods);
        let (basis, fits) = (&bases[chosen], found.swap_remove(chosen));
        let coefficients = |(track, fit): (&DVector<f64>, &Fit)| {
            basis.coefficients(track, fit).unwrap_or_else(|| DVector::zeros(count))
        };
        let noise = |fit: &Fit| Noise { deviation: fit.variance.sqrt(), correlation: basis.correlation };
        Self {
            window,
            coefficients: tracks.iter().zip(&fits).map(coefficients).collect(),
            noise: fits.iter().map(noise).collect(),
        }
    }

    /// Noise of each coordinate.
    #[must_use]
    pub fn noise(&self) -> &[Noise] {
        &self.noise
    }

    /// Value, first and second derivative of every coordinate at a time.
    #[must_use]
    pub fn at(&self, time: f64) -> [Vec<f64>; 3] {
        let polynomials = self.window.polynomials(time, MOST_POLYNOMIALS);
        polynomials.map(|list| {
            let value = |c: &DVector<f64>| c.iter().zip(&list).map(|(c, p)| c * p).sum();
            self.coefficients.iter().map(value).collect()
        })
    }

    /// States and accelerations of an object whose configurations were fitted.
    #[must_use]
    pub fn states(&self, coordinates: &Coordinates, times: &[f64]) -> Vec<(State, Vec<f64>)> {
        times.iter().map(|&time| state(coordinates, self.at(time))).collect()
    }
}

/// State and acceleration from a configuration and its derivatives; a quaternion's become angular ones.
fn state(coordinates: &Coordinates, [x, first, second]: [Vec<f64>; 3]) -> (State, Vec<f64>) {
    if !coordinates.has_rotation() {
        return (State { x, v: first }, second);
    }
    let rotation = quaternion(&x);
    let length = rotation.length();
    let body = |rate: &[f64]| {
        let rate = rotation.conjugate() * (quaternion(rate) * (2.0 / (length * length)));
        [rate.x, rate.y, rate.z]
    };
    let unit = rotation.normalize();
    let configuration = [&[unit.w, unit.x, unit.y, unit.z], &x[4..]].concat();
    let joined = |rate: &[f64]| [&body(rate)[..], &rate[4..]].concat();
    (State { x: configuration, v: joined(&first) }, joined(&second))
}
