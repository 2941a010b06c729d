//! Planes, given or fitted.

use crate::error::MechanicsError;
use crate::thresholds::{ALONG_A_LINE, OTHER_SURFACE, UNIT_TOLERANCE};
use glam::DVec3;
use lgs_core::geometry::{outer, principal_axes};
use serde::{Deserialize, Serialize};

/// The plane `n · q = offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Unit normal, world axes, to the side of the body.
    pub normal: [f64; 3],
    /// Distance from the origin along the normal, world units.
    pub offset: f64,
}

impl Plane {
    /// Signed distance of a point.
    #[must_use]
    pub fn height(&self, point: DVec3) -> f64 {
        DVec3::from(self.normal).dot(point) - self.offset
    }

    /// Angle between the normals of two planes, radians.
    #[must_use]
    pub fn tilt_to(&self, other: &Self) -> f64 {
        DVec3::from(self.normal).angle_between(DVec3::from(other.normal))
    }

    /// Whether two planes of points at rest are those of two surfaces: a thick layer holds many planes, but
    /// of smaller tilts.
    #[must_use]
    pub fn is_of_other_surface(&self, other: &Self) -> bool {
        self.tilt_to(other) > OTHER_SURFACE
    }

    /// The plane after small turns about a point of it, by the two `tilts` across its normal (radians), and a
    /// shift along the new normal.
    #[must_use]
    pub fn changed(&self, about: [f64; 3], tilts: [f64; 2], shift: f64) -> Self {
        let (normal, about) = (DVec3::from(self.normal), DVec3::from(about));
        let (first, second) = normal.any_orthonormal_pair();
        let turned = (normal + first * tilts[0] + second * tilts[1]).normalize();
        let about = about - normal * self.height(about);
        Self { normal: turned.to_array(), offset: turned.dot(about) + shift }
    }

    /// Checks that the normal has length 1 and all is finite.
    pub fn check(&self) -> Result<(), MechanicsError> {
        let length = DVec3::from(self.normal).length();
        if (length - 1.0).abs() > UNIT_TOLERANCE || !self.offset.is_finite() || length.is_nan() {
            let (what, allowed) = ("length of a plane's normal".to_owned(), "1".to_owned());
            return Err(MechanicsError::OutOfBounds { what, value: length, allowed });
        }
        Ok(())
    }

    /// The plane through points at rest, nearest in the mean square, with the body `above` it; `None` for
    /// fewer than three points or ones along a line.
    #[must_use]
    pub fn through(points: &[[f64; 3]], above: [f64; 3]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = points.iter().map(|p| DVec3::from(*p)).sum::<DVec3>() / count;
        let spread = |p: &[f64; 3]| outer(DVec3::from(*p) - mean, DVec3::from(*p) - mean);
        let [(most, _), (middle, _), (_, normal)] = principal_axes(&points.iter().map(spread).sum());
        if points.len() < 3 || middle <= ALONG_A_LINE * most {
            return None;
        }
        let side = normal.dot(DVec3::from(above) - mean);
        let normal = if side < 0.0 { -normal } else { normal };
        Some(Self { normal: normal.to_array(), offset: normal.dot(mean) })
    }

    /// The plane of impacts: its normal along the mean change of the centre's velocity (friction has no
    /// preferred direction over several impacts), its offset that of the lowest `surface` point at each.
    #[must_use]
    pub fn of_impacts(changes: &[[f64; 3]], surfaces: &[Vec<[f64; 3]>]) -> Option<Self> {
        let normal = changes.iter().map(|change| DVec3::from(*change)).sum::<DVec3>().try_normalize()?;
        let lowest = |surface: &Vec<[f64; 3]>| {
            let heights = surface.iter().map(|point| normal.dot(DVec3::from(*point)));
            heights.min_by(f64::total_cmp)
        };
        let heights: Vec<f64> = surfaces.iter().filter_map(lowest).collect();
        let offset = heights.iter().sum::<f64>() / heights.len() as f64;
        offset.is_finite().then(|| Self { normal: normal.to_array(), offset })
    }
}
