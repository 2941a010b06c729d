//! A smooth path in space from cones of view: the Chebyshev polynomial that passes nearest to the rays of its
//! blobs, which are found and fitted in turns, with less weight for what lies farther off.

use lgs_core::geometry::solve_positive;
use lgs_core::linear::{dot, norm, scale, sub};
use lgs_core::median;
use nalgebra::DMatrix;

use super::silhouettes::Silhouette;
use super::thresholds::{CURVE_DEGREE, CURVE_RIDGE, CURVE_TURNS, GATES, RAY_SCALE, WIDE_TURNS};

const TERMS: usize = CURVE_DEGREE + 1;

/// A smooth path over a span of times.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    pub(super) span: (f32, f32),
    coefficients: [[f64; 3]; TERMS],
}

/// A blob that belongs to a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
    /// Number of the silhouette.
    pub(super) silhouette: usize,
    /// Number of the blob in it.
    pub(super) blob: usize,
    /// Distance of the path from its ray, world units.
    pub(super) distance: f32,
    /// Radius of the thing that it is the silhouette of, world units.
    pub(super) radius: f32,
}

impl Curve {
    /// The polynomial nearest to points at times.
    pub(super) fn through(moments: &[f32], points: &[[f32; 3]]) -> Option<Self> {
        let span = (moments[0], moments[moments.len() - 1]);
        let (mut gram, mut rhs) = (DMatrix::zeros(TERMS, TERMS), DMatrix::zeros(TERMS, 3));
        for (&t, p) in moments.iter().zip(points) {
            let basis = basis(span, t);
            for i in 0..TERMS {
                (0..TERMS).for_each(|j| gram[(i, j)] += basis[i] * basis[j]);
                (0..3).for_each(|axis| rhs[(i, axis)] += basis[i] * f64::from(p[axis]));
            }
        }
        let found = solve_positive(gram, &rhs)?;
        let coefficients = std::array::from_fn(|i| std::array::from_fn(|axis| found[(i, axis)]));
        Some(Self { span, coefficients })
    }

    /// The position at a time, world units; beyond the observed times that of the nearest end.
    pub(super) fn at(&self, time: f32) -> [f32; 3] {
        let basis = basis(self.span, time.clamp(self.span.0, self.span.1));
        std::array::from_fn(|axis| {
            (0..TERMS).map(|i| basis[i] * self.coefficients[i][axis]).sum::<f64>() as f32
        })
    }

    /// How many numbers a path has.
    pub(super) fn coefficients(&self) -> usize {
        3 * TERMS
    }

    /// Changes one number of the path, world units.
    pub(super) fn shift(&mut self, number: usize, by: f64) {
        self.coefficients[number / 3][number % 3] += by;
    }

    /// The path drawn to the blobs around it, and these blobs. `radius` is that of the thing, as far as it is
    /// known.
    pub(super) fn refined(
        mut self,
        silhouettes: &[Silhouette],
        radius: f32,
    ) -> Option<(Self, Vec<Sighting>)> {
        let mut sightings = Vec::new();
        let mut radius = radius;
        for turn in 0..CURVE_TURNS {
            let gate = GATES[usize::from(turn >= WIDE_TURNS)] * radius;
            sightings = self.sightings(silhouettes, gate);
            radius = median_of(sightings.iter().map(|s| s.radius)).unwrap_or(radius);
            self = self.nearest_to(silhouettes, &sightings, radius)?;
        }
        Some((self, sightings))
    }

    /// The blob of every silhouette whose ray passes nearest to the path, if it does so within the gate.
    fn sightings(&self, silhouettes: &[Silhouette], gate: f32) -> Vec<Sighting> {
        let nearest = |(index, silhouette): (usize, &Silhouette)| {
            let from_eye = sub(self.at(silhouette.time), silhouette.camera.center_in_world());
            let sighting = |(blob, cone): (usize, &super::silhouettes::Blob)| {
                let depth = dot(from_eye, cone.direction);
                let distance = norm(sub(from_eye, scale(cone.direction, depth)));
                Sighting {
                    silhouette: index,
                    blob,
                    distance,
                    radius: if depth > 0.0 { cone.angular_radius * depth } else { 0.0 },
                }
            };
            let seen = silhouette
                .blobs
                .iter()
                .enumerate()
                .map(sighting)
                .filter(|s| s.radius > 0.0 && s.distance < gate);
            seen.min_by(|a, b| a.distance.total_cmp(&b.distance))
        };
        silhouettes.iter().enumerate().filter_map(nearest).collect()
    }

    /// Weighted least squares of the distances from the rays of the blobs.
    fn nearest_to(&self, silhouettes: &[Silhouette], sightings: &[Sighting], radius: f32) -> Option<Self> {
        const N: usize = 3 * TERMS;
        let (mut gram, mut rhs) = (DMatrix::zeros(N, N), DMatrix::zeros(N, 1));
        for sighting in sightings {
            let silhouette = &silhouettes[sighting.silhouette];
            let (eye, ray) = (silhouette.camera.center_in_world(), silhouette.blobs[sighting.blob].direction);
            let across =
                |a: usize, b: usize| f64::from(u8::from(a == b)) - f64::from(ray[a]) * f64::from(ray[b]);
            let basis = basis(self.span, silhouette.time);
            let weight = f64::from(1.0 / (1.0 + sighting.distance / (RAY_SCALE * radius)));
            for a in 0..3 {
                let target: f64 = (0..3).map(|b| across(a, b) * f64::from(eye[b])).sum();
                for i in 0..TERMS {
                    rhs[a * TERMS + i] += weight * basis[i] * target;
                    for b in 0..3 {
                        for j in 0..TERMS {
                            gram[(a * TERMS + i, b * TERMS + j)] +=
                                weight * across(a, b) * basis[i] * basis[j];
                        }
                    }
                }
            }
        }
        for k in 0..N {
            gram[(k, k)] +=
                CURVE_RIDGE * sightings.len() as f64 * ((k % TERMS) as f64).powi(6) + f64::MIN_POSITIVE;
        }
        let found = solve_positive(gram, &rhs)?;
        let coefficients = std::array::from_fn(|i| std::array::from_fn(|a| found[a * TERMS + i]));
        Some(Self { span: self.span, coefficients })
    }
}

/// Chebyshev polynomials of the first kind over a span.
fn basis((start, end): (f32, f32), time: f32) -> [f64; TERMS] {
    let x = 2.0 * f64::from(time - start) / f64::from((end - start).max(1e-6)) - 1.0;
    let mut values = [1.0; TERMS];
    values[1] = x;
    for n in 2..TERMS {
        values[n] = 2.0 * x * values[n - 1] - values[n - 2];
    }
    values
}

/// The median of some values; none without values.
pub(super) fn median_of(values: impl Iterator<Item = f32>) -> Option<f32> {
    median(values.map(f64::from)).map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::linear::add;

    #[test]
    fn a_curve_passes_through_what_it_was_fitted_to() {
        let moments: Vec<f32> = (0..30).map(|i| i as f32 * 0.02).collect();
        let arc = |t: f32| add([0.5, 0.0, 0.2], scale([(4.0 * t).cos(), (4.0 * t).sin(), t * t], 1.5));
        let points: Vec<[f32; 3]> = moments.iter().map(|&t| arc(t)).collect();
        let curve = Curve::through(&moments, &points).expect("enough points");
        assert!([0.0_f32, 0.11, 0.4, 0.58].iter().all(|&t| norm(sub(curve.at(t), arc(t))) < 1e-4));
        assert_eq!(curve.at(9.0), curve.at(0.58));
    }
}
