//! What no image shows of motions of cameras: that of the whole world, and another scale of it.
//!
//! Cameras that are moved with the world see the same. Of all motions of cameras that differ only by these
//! seven, [`Gauge::remove`] gives the one that displaces the images least: the scene then stays where the
//! cameras as they are see it on average.

use crate::camera::Camera;
use crate::thresholds::{GAUGE_RADIUS, LEAST_DIRECTION};
use glam::{DMat3, DVec3};

/// Numbers of a camera's motion ([`Camera::seeing_moved`]): rotation vector, translation.
const WIDTH: usize = 6;

/// A motion of every camera, six numbers each.
type Motions = Vec<f64>;

/// The motions of some cameras that no image shows.
#[derive(Clone, Debug)]
pub struct Gauge {
    /// Motions, orthonormal in the displacements of the images.
    pub basis: Vec<Motions>,
    /// What tells how much of each motion of the basis is in others: by an inner product.
    pub dual: Vec<Motions>,
}

impl Gauge {
    /// Those of cameras that look at a place.
    #[must_use]
    pub fn of(cameras: &[Camera], center: [f32; 3]) -> Self {
        let center = DVec3::from_array(center.map(f64::from));
        let seen: Vec<(DMat3, DVec3)> = cameras
            .iter()
            .map(|camera| {
                let world = camera.camera_from_world.as_dmat4();
                (DMat3::from_mat4(world), world.transform_point3(center))
            })
            .collect();
        let distance = seen.iter().map(|(_, place)| place.length()).sum::<f64>() / seen.len().max(1) as f64;
        let metrics: Vec<Metric> =
            cameras.iter().zip(&seen).map(|(c, s)| metric(c, s, GAUGE_RADIUS * distance)).collect();
        let mut gauge = Self { basis: Vec::new(), dual: Vec::new() };
        for which in 0..7 {
            let mut motion: Motions = seen.iter().flat_map(|seen| of_camera(seen, which)).collect();
            let length = dot(&motion, &displaced(&metrics, &motion)).sqrt();
            gauge.remove(&mut motion);
            let dual = displaced(&metrics, &motion);
            let left = dot(&motion, &dual).sqrt();
            if left > LEAST_DIRECTION * length {
                gauge.basis.push(motion.iter().map(|v| v / left).collect());
                gauge.dual.push(dual.iter().map(|v| v / left).collect());
            }
        }
        gauge
    }

