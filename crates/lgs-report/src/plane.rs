//! The plane in which a motion is best seen: the two directions in which paths vary most.

use glam::{DMat3, DVec3};
use lgs_core::geometry::{narrow, outer, principal_axes, wide};

use crate::axis::number;
use crate::thresholds::{SHAPE_WEIGHT, SMALL_COMPONENT, UPRIGHT};

/// A plane with two orthonormal directions, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) origin: DVec3,
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
}

impl Plane {
    /// The plane of a motion, through the mean of all its positions; `paths` is `[particle][time]`.
    pub(crate) fn of_motion(paths: &[Vec<[f32; 3]>]) -> Self {
        let finite = |path: &[[f32; 3]]| -> Vec<DVec3> {
            path.iter().map(|&p| wide(p)).filter(|p| p.is_finite()).collect()
        };
        let mean = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let paths: Vec<Vec<DVec3>> = paths.iter().map(|path| finite(path)).collect();
        let origin = mean(&paths.concat());
        let mut covariance = DMat3::ZERO;
        for path in &paths {
            let center = mean(path);
            for &p in path {
                covariance += outer(p - center, p - center) + SHAPE_WEIGHT * outer(p - origin, p - origin);
            }
        }
        let [(_, first), (_, second), _] = principal_axes(&covariance);
        Self { origin, ..oriented(first, second) }
    }

    /// A position in the plane's coordinates.
    pub(crate) fn project(&self, p: [f32; 3]) -> (f64, f64) {
        let [x, y] = self.direction(wide(p) - self.origin);
        (x, y)
    }

    /// A direction in the plane's coordinates.
    pub(crate) fn direction(&self, v: DVec3) -> [f64; 2] {
        [v.dot(self.right), v.dot(self.up)]
    }

    /// The position of plane coordinates.
    pub(crate) fn position(&self, at: [f64; 2]) -> [f32; 3] {
        narrow(self.origin + at[0] * self.right + at[1] * self.up)
    }

    /// Both directions as axis labels in world units, such as `0.94 x − 0.33 y`.
    pub(crate) fn labels(&self) -> [String; 2] {
        [self.right, self.up].map(|direction| written(direction.to_array()))
    }
}

/// The plane's directions turned so that up is up where the plane allows it, and right is towards positive x
/// or y.
fn oriented(first: DVec3, second: DVec3) -> Plane {
    let vertical = [first[2], second[2]];
    let length = vertical[0].hypot(vertical[1]);
    let in_plane = |a: f64, b: f64| a * first + b * second;
    let (mut right, up) = if length > UPRIGHT {
        let (s, c) = (vertical[0] / length, vertical[1] / length);
        (in_plane(c, -s), in_plane(s, c))
    } else {
        let horizontal = [first[0], second[0]];
        let length = horizontal[0].hypot(horizontal[1]);
        let (c, s) = if length > SMALL_COMPONENT {
            (horizontal[0] / length, horizontal[1] / length)
        } else {
            (1.0, 0.0)
        };
        let (right, mut up) = (in_plane(c, s), in_plane(-s, c));
        let largest = up[if up[1].abs() >= up[2].abs() { 1 } else { 2 }];
        if largest < 0.0 {
            up = -up;
        }
        (right, up)
    };
    let leading = right[if right[0].abs() >= right[1].abs() { 0 } else { 1 }];
    if leading < 0.0 {
        right = -right;
    }
    Plane { origin: DVec3::ZERO, right, up }
}

fn written(d: [f64; 3]) -> String {
    let mut text = String::new();
    let alone = d.iter().filter(|v| v.abs() >= SMALL_COMPONENT).count() == 1;
    for (value, name) in d.into_iter().zip(["x", "y", "z"]).filter(|(v, _)| v.abs() >= SMALL_COMPONENT) {
        let sign = match (text.is_empty(), value < 0.0) {
            (true, true) => "−",
            (true, false) => "",
            (false, true) => " − ",
            (false, false) => " + ",
        };
        let size = if alone { String::new() } else { format!("{} ", number(value.abs(), 2)) };
        text.push_str(&format!("{sign}{size}{name}"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_seen_from_its_axis() {
        let (a, b) = ([0.6_f32, 0.0, 0.8], [0.0_f32, 1.0, 0.0]);
        let circle = (0..40)
            .map(|i| 0.157 * i as f32)
            .map(|t| std::array::from_fn(|c| 2.0 * t.cos() * a[c] + t.sin() * b[c]))
            .collect();
        let plane = Plane::of_motion(&[circle]);
        let normal = DVec3::new(-0.8, 0.0, 0.6);
        assert!(plane.right.dot(normal).abs() < 1e-6 && plane.up.dot(normal).abs() < 1e-6, "{plane:?}");
        assert!(plane.right.dot(plane.up).abs() < 1e-9 && plane.up.is_normalized());
        assert!(plane.up.z > 0.79, "up is up: {plane:?}");
        let back = plane.project(plane.position([0.3, -0.4]));
        assert!((back.0 - 0.3).abs() < 1e-6 && (back.1 + 0.4).abs() < 1e-6);
    }

    #[test]
    fn a_fall_is_seen_upright_and_no_motion_has_a_plane() {
        let fall = |x: f32| (0..10).map(|i| [x, 0.1 * x, -0.1 * i as f32]).collect::<Vec<_>>();
        let plane = Plane::of_motion(&[fall(0.0), fall(0.5)]);
        assert!(plane.up.z > 0.999, "{plane:?}");
        assert_eq!(plane.labels()[1], "z");
        let still = Plane::of_motion(&[]);
        assert!(still.right.is_normalized());
    }

    #[test]
    fn directions_are_written_with_signs() {
        assert_eq!(written([0.94, -0.34, 0.01]), "0.94 x − 0.34 y");
        assert_eq!(written([-0.6, 0.0, 0.8]), "−0.60 x + 0.80 z");
        assert_eq!(written([0.0, 1.0, 0.0]), "y");
    }
}
