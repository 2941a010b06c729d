//! The plane in which a motion is best seen: the two directions in which paths vary most.

use crate::axis::number;
use crate::thresholds::{SHAPE_WEIGHT, SMALL_COMPONENT, UPRIGHT};

/// A plane with two orthonormal directions, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) origin: [f64; 3],
    pub(crate) right: [f64; 3],
    pub(crate) up: [f64; 3],
}

impl Plane {
    /// The plane of a motion, through the mean of all its positions; `paths` is `[particle][time]`.
    pub(crate) fn of_motion(paths: &[Vec<[f32; 3]>]) -> Self {
        let finite = |p: &&[f32; 3]| p.iter().all(|v| v.is_finite());
        let mean = |points: &mut dyn Iterator<Item = &[f32; 3]>| {
            let (mut sum, mut n) = ([0.0_f64; 3], 0.0);
            for p in points {
                (0..3).for_each(|c| sum[c] += f64::from(p[c]));
                n += 1.0;
            }
            sum.map(|s| s / f64::max(n, 1.0))
        };
        let origin = mean(&mut paths.iter().flatten().filter(finite));
        let mut covariance = [[0.0_f64; 3]; 3];
        for path in paths {
            let center = mean(&mut path.iter().filter(finite));
            for p in path.iter().filter(finite) {
                for (from, weight) in [(center, 1.0), (origin, SHAPE_WEIGHT)] {
                    let d: [f64; 3] = std::array::from_fn(|c| f64::from(p[c]) - from[c]);
                    (0..3).for_each(|i| (0..3).for_each(|j| covariance[i][j] += weight * d[i] * d[j]));
                }
            }
        }
        let [first, second] = principal(covariance);
        Self { origin, ..oriented(first, second) }
    }

    /// A position in the plane's coordinates.
    pub(crate) fn project(&self, p: [f32; 3]) -> (f64, f64) {
        let d: [f64; 3] = std::array::from_fn(|c| f64::from(p[c]) - self.origin[c]);
        (dot(d, self.right), dot(d, self.up))
    }

    /// A direction in the plane's coordinates.
    pub(crate) fn direction(&self, v: [f64; 3]) -> [f64; 2] {
        [dot(v, self.right), dot(v, self.up)]
    }

    /// The position of plane coordinates.
    pub(crate) fn position(&self, at: [f64; 2]) -> [f32; 3] {
        std::array::from_fn(|c| (self.origin[c] + at[0] * self.right[c] + at[1] * self.up[c]) as f32)
    }

    /// Both directions as axis labels in world units, such as `0.94 x − 0.33 y`.
    pub(crate) fn labels(&self) -> [String; 2] {
        [self.right, self.up].map(written)
    }
}

/// The plane's directions turned so that up is up where the plane allows it, and right is towards positive x
/// or y.
fn oriented(first: [f64; 3], second: [f64; 3]) -> Plane {
    let vertical = [first[2], second[2]];
    let length = vertical[0].hypot(vertical[1]);
    let in_plane = |a: f64, b: f64| -> [f64; 3] { std::array::from_fn(|c| a * first[c] + b * second[c]) };
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
            up = up.map(|v| -v);
        }
        (right, up)
    };
    let leading = right[if right[0].abs() >= right[1].abs() { 0 } else { 1 }];
    if leading < 0.0 {
        right = right.map(|v| -v);
    }
    Plane { origin: [0.0; 3], right, up }
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

/// The two leading eigenvectors of a symmetric matrix, by Jacobi rotations.
fn principal(mut m: [[f64; 3]; 3]) -> [[f64; 3]; 2] {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..24 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q].abs() <= f64::EPSILON * (m[p][p].abs() + m[q][q].abs()) {
                continue;
            }
            let angle = 0.5 * (2.0 * m[p][q]).atan2(m[q][q] - m[p][p]);
            let (s, c) = angle.sin_cos();
            for row in &mut m {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            (m[p], m[q]) = (combined(m[p], m[q], c, -s), combined(m[p], m[q], s, c));
            (vectors[p], vectors[q]) =
                (combined(vectors[p], vectors[q], c, -s), combined(vectors[p], vectors[q], s, c));
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| m[b][b].total_cmp(&m[a][a]).then(a.cmp(&b)));
    [vectors[order[0]], vectors[order[1]]]
}

fn combined(a: [f64; 3], b: [f64; 3], s: f64, t: f64) -> [f64; 3] {
    std::array::from_fn(|c| s * a[c] + t * b[c])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
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
        let normal = [-0.8, 0.0, 0.6];
        assert!(dot(plane.right, normal).abs() < 1e-6 && dot(plane.up, normal).abs() < 1e-6, "{plane:?}");
        assert!(dot(plane.right, plane.up).abs() < 1e-9 && (dot(plane.up, plane.up) - 1.0).abs() < 1e-9);
        assert!(plane.up[2] > 0.79, "up is up: {plane:?}");
        let back = plane.project(plane.position([0.3, -0.4]));
        assert!((back.0 - 0.3).abs() < 1e-6 && (back.1 + 0.4).abs() < 1e-6);
    }

    #[test]
    fn a_fall_is_seen_upright_and_no_motion_has_a_plane() {
        let fall = |x: f32| (0..10).map(|i| [x, 0.1 * x, -0.1 * i as f32]).collect::<Vec<_>>();
        let plane = Plane::of_motion(&[fall(0.0), fall(0.5)]);
        assert!(plane.up[2] > 0.999, "{plane:?}");
        assert_eq!(plane.labels()[1], "z");
        let still = Plane::of_motion(&[]);
        assert!((dot(still.right, still.right) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn directions_are_written_with_signs() {
        assert_eq!(written([0.94, -0.34, 0.01]), "0.94 x − 0.34 y");
        assert_eq!(written([-0.6, 0.0, 0.8]), "−0.60 x + 0.80 z");
        assert_eq!(written([0.0, 1.0, 0.0]), "y");
    }
}
