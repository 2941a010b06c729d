//! Smooth paths of all coordinates of an object, with the restricted likelihood of their noise.

use super::Noise;
use super::polynomial::Window;
use crate::coordinates::{Coordinates, State, quaternion};
use nalgebra::{DMatrix, DVector};

/// Values of ρ that are tried. Beyond the last, noise and motion cannot be told apart in a window.
const CORRELATIONS: [f64; 12] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9];

/// Most polynomials of a path; a track has at least three samples for each.
const MOST_POLYNOMIALS: usize = 24;

/// Relative noise of a track that has none: `f64` residuals of a track of size 1.
const NO_NOISE: f64 = 1e-12;

/// A polynomial in time for each coordinate, with the noise around it.
#[derive(Clone, Debug)]
pub struct SmoothPath {
    window: Window,
    coefficients: Vec<DVector<f64>>,
    pub(super) noise: Vec<Noise>,
}

/// A polynomial through one coordinate at one ρ.
struct Path {
    coefficients: DVector<f64>,
    variance: f64,
    /// −2 ln of the likelihood and of the restricted one.
    likelihood: f64,
    restricted: f64,
}

/// Rows freed of their correlation: innovations in units of the noise's own variance.
fn innovations(rows: &DMatrix<f64>, correlation: f64) -> DMatrix<f64> {
    let scale = 1.0 / (1.0 - correlation * correlation).sqrt();
    let mut found = rows.clone();
    for k in 1..rows.nrows() {
        found.row_mut(k).copy_from(&((rows.row(k) - rows.row(k - 1) * correlation) * scale));
    }
    found
}

/// Least squares of one coordinate; `basis` and `values` are innovations at ρ.
fn path(basis: &DMatrix<f64>, values: &DVector<f64>, correlation: f64) -> Option<Path> {
    let (samples, columns) = basis.shape();
    let qr = basis.clone().qr();
    let triangle = qr.r();
    let coefficients = triangle.solve_upper_triangular(&(qr.q().transpose() * values))?;
    let square = (values - basis * &coefficients).norm_squared();
    let size = values.amax().max(f64::MIN_POSITIVE);
    let square = square.max(samples as f64 * (NO_NOISE * size).powi(2));
    let log_noise = (samples - 1) as f64 * (1.0 - correlation * correlation).ln();
    let log_basis = 2.0 * triangle.diagonal().iter().map(|d| d.abs().ln()).sum::<f64>();
    let left = (samples - columns) as f64;
    Some(Path {
        coefficients,
        variance: square / left,
        likelihood: samples as f64 * (square / samples as f64).ln() + log_noise,
        restricted: left * (square / left).ln() + log_noise + log_basis,
    })
}

/// Number of polynomials of a coordinate by the information criterion, over all ρ.
fn count_of(basis: &DMatrix<f64>, values: &DVector<f64>, allowed: usize) -> usize {
    let penalty = (values.len() as f64).ln();
    let mut best = (f64::INFINITY, 1);
    for correlation in CORRELATIONS {
        let (basis, values) = freed(basis, values, correlation);
        for count in 1..=allowed {
            let part = basis.columns(0, count).into_owned();
            let Some(found) = path(&part, &values, correlation) else { continue };
            let criterion = found.likelihood + penalty * count as f64;
            if criterion < best.0 {
                best = (criterion, count);
            }
        }
    }
    best.1
}

/// Innovations of basis and values.
fn freed(basis: &DMatrix<f64>, values: &DVector<f64>, correlation: f64) -> (DMatrix<f64>, DVector<f64>) {
    let column = DMatrix::from_column_slice(values.len(), 1, values.as_slice());
    let values = innovations(&column, correlation).column(0).into_owned();
    (innovations(basis, correlation), values)
}

impl SmoothPath {
    /// Fits tracks `[T][coordinates]` at ascending times; ρ is shared by all coordinates of an object.
    #[must_use]
    pub fn fit(times: &[f64], tracks: &[Vec<f64>]) -> Self {
        let window = Window::of(times);
        let allowed = (times.len() / 3).clamp(1, MOST_POLYNOMIALS);
        let values = |time: &f64| window.polynomials(*time, allowed)[0].clone();
        let rows: Vec<f64> = times.iter().flat_map(values).collect();
        let basis = DMatrix::from_row_slice(times.len(), allowed, &rows);
        let coordinate = |i: usize| DVector::from_iterator(tracks.len(), tracks.iter().map(|x| x[i]));
        let tracks: Vec<DVector<f64>> = (0..tracks.first().map_or(0, Vec::len)).map(coordinate).collect();
        let bases: Vec<DMatrix<f64>> =
            tracks.iter().map(|t| basis.columns(0, count_of(&basis, t, allowed)).into_owned()).collect();
        let paths_at = |correlation: f64| -> Option<(f64, Vec<Path>)> {
            let one = |(basis, track): (&DMatrix<f64>, &DVector<f64>)| {
                let (basis, values) = freed(basis, track, correlation);
                path(&basis, &values, correlation)
            };
            let paths: Vec<Path> = bases.iter().zip(&tracks).map(one).collect::<Option<_>>()?;
            Some((paths.iter().map(|path| path.restricted).sum(), paths))
        };
        let tried = CORRELATIONS.iter().filter_map(|&c| paths_at(c).map(|(l, paths)| (l, c, paths)));
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        let (correlation, paths) = best.map_or((0.0, Vec::new()), |(_, c, paths)| (c, paths));
        let noise = |path: &Path| Noise { deviation: path.variance.sqrt(), correlation };
        let noise = paths.iter().map(noise).collect();
        Self { window, coefficients: paths.into_iter().map(|path| path.coefficients).collect(), noise }
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
