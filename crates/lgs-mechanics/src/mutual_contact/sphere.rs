//! The sphere that Gaussians draw.

use super::thresholds::{
    FEWEST_OF_SPHERE, HALF_TRANSPARENT, MOST_INSIDE, MOST_OUTSIDE, OFF_SPHERE, SPHERE_ROUNDS, SPHERE_SPREAD,
};
use glam::{DMat3, DVec3};
use lgs_core::median;

/// A Gaussian of a body's surface, world units.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceGaussian {
    /// Its mean.
    pub mean: DVec3,
    /// Its covariance.
    pub covariance: DMat3,
}

impl SurfaceGaussian {
    /// Distance from a centre at which the Gaussian, if it is opaque, is half transparent.
    fn reach(&self, center: DVec3) -> f64 {
        let away = self.mean - center;
        let outward = away.normalize_or_zero();
        away.length() + HALF_TRANSPARENT * outward.dot(self.covariance * outward).max(0.0).sqrt()
    }
}

/// Centre and radius of the sphere to which most of a body's opaque Gaussians reach; `None` if a part of them
/// reaches elsewhere that is too large for a ball, such as the ends of a rod.
pub(super) fn sphere(gaussians: &[SurfaceGaussian]) -> Option<(DVec3, f64)> {
    if gaussians.len() < FEWEST_OF_SPHERE {
        return None;
    }
    let middle = |axis: usize| median(gaussians.iter().map(|gaussian| gaussian.mean[axis]));
    let mut center = DVec3::new(middle(0)?, middle(1)?, middle(2)?);
    let mut radius = 0.0;
    for _ in 0..SPHERE_ROUNDS {
        let reaches: Vec<f64> = gaussians.iter().map(|gaussian| gaussian.reach(center)).collect();
        let typical = median(reaches.iter().copied())?;
        // Cauchy's weights: Gaussians inside of the body and those that float apart from it hardly count.
        let weight = |reach: &f64| (1.0 + ((reach - typical) / (SPHERE_SPREAD * typical)).powi(2)).recip();
        let weights: Vec<f64> = reaches.iter().map(weight).collect();
        let total: f64 = weights.iter().sum();
        radius = reaches.iter().zip(&weights).map(|(reach, weight)| reach * weight).sum::<f64>() / total;
        let pulls = gaussians.iter().zip(reaches.iter().zip(&weights));
        let pull: DVec3 = pulls
            .map(|(gaussian, (reach, weight))| {
                (gaussian.mean - center).normalize_or_zero() * ((reach - radius) * weight)
            })
            .sum();
        // Over directions evenly, a shift changes the mean of these pulls by a third of itself.
        center += 3.0 * pull / total;
    }
    let share = |is_off: &dyn Fn(f64) -> bool| {
        let off = gaussians.iter().filter(|gaussian| is_off(gaussian.reach(center) / radius - 1.0)).count();
        off as f64 / gaussians.len() as f64
    };
    let [inside, outside] = [share(&|off| off < -OFF_SPHERE), share(&|off| off > OFF_SPHERE)];
    let is_ball = inside <= MOST_INSIDE && outside <= MOST_OUTSIDE;
    (radius > 0.0 && radius.is_finite() && is_ball).then_some((center, radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gaussians that draw a body which reaches so far in a direction, 0.05 below its surface.
    fn over(surface: impl Fn(DVec3) -> f64) -> Vec<SurfaceGaussian> {
        let spread = 0.05 / HALF_TRANSPARENT;
        let gaussian = |k: usize| {
            let (z, turn) = (1.0 - (2 * k + 1) as f64 / 120.0, 2.4 * k as f64);
            let across = f64::sqrt(1.0 - z * z);
            let outward = DVec3::new(across * turn.cos(), across * turn.sin(), z);
            let noise = 0.02 * (17.0 * k as f64).sin();
            let mean = DVec3::new(1.0, 2.0, 3.0) + outward * (surface(outward) - 0.05 + noise);
            SurfaceGaussian { mean, covariance: DMat3::from_diagonal(DVec3::splat(spread * spread)) }
        };
        (0..120).map(gaussian).collect()
    }

    #[test]
    fn a_ball_is_found_in_spite_of_gaussians_inside_and_outside_of_it() {
        let mut ball = over(|_| 0.4);
        for (k, gaussian) in ball.iter_mut().enumerate().filter(|(k, _)| k % 6 == 0) {
            let factor = if k % 12 == 0 { 0.3 } else { 1.8 };
            gaussian.mean = DVec3::new(1.0, 2.0, 3.0) + factor * (gaussian.mean - DVec3::new(1.0, 2.0, 3.0));
        }
        let (center, radius) = sphere(&ball).expect("a sphere");
        assert!(center.distance(DVec3::new(1.0, 2.0, 3.0)) < 0.01 && (radius - 0.4).abs() < 0.01, "{radius}");
        // A source may not draw what no camera sees.
        let seen: Vec<SurfaceGaussian> = ball.into_iter().filter(|gaussian| gaussian.mean.z > 2.8).collect();
        let (center, radius) = sphere(&seen).expect("a sphere");
        assert!(center.distance(DVec3::new(1.0, 2.0, 3.0)) < 0.04 && (radius - 0.4).abs() < 0.04, "{radius}");
    }

    #[test]
    fn a_rod_and_a_plate_are_no_balls() {
        let ellipsoid = |axes: DVec3| move |outward: DVec3| 0.4 / (outward / axes).length();
        for axes in [DVec3::new(3.0, 1.0, 1.0), DVec3::new(2.0, 2.0, 0.7), DVec3::new(1.8, 1.2, 0.8)] {
            assert!(sphere(&over(ellipsoid(axes))).is_none(), "{axes}");
        }
        assert!(sphere(&over(ellipsoid(DVec3::new(1.05, 1.0, 0.95)))).is_some());
    }
}
