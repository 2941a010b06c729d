//! Planes in which points at rest lie.

use super::plane::Plane;
use crate::thresholds::{EXACT, FEWEST_OF_PLANE, MOST_PLANES, PLANE_DRAWS, PLANE_ROUNDS, SHARP};
use glam::DVec3;
use lgs_core::{Stream, stream};
use rand_distr::{Distribution, Uniform};

/// A plane with the points at rest that lie in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// The plane, its normal to the side of the body.
    pub plane: Plane,
    /// Middle of the points.
    pub middle: [f64; 3],
    /// Standard deviation of the points from the plane, world units.
    pub roughness: f64,
    /// Whether the points cluster about the plane rather than fill the tolerance within which they were
    /// sought, as those of a thick layer do, in which many planes lie.
    pub is_sharp: bool,
}

impl Ground {
    /// Standard deviation of the plane's tilt, radians, for points that spread at least over an extent: their
    /// errors may be the same in all of a neighbourhood.
    #[must_use]
    pub fn tilt_deviation(&self, extent: f64) -> f64 {
        (self.roughness / extent).max(EXACT)
    }
}

/// Planes in which many of some points at rest lie to within `tolerance`, the most populated first, with
/// their normals to the side of `above`; after the first six only those of other surfaces, since a thick
/// layer holds many. The draws are the same for every call.
#[must_use]
pub fn planes(points: &[[f64; 3]], above: [f64; 3], tolerance: f64) -> Vec<Ground> {
    let mut left: Vec<DVec3> = points.iter().map(|point| DVec3::from(*point)).collect();
    let mut stream = stream(0, "planes of points at rest", 0);
    let mut found: Vec<Ground> = Vec::new();
    for _ in 0..2 * MOST_PLANES {
        if left.len() < FEWEST_OF_PLANE {
            break;
        }
        let Some(plane) = drawn(&left, tolerance, &mut stream) else { break };
        let Some((ground, inside)) = refined(&left, plane, above, tolerance) else { break };
        left = left.into_iter().zip(inside).filter(|(_, inside)| !inside).map(|(point, _)| point).collect();
        let is_other = |other: &Ground| other.plane.is_of_other_surface(&ground.plane);
        if found.len() < MOST_PLANES || found.iter().all(is_other) {
            found.push(ground);
        }
    }
    found
}

/// The plane through three points that has the most others near it.
fn drawn(points: &[DVec3], tolerance: f64, stream: &mut Stream) -> Option<(DVec3, f64)> {
    let any = Uniform::new(0, points.len()).ok()?;
    let mut best: Option<(usize, (DVec3, f64))> = None;
    for _ in 0..PLANE_DRAWS {
        let [a, b, c] = [0; 3].map(|_: i32| points[any.sample(stream)]);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        let offset = normal.dot(a);
        let count = points.iter().filter(|point| (normal.dot(**point) - offset).abs() <= tolerance).count();
        if best.is_none_or(|(most, _)| count > most) {
            best = Some((count, (normal, offset)));
        }
    }
    best.filter(|(count, _)| *count >= FEWEST_OF_PLANE).map(|(_, plane)| plane)
}

/// The plane nearest in the mean square to the points near another one, and which points these are.
fn refined(
    points: &[DVec3],
    (mut normal, mut offset): (DVec3, f64),
    above: [f64; 3],
    tolerance: f64,
) -> Option<(Ground, Vec<bool>)> {
    let mut found = None;
    for _ in 0..PLANE_ROUNDS {
        let inside: Vec<bool> =
            points.iter().map(|point| (normal.dot(*point) - offset).abs() <= tolerance).collect();
        let own: Vec<[f64; 3]> =
            points.iter().zip(&inside).filter(|(_, i)| **i).map(|(p, _)| p.to_array()).collect();
        let plane = Plane::through(&own, above).filter(|_| own.len() >= FEWEST_OF_PLANE)?;
        (normal, offset) = (DVec3::from(plane.normal), plane.offset);
        let square = own.iter().map(|point| plane.height(DVec3::from(*point)).powi(2)).sum::<f64>();
        let count = own.len() as f64;
        let middle = own.iter().map(|point| DVec3::from(*point)).sum::<DVec3>() / count;
        let roughness = (square / count).sqrt();
        let is_sharp = roughness <= SHARP * tolerance;
        let ground = Ground { plane, middle: middle.to_array(), roughness, is_sharp };
        found = Some((ground, inside));
    }
    found
}
