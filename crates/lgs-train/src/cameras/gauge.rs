//! What no image shows of corrections of poses: a motion of the whole world, or another scale of it.
//!
//! Cameras that are moved with the world see the same. Corrections are kept orthogonal to these seven
//! directions, so that the scene stays where held-out cameras look for it. Among all corrections that explain
//! the images alike, these are the smallest.

use glam::{DMat3, DVec3};
use lgs_core::Camera;

use super::refinement::Given;
use crate::thresholds::LEAST_DIRECTION;

/// A correction of every camera, six numbers each, in pixels.
type Direction = Vec<f64>;

/// The directions of corrections of some cameras that no image shows, orthonormal.
pub(super) fn directions(cameras: &[Given], center: [f32; 3]) -> Vec<Direction> {
    let fields: Vec<[[f64; 6]; 7]> = cameras.iter().map(|given| of_camera(given, center)).collect();
    let mut found: Vec<Direction> = Vec::new();
    for which in 0..7 {
        let mut direction: Direction = fields.iter().flat_map(|field| field[which]).collect();
        let length = norm(&direction);
        for other in &found {
            let along: f64 = direction.iter().zip(other).map(|(a, b)| a * b).sum();
            direction.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
        }
        let left = norm(&direction);
        if left > LEAST_DIRECTION * length {
            direction.iter_mut().for_each(|v| *v /= left);
            found.push(direction);
        }
    }
    found
}

fn norm(direction: &[f64]) -> f64 {
    direction.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The corrections of one camera, pixels, that go with a translation of the world along each axis, a rotation
/// about each axis through a point, and a change of its scale about it.
fn of_camera(given: &Given, center: [f32; 3]) -> [[f64; 6]; 7] {
    let camera: &Camera = &given.camera;
    let world = camera.camera_from_world.as_dmat4();
    let rotation = DMat3::from_mat4(world);
    let seen = world.transform_point3(DVec3::from_array(center.map(f64::from)));
    let units = given.units().map(f64::from);
    let in_pixels = |turn: DVec3, shift: DVec3| {
        let by = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
        std::array::from_fn(|i| by[i] / units[i])
    };
    let axis = |k: usize| rotation.col(k);
    std::array::from_fn(|which| match which {
        k @ 0..3 => in_pixels(DVec3::ZERO, -axis(k)),
        k @ 3..6 => in_pixels(-axis(k - 3), axis(k - 3).cross(seen)),
        _ => in_pixels(DVec3::ZERO, seen),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat4, Quat, Vec3};

    fn rig() -> Vec<Given> {
        let camera = |i: usize| {
            let angle = 0.9 * i as f32;
            let eye = [4.0 * angle.cos(), 3.0 * angle.sin(), 1.0 + 0.2 * i as f32];
            let camera = Camera::look_at(eye, [0.2, 0.1, 0.3], 0.8, 160, 120);
            Given { camera, depth: camera.pixel_from_world([0.2, 0.1, 0.3]).1 }
        };
        (0..5).map(camera).collect()
    }

    #[test]
    fn cameras_that_are_moved_with_the_world_are_moved_along_these_directions() {
        let (rig, center) = (rig(), [0.2, 0.1, 0.3]);
        let step = 1e-3;
        let about = |moved: Mat4| {
            let center = Mat4::from_translation(Vec3::from(center));
            center * moved * center.inverse()
        };
        let motions = [
            Mat4::from_translation(Vec3::Y * step),
            about(Mat4::from_quat(Quat::from_rotation_x(step))),
            about(Mat4::from_scale(Vec3::splat(1.0 + step))),
        ];
        for (which, motion) in [1, 3, 6].into_iter().zip(motions) {
            for given in &rig {
                let field = of_camera(given, center)[which];
                let units = given.units();
                let by = std::array::from_fn(|i| field[i] as f32 * units[i] * step);
                let moved = given.camera.seeing_moved(by);
                for point in [Vec3::new(0.5, 0.2, 0.1), Vec3::new(-0.3, 0.4, 0.9)] {
                    let (before, _) = given.camera.pixel_from_world(point.into());
                    let (after, _) = moved.pixel_from_world(motion.transform_point3(point).into());
                    let apart = (0..2).map(|i| (before[i] - after[i]).abs()).fold(0.0, f32::max);
                    assert!(apart < 5e-3, "{which}: {before:?} {after:?}");
                }
            }
        }
    }

    #[test]
    fn one_camera_has_nothing_to_refine_and_five_have_seven_directions_less() {
        assert_eq!(directions(&rig()[..1], [0.0; 3]).len(), 6);
        let found = directions(&rig(), [0.0; 3]);
        assert_eq!(found.len(), 7);
        for (i, a) in found.iter().enumerate() {
            for (j, b) in found.iter().enumerate() {
                let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-9, "{i} {j}");
            }
        }
    }
}
