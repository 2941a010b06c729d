//! Typical length, speed and acceleration of an object's motion.

use super::paths::Paths;
use glam::DVec3;
use lgs_core::geometry::narrow;
use lgs_dynamics::Normalisation;

/// Scales of the motion of some particles over a window of some duration.
///
/// Lower bounds keep an object at rest from a division by zero: a length of 1e-6 world units, a thousandth of
/// the length per window, a hundredth of the speed per window.
pub(crate) fn scales(paths: &Paths, particles: &[usize], duration: f64) -> Normalisation {
    let visited = || particles.iter().flat_map(|&j| (0..paths.samples()).map(move |s| (j, s)));
    let rms = |value: &dyn Fn(usize, usize) -> DVec3| {
        let (sum, count) =
            visited().fold((0.0, 0), |(sum, count), (j, s)| (sum + value(j, s).length_squared(), count + 1));
        (sum / f64::from(count.max(1))).sqrt()
    };
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) =
        visited().map(|(j, s)| paths.position(j, s)).fold(start, |(low, high), p| (low.min(p), high.max(p)));
    let length = (0.5 * low.distance(high)).max(1e-6);
    let speed = rms(&|j, s| paths.velocity(j, s)).max(1e-3 * length / duration);
    let acceleration = rms(&|j, s| paths.acceleration(j, s)).max(1e-2 * speed / duration);
    Normalisation {
        center: narrow(0.5 * (low + high)),
        length: length as f32,
        speed: speed as f32,
        acceleration: acceleration as f32,
    }
}
