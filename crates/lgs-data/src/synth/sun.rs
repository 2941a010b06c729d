//! A sun that stands still in the world: surfaces are lit by where they face, and bodies cast shadows on
//! themselves, on each other and on what stands still.

use super::body::{Hit, Meeting, Snapshot, Stage, meet_fixed};
use super::shape::Ray;
use glam::DVec3;

/// Towards the sun, world axes.
const SUN: DVec3 = DVec3::new(0.48, 0.36, 0.80);
/// Light from everywhere, which shadows keep, and that of the sun on a surface that faces it.
const LIGHTS: [f64; 2] = [0.45, 0.55];
/// Shadow rays start this far from the surface, world units, so that it does not meet itself.
const LIFT: f64 = 1e-6;

/// The surface of a meeting of a ray with what is in a stage at a time, under the sun.
pub(super) fn lit(stage: &Stage, snapshot: &Snapshot<'_>, ray: &Ray, meeting: &Meeting<'_>) -> Hit {
    meeting.lit(|normal| {
        let normal = meeting.body().map_or(normal, |body| snapshot.normal(body, normal));
        let facing = normal.dot(SUN);
        if facing <= 0.0 {
            return LIGHTS[0];
        }
        let origin = ray.origin + meeting.distance * ray.direction + LIFT * normal;
        let to_sun = Ray { origin, direction: SUN };
        let is_shaded = snapshot.meet(&to_sun).is_some() || meet_fixed(stage, &to_sun).is_some();
        if is_shaded { LIGHTS[0] } else { LIGHTS[0] + LIGHTS[1] * facing }
    })
}
