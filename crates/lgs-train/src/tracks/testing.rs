//! A scene of something that is thrown and caught, for tests.

use lgs_core::linear::{dot, norm, scale, sub};
use lgs_core::{Camera, Exposure};
use lgs_data::dataset::Frame;

/// Radius of what is thrown, world units.
pub(crate) const RADIUS: f32 = 0.15;
/// Moments that are seen, thirty to a unit of time.
pub(crate) const MOMENTS: usize = 24;
const SIZE: u32 = 96;

/// A sphere of one colour.
pub(crate) struct Sphere {
    pub(crate) center: [f32; 3],
    radius: f32,
    color: [u8; 3],
}

/// Two large things that sway, and a small one of another colour that the first holds until the sixth moment
/// and the second catches at the sixteenth, the first of the spheres; `step` is its way from moment to
/// moment.
pub(crate) fn thrown(step: f32) -> impl Fn(usize) -> Vec<Sphere> {
    move |moment| {
        let sway = 0.08 * (moment as f32 * 0.7).sin();
        let flown = (moment as f32).clamp(6.0, 16.0) - 6.0;
        let height = 0.3 + 0.05 * flown * (10.0 - flown) * step;
        let ball =
            [-5.0 * step + step * flown, 0.0, height + if flown > 0.0 && flown < 10.0 { 0.0 } else { sway }];
        let person = |side: f32| Sphere {
            center: [side * (5.0 * step + 0.45), sway, 0.1 + sway],
            radius: 0.5,
            color: [60, 70, 80],
        };
        vec![Sphere { center: ball, radius: RADIUS, color: [200, 50, 30] }, person(-1.0), person(1.0)]
    }
}

/// What twelve cameras see of spheres in front of white at every moment, together.
pub(crate) fn seen(spheres: impl Fn(usize) -> Vec<Sphere>) -> Vec<Frame> {
    let frame = |index: usize| {
        let (moment, camera_id) = (index / 12, index % 12);
        let angle = std::f32::consts::TAU * camera_id as f32 / 12.0;
        let height = if camera_id.is_multiple_of(2) { 1.0 } else { 2.5 };
        let camera =
            Camera::look_at([4.0 * angle.cos(), 4.0 * angle.sin(), height], [0.0; 3], 1.0, SIZE, SIZE);
        let spheres = spheres(moment);
        let pixel = |p: usize| {
            let at = [(p as u32 % SIZE) as f32 + 0.5, (p as u32 / SIZE) as f32 + 0.5];
            let ray = camera.ray_direction_in_world(at);
            let depth = |sphere: &Sphere| {
                let from_eye = sub(sphere.center, camera.center_in_world());
                let along = dot(from_eye, ray);
                (norm(sub(from_eye, scale(ray, along))) < sphere.radius).then_some(along)
            };
            let hits = spheres.iter().filter_map(|sphere| Some((depth(sphere)?, sphere.color)));
            let [r, g, b] = hits.min_by(|a, b| a.0.total_cmp(&b.0)).map_or([250; 3], |hit| hit.1);
            [r, g, b, 255]
        };
        let rgba: Vec<u8> = (0..camera.pixels()).flat_map(pixel).collect();
        let (name, exposure) = (format!("{index}"), Exposure::IDENTITY);
        Frame { name, camera_id, camera, time: moment as f32 / 30.0, exposure, pixels: rgba.into() }
    };
    (0..12 * MOMENTS).map(frame).collect()
}