    /// Takes out of motions of the cameras what no image shows.
    pub fn remove(&self, motions: &mut [f64]) {
        for (basis, dual) in self.basis.iter().zip(&self.dual) {
            let along = dot(dual, motions);
            motions.iter_mut().zip(basis).for_each(|(v, b)| *v -= along * b);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The squared displacement of a camera's image as a quadratic form of its motion.
type Metric = [[f64; WIDTH]; WIDTH];

/// The form of a camera, over points around the middle of the scene on its axes.
fn metric(camera: &Camera, (rotation, place): &(DMat3, DVec3), radius: f64) -> Metric {
    let mut form = [[0.0; WIDTH]; WIDTH];
    for point in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
        let p = *place + radius * (*rotation * point);
        if p.z <= 0.0 {
            continue;
        }
        let moved = |k: usize| match k {
            0..3 => DVec3::AXES[k].cross(p),
            _ => DVec3::AXES[k - 3],
        };
        let pixels: [[f64; 2]; WIDTH] = std::array::from_fn(|k| {
            let d = moved(k);
            let slope = |along: f64, at: f64| (along - at / p.z * d.z) / p.z;
            [f64::from(camera.fx) * slope(d.x, p.x), f64::from(camera.fy) * slope(d.y, p.y)]
        });
        for (row, a) in form.iter_mut().zip(&pixels) {
            for (value, b) in row.iter_mut().zip(&pixels) {
                *value += a[0] * b[0] + a[1] * b[1];
            }
        }
    }
    form
}

/// The forms applied to motions.
fn displaced(metrics: &[Metric], motions: &[f64]) -> Motions {
    let of_camera = |(form, motion): (&Metric, &[f64])| form.map(|row| dot(&row, motion));
    metrics.iter().zip(motions.chunks_exact(WIDTH)).flat_map(of_camera).collect()
}

/// The motion of one camera that goes with a translation of the world along an axis (0 to 2), a rotation
/// about an axis through the place (3 to 5), or a change of its scale about it (6).
fn of_camera((rotation, place): &(DMat3, DVec3), which: usize) -> [f64; WIDTH] {
    let (turn, shift) = match which {
        0..3 => (DVec3::ZERO, -rotation.col(which)),
        3..6 => (-rotation.col(which - 3), rotation.col(which - 3).cross(*place)),
        _ => (DVec3::ZERO, *place),
    };
    [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat4, Quat, Vec3};

    const CENTER: [f32; 3] = [0.2, 0.1, 0.3];

    fn rig() -> Vec<Camera> {
        let camera = |i: usize| {
            let angle = 0.9 * i as f32;
            let eye = [4.0 * angle.cos(), 3.0 * angle.sin(), 1.0 + 0.2 * i as f32];
            Camera::look_at(eye, CENTER, 0.8, 160, 120)
        };
        (0..5).map(camera).collect()
    }

    #[test]
    fn cameras_that_are_moved_with_the_world_see_the_same() {
        let step = 1e-3;
        let about = |moved: Mat4| {
            let center = Mat4::from_translation(Vec3::from(CENTER));
            center * moved * center.inverse()
        };
        let motions = [
            Mat4::from_translation(Vec3::Y * step),
            about(Mat4::from_quat(Quat::from_rotation_x(step))),
            about(Mat4::from_scale(Vec3::splat(1.0 + step))),
        ];
        for (which, motion) in [1, 3, 6].into_iter().zip(motions) {
            for camera in rig() {
                let world = camera.camera_from_world.as_dmat4();
                let place = world.transform_point3(Vec3::from(CENTER).as_dvec3());
                let by = of_camera(&(DMat3::from_mat4(world), place), which).map(|v| v as f32 * step);
                for point in [Vec3::new(0.5, 0.2, 0.1), Vec3::new(-0.3, 0.4, 0.9)] {
                    let (before, _) = camera.pixel_from_world(point.into());
                    let moved = camera.seeing_moved(by);
                    let (after, _) = moved.pixel_from_world(motion.transform_point3(point).into());
                    let apart = (0..2).map(|i| (before[i] - after[i]).abs()).fold(0.0, f32::max);
                    assert!(apart < 5e-3, "{which}: {before:?} {after:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_left_has_nothing_of_the_world_and_displaces_images_least() {
        let (rig, one) = (rig(), &rig()[..1]);
        assert_eq!(Gauge::of(one, CENTER).basis.len(), 6, "one camera has nothing else");
        let gauge = Gauge::of(&rig, CENTER);
        assert_eq!(gauge.basis.len(), 7);
        for (i, a) in gauge.basis.iter().enumerate() {
            for (j, b) in gauge.dual.iter().enumerate() {
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-6, "{i} {j}");
            }
        }
        let mut motions: Motions = (0..30).map(|i| 0.01 * f64::from(i * 7 % 11) - 0.05).collect();
        gauge.remove(&mut motions);
        assert!(gauge.dual.iter().all(|dual| dot(dual, &motions).abs() < 1e-9));
        // All cameras turned so that the scene seems to move along an axis: mostly a motion of the world.
        let mut turned: Motions = rig
            .iter()
            .flat_map(|camera| {
                let world = camera.camera_from_world.as_dmat4();
                let place = world.transform_point3(Vec3::from(CENTER).as_dvec3());
                let turn = 1e-3 * place.cross(DMat3::from_mat4(world) * DVec3::X) / place.length_squared();
                [turn.x, turn.y, turn.z, 0.0, 0.0, 0.0]
            })
            .collect();
        let size = |motions: &[f64]| {
            let by = |i: usize| std::array::from_fn(|k| motions[WIDTH * i + k] as f32);
            let seen = |i: usize| rig[i].displacement(&rig[i].seeing_moved(by(i)), 4.0).powi(2);
            (0..rig.len()).map(seen).sum::<f64>().sqrt()
        };
        let before = size(&turned);
        gauge.remove(&mut turned);
        assert!(size(&turned) < 0.4 * before, "{} {before}", size(&turned));
    }
}
