//! The displacement of a body at a time that the views of it ask for, and how well these show it.

use glam::{DMat3, DVec3};
use lgs_core::geometry::{rotation_by, solve_positive, symmetric};
use nalgebra::DMatrix;

use super::displacement::{Displacement, Pose};
use super::observation::Normal;
use super::thresholds::{DISPLACEMENT_DEVIATION, LEAST_SHOWN};

/// The displacement of a body at a time from where the scene's motion has it.
#[derive(Clone, Copy)]
pub(super) struct Found {
    /// About the centre: a rotation, unless the body deforms.
    pub(super) linear: DMat3,
    pub(super) shift: DVec3,
    /// Mean square error of the displacement by what each half of the views shows, world units; 0 where there
    /// are no halves.
    pub(super) square_error: f64,
    /// Mean variance of the coordinates of the place, by what the views resolve, world units squared.
    pub(super) variance: f64,
}

impl Found {
    pub(super) const STILL: Self =
        Self { linear: DMat3::IDENTITY, shift: DVec3::ZERO, square_error: 0.0, variance: 0.0 };

    /// Adds the displacement that the views of a time ask for; `weight` is that of a squared difference.
    pub(super) fn refine(&mut self, normals: &[&Normal], body: &Pose, weight: f64) {
        let found = solved(normals, body, weight);
        let [tx, ty, tz, rx, ry, rz, xx, yy, zz, yz, xz, xy] = found;
        let stretch = DMat3::IDENTITY + symmetric(&[xx, yy, zz, xy, xz, yz]);
        self.linear = rotation_by(DVec3::new(rx, ry, rz)) * stretch * self.linear;
        self.shift += DVec3::new(tx, ty, tz);
        self.variance = variance_of_place(normals, body, weight);
        if normals.len() > 1 {
            let half =
                |first: usize| -> Vec<&Normal> { normals.iter().skip(first).step_by(2).copied().collect() };
            let [even, odd] = [0, 1].map(|first| solved(&half(first), body, weight));
            let square =
                |i: usize| (0.5 * (even[i] - odd[i]) / unit(body, i) * f64::from(body.radius)).powi(2);
            self.square_error = (0..body.freedoms()).map(square).sum::<f64>() / body.freedoms() as f64;
        }
    }
}

/// Standard deviations of the places of a body over time, in units of the median, which none is below: what
/// shows a body better than most times do leaves the errors of its Gaussians, which are much the same at all.
pub(super) fn deviations(found: &[Found]) -> Vec<f64> {
    let median = median_variance(found);
    let deviation = |found: &Found| (found.variance / median).sqrt().max(1.0);
    if median.is_normal() { found.iter().map(deviation).collect() } else { Vec::new() }
}

/// Indices of the times at which the images show all of some bodies well, and of the start; `found` is by
/// body and time. Where few images show a time, a body may be out of their view, and its pose there is that
/// of the scene's motion; a fit takes all poses as equally good.
pub(super) fn well_shown(found: &[&Vec<Found>]) -> Vec<usize> {
    let most: Vec<f64> = found.iter().map(|found| median_variance(found) / LEAST_SHOWN).collect();
    let shows = |time: usize| found.iter().zip(&most).all(|(found, most)| found[time].variance <= *most);
    let all = 0..found.first().map_or(0, |found| found.len());
    let shown: Vec<usize> = all.clone().filter(|&time| time == 0 || shows(time)).collect();
    if 2 * shown.len() < all.len() { all.collect() } else { shown }
}

/// The median over time of the variance of a body's place.
fn median_variance(found: &[Found]) -> f64 {
    let mut variances: Vec<f64> = found.iter().map(|found| found.variance).collect();
    variances.sort_by(f64::total_cmp);
    variances.get(variances.len() / 2).copied().unwrap_or_default()
}

/// The unit of a number of a displacement: a radius, or a radian.
fn unit(body: &Pose, number: usize) -> f64 {
    if number < 3 { f64::from(body.radius) } else { 1.0 }
}

/// The least-squares displacement of the views of a time; none if it is not determined.
fn solved(normals: &[&Normal], body: &Pose, weight: f64) -> Displacement {
    let n = body.freedoms();
    let (a, b) = equations(normals, body, weight);
    let found = solve_positive(a, &b).filter(|found| found.iter().all(|x| x.is_finite()));
    let mut displacement = Displacement::default();
    found.into_iter().for_each(|found| displacement[..n].copy_from_slice(found.as_slice()));
    displacement
}

/// The mean variance of the coordinates of a body's place by the views of a time, world units squared.
fn variance_of_place(normals: &[&Normal], body: &Pose, weight: f64) -> f64 {
    let (a, _) = equations(normals, body, weight);
    let units = DMatrix::identity(body.freedoms(), 3);
    solve_positive(a, &units).map_or(f64::INFINITY, |found| found.rows(0, 3).trace() / 3.0)
}

/// Normal equations of the displacement of a body by the views of a time, with its weak prior.
fn equations(normals: &[&Normal], body: &Pose, weight: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = body.freedoms();
    let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, 1));
    for normal in normals {
        for i in 0..n {
            b[i] += weight * normal.b[i];
            (0..n).for_each(|j| a[(i, j)] += weight * normal.a[i][j]);
        }
    }
    (0..n).for_each(|i| a[(i, i)] += (DISPLACEMENT_DEVIATION * unit(body, i)).powi(-2));
    (a, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown_with(deviation: f64) -> Found {
        Found { variance: deviation * deviation, ..Found::STILL }
    }

    #[test]
    fn times_that_images_hardly_show_are_left_out_but_the_start() {
        let one: Vec<Found> = [9.0, 1.0, 1.2, 8.0, 1.1, 0.8].map(shown_with).to_vec();
        let other: Vec<Found> = [0.1, 0.1, 0.1, 0.1, 0.1, 0.5].map(shown_with).to_vec();
        assert_eq!(well_shown(&[&one]), [0, 1, 2, 4, 5]);
        assert_eq!(well_shown(&[&one, &other]), [0, 1, 2, 4]);
        let third: Vec<Found> = [0.1, 0.9, 0.9, 0.1, 0.1, 0.1].map(shown_with).to_vec();
        assert_eq!(well_shown(&[&one, &other, &third]), [0, 1, 2, 3, 4, 5], "too few would be left");
    }
}
