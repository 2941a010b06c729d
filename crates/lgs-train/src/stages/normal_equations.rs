//! Normal equations of an object's unknowns, from what images show of its rigid parts (method §6).

use lgs_core::geometry::solve_positive;
use nalgebra::DMatrix;

use super::body::Response;
use super::displacement::Displacement;
use super::observation::Normal;

/// Least squares of `n` unknowns.
pub(super) struct NormalEquations {
    /// Of the images: `[n, n]` and `[n, 1]`.
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    /// Of what holds the unknowns to where they were before any change, `[n, n]`.
    stiffness: DMatrix<f64>,
}

impl NormalEquations {
    /// The equations of evidence with a weight of its squared error, beside a stiffness.
    pub(super) fn new(stiffness: DMatrix<f64>, evidence: &[(&Response, &Normal)], weight: f64) -> Self {
        let n = stiffness.nrows();
        Self { a: DMatrix::zeros(n, n), b: DMatrix::zeros(n, 1), stiffness }.with(evidence, weight)
    }

    /// The same without a part of the evidence.
    pub(super) fn without(&self, evidence: &[(&Response, &Normal)], weight: f64) -> Self {
        let Self { a, b, stiffness } = self;
        Self { a: a.clone(), b: b.clone(), stiffness: stiffness.clone() }.with(evidence, -weight)
    }

    fn with(mut self, evidence: &[(&Response, &Normal)], weight: f64) -> Self {
        for (response, normal) in evidence {
            for (i, left) in response.by_unknown.iter().enumerate() {
                let pushed: Displacement =
                    std::array::from_fn(|c| left.iter().zip(&normal.a).map(|(x, row)| x * row[c]).sum());
                self.b[i] += weight * dot(left, &normal.b);
                for (j, right) in response.by_unknown.iter().enumerate() {
                    self.a[(i, j)] += weight * dot(&pushed, right);
                }
            }
        }
        self
    }

    /// The step from a change of the unknowns to their best values; zeros where it is not finite.
    pub(super) fn solution(&self, change: &[f64]) -> Vec<f64> {
        let b = &self.b - &self.stiffness * DMatrix::from_column_slice(change.len(), 1, change);
        let found = solve_positive(&self.a + &self.stiffness, &b).filter(|x| x.iter().all(|x| x.is_finite()));
        found.map_or_else(|| vec![0.0; change.len()], |found| found.as_slice().to_vec())
    }
}

fn dot(a: &Displacement, b: &Displacement) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One image that asks for a displacement by `to` along x, of a part that an unknown moves along x.
    fn image(to: f64) -> (Response, Normal) {
        let along = |x: f64| std::array::from_fn(|i| if i == 0 { x } else { 0.0 });
        let response = Response { center: [0.0; 3], by_unknown: vec![along(1.0)] };
        let a = std::array::from_fn(|i| along(if i == 0 { 4.0 } else { 0.0 }));
        (response, Normal { a, b: along(4.0 * to) })
    }

    #[test]
    fn a_step_goes_to_the_mean_of_the_images_and_without_one_to_that_of_the_others() {
        let images = [1.0, 2.0, 6.0].map(image);
        let evidence: Vec<(&Response, &Normal)> = images.iter().map(|(r, n)| (r, n)).collect();
        let loose = DMatrix::from_element(1, 1, 1e-9);
        let all = NormalEquations::new(loose, &evidence, 0.5);
        assert!((all.solution(&[0.0])[0] - 3.0).abs() < 1e-6);
        assert!((all.without(&evidence[2..], 0.5).solution(&[0.0])[0] - 1.5).abs() < 1e-6);
    }

    #[test]
    fn stiffness_holds_unknowns_where_they_were() {
        let (response, normal) = image(1.0);
        let all = NormalEquations::new(DMatrix::from_element(1, 1, 4.0), &[(&response, &normal)], 1.0);
        assert!((all.solution(&[0.0])[0] - 0.5).abs() < 1e-12);
        assert!((all.solution(&[0.5])[0] - 0.25).abs() < 1e-12);
    }
}
