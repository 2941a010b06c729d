//! Shadows: objects that go on as the light of a sun or a lamp casts another object onto a plane (method
//! §5.10).

use glam::DVec3;
use lgs_dynamics::{Edit, State};
use serde::{Deserialize, Serialize};

use super::dynamics::{Dynamics, narrow, wide};
use super::motion::part_of;
use super::{LagrangianScene, ObjectModel};
use crate::thresholds::{BELOW_LAMP, END_OF_WINDOW};

/// How a light casts points onto a plane: from the foot of a point at height h above the plane, the shadow is
/// `x ↦ (x + h s) / (1 − h u)` from the plane's point nearest to the origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Projection {
    /// Unit normal of the plane, to the side of the light.
    pub normal: [f64; 3],
    /// Distance of the plane from the origin along its normal, world units.
    pub offset: f64,
    /// Way along the plane per height, s.
    pub slope: [f64; 3],
    /// One over the height of the light above the plane, u, 1 / world units; 0 for a sun.
    pub closeness: f64,
}

impl Projection {
    /// The height of a point above the plane, and the way from the plane's point nearest to the origin to its
    /// foot.
    fn foot(&self, point: DVec3) -> (f64, DVec3) {
        let normal = DVec3::from(self.normal);
        (point.dot(normal) - self.offset, point - point.dot(normal) * normal)
    }

    /// By how much the shadow is larger than what casts it at a height.
    fn scale(&self, height: f64) -> f64 {
        1.0 / (1.0 - height * self.closeness).max(BELOW_LAMP)
    }

    /// The shadow of a point.
    #[must_use]
    pub fn of(&self, point: DVec3) -> DVec3 {
        let (height, foot) = self.foot(point);
        self.offset * DVec3::from(self.normal)
            + self.scale(height) * (foot + height * DVec3::from(self.slope))
    }

    /// The velocity of the shadow of a point that moves.
    fn velocity(&self, point: DVec3, velocity: DVec3) -> DVec3 {
        let (normal, (height, foot)) = (DVec3::from(self.normal), self.foot(point));
        let (rising, slope) = (velocity.dot(normal), DVec3::from(self.slope));
        let along = velocity - rising * normal + rising * slope;
        let scale = self.scale(height);
        scale * along + scale * scale * self.closeness * rising * (foot + height * slope)
    }

    fn is_finite(&self) -> bool {
        let values = self.normal.iter().chain(&self.slope).chain([&self.offset, &self.closeness]);
        values.clone().all(|value| value.is_finite()) && self.closeness >= 0.0
    }
}

/// An object that is the shadow of another one. Inside of the captured window it moves as it was seen to;
/// before and after, and under edits, as the other one casts it, without turning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shadow {
    /// The object.
    pub object: usize,
    /// The one that casts it.
    pub caster: usize,
    /// How.
    pub projection: Projection,
    /// Mean positions of the caster's Gaussians at t = 0 and at the end of the captured window, world units.
    pub centers: [[f64; 3]; 2],
}

impl Shadow {
    /// What is wrong with it in a scene; nothing if it fits.
    pub(super) fn misfit(&self, scene: &LagrangianScene) -> Option<String> {
        let Self { object, caster, projection, centers } = self;
        let count = scene.objects.len();
        if object.max(caster) >= &count || object == caster || scene.caster_of(*caster).is_some() {
            return Some(format!("object {object} cast by object {caster} of {count}"));
        }
        let is_finite = projection.is_finite() && centers.as_flattened().iter().all(|c| c.is_finite());
        (!is_finite).then(|| format!("a value that is not finite: {projection:?}, {centers:?}"))
    }

    /// The shadow when its caster is in a state, from what it was with the caster's centre at a place.
    fn cast(&self, (from, before): (&State, [f64; 3]), caster: &State) -> State {
        let (projection, before) = (&self.projection, DVec3::from(before));
        let (there, size) = (projection.of(before), projection.scale(projection.foot(before).0));
        let (center, velocity) = (mean(&caster.q), mean(&caster.v));
        let (now, scale) = (projection.of(center), projection.scale(projection.foot(center).0) / size);
        let moved = |&q: &[f32; 3]| narrow(now + scale * (wide(q) - there));
        State {
            q: from.q.iter().map(moved).collect(),
            v: vec![narrow(projection.velocity(center, velocity)); from.q.len()],
            rotation: from.rotation.clone(),
        }
    }
}

impl LagrangianScene {
    /// The object whose shadow an object is, if it is one.
    #[must_use]
    pub fn caster_of(&self, object: usize) -> Option<usize> {
        self.shadows.iter().find(|shadow| shadow.object == object).map(|shadow| shadow.caster)
    }

    /// Puts shadows where their casters are, in states at some times under an edit of each object.
    pub(super) fn cast_shadows(&self, edits: &[Edit], times: &[f64], states: &mut [State]) {
        let window = f64::from(self.motion.time_window);
        for shadow in &self.shadows {
            let object = &self.objects[shadow.object];
            let rows = &object.members;
            let points = &self.dynamic_gaussians.means[rows.clone()];
            let start = State::at_start(points.to_vec(), vec![[0.0; 3]; points.len()]);
            let is_edited = [shadow.object, shadow.caster].iter().any(|&i| edits[i] != Edit::default());
            let end = object.seen_at(points, window).filter(|_| !is_edited);
            let [at_start, at_end] = shadow.centers;
            for (state, &time) in states.iter_mut().zip(times) {
                let from = match &end {
                    Some(_) if (0.0..=window + END_OF_WINDOW).contains(&time) => continue,
                    Some(end) if time > 0.0 => (end, at_end),
                    _ => (&start, at_start),
                };
                let cast = shadow.cast(from, &part_of(state, &self.objects[shadow.caster].members));
                state.q[rows.clone()].copy_from_slice(&cast.q);
                state.v[rows.clone()].copy_from_slice(&cast.v);
                state.rotation[rows.clone()].copy_from_slice(&cast.rotation);
            }
        }
    }
}

impl ObjectModel {
    /// The state of its particles, which are at `points` at t = 0, at a time of the captured window, where
    /// that is known without a rollout.
    fn seen_at(&self, points: &[[f32; 3]], time: f64) -> Option<State> {
        match (&self.recording, &self.dynamics) {
            (Some(recording), _) => recording.played(points, &[recording.end().min(time)]).pop(),
            (None, Dynamics::Generalised(law)) => {
                law.states(Edit::default(), &[time]).first().map(|state| law.placed(points, state))
            }
            (None, Dynamics::Particles(_)) => None,
        }
    }
}

fn mean(points: &[[f32; 3]]) -> DVec3 {
    points.iter().map(|&p| wide(p)).sum::<DVec3>() / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use lgs_dynamics::Reversal;

    use super::*;
    use crate::scene::contact_testing::row;
    use crate::scene::{Motion, Recording, scene_from_tensors, scene_to_tensors};

    /// A lamp or a sun above the plane z = −1.
    fn projection(closeness: f64) -> Projection {
        Projection { normal: [0.0, 0.0, 1.0], offset: -1.0, slope: [0.5, -0.2, 0.0], closeness }
    }

    /// A row of balls, the first of which moves by 1 along x and casts the last as its shadow, which was seen
    /// to move half as fast until t = 1.
    fn scene() -> LagrangianScene {
        let mut scene = row();
        scene.contact = None;
        scene.objects[0].dynamics = free(&scene);
        let times = vec![0.0, 0.5, 1.0];
        let positions = times.iter().map(|time| vec![[2.6 + 0.5 * time, 0.0, 0.0]]).collect();
        scene.objects[2].recording = Recording::new(times, positions, vec![vec![[1.0, 0.0, 0.0, 0.0]]; 3]);
        let centers = [[0.0; 3], [1.0, 0.0, 0.0]];
        scene.shadows = vec![Shadow { object: 2, caster: 0, projection: projection(0.0), centers }];
        scene
    }

    fn free(scene: &LagrangianScene) -> crate::scene::Dynamics {
        let mut dynamics = scene.objects[0].dynamics.generalised().expect("a law").clone();
        dynamics.law.impulses.clear();
        crate::scene::Dynamics::Generalised(dynamics)
    }

    fn place(edit: Edit, time: f32) -> f32 {
        Motion::new(&scene(), edit, Reversal::default()).state_at(time).q[2][0]
    }

    #[test]
    fn a_light_casts_a_point_along_its_ray() {
        let lamp = DVec3::new(3.0, -1.5, 4.0);
        let (height, foot) = (5.0, DVec3::new(3.0, -1.5, 0.0));
        let projection = Projection { slope: (-foot / height).into(), ..projection(1.0 / height) };
        let (point, velocity) = (DVec3::new(0.4, 0.7, 1.0), DVec3::new(0.3, -0.2, 0.8));
        let shadow = projection.of(point);
        let ray = (point - lamp).cross(shadow - lamp).length();
        assert!((shadow.z + 1.0).abs() < 1e-12 && ray < 1e-9, "{shadow}");
        let later = projection.of(point + 1e-6 * velocity);
        let rate = (later - shadow) / 1e-6;
        assert!(rate.distance(projection.velocity(point, velocity)) < 1e-4);
    }

    #[test]
    fn a_shadow_moves_as_seen_in_the_window_and_with_its_caster_outside_and_under_edits() {
        let none = Edit::default();
        let near = |a: f32, b: f32| (a - b).abs() < 1e-4;
        assert!(near(place(none, 0.5), 2.85), "as it was seen");
        assert!(near(place(none, 2.0), 4.1), "on from the end of that");
        assert!(near(place(none, -1.0), 1.6), "the past");
        let twice = Edit { velocity_scale: 2.0, ..none };
        assert!(near(place(twice, 0.5), 3.6) && near(place(twice, 2.0), 6.6));
    }

    #[test]
    fn shadows_are_kept_in_the_file_and_those_that_do_not_fit_are_refused() {
        let read = |scene: &LagrangianScene| {
            scene_from_tensors(&scene_to_tensors(scene, "test"), Path::new("scene"))
                .map(|scene| scene.shadows)
        };
        assert_eq!(read(&scene()).expect("a scene"), scene().shadows);
        for wrong in [(2, 2), (2, 3), (5, 0)] {
            let mut scene = scene();
            (scene.shadows[0].object, scene.shadows[0].caster) = wrong;
            assert!(read(&scene).expect_err("refused").to_string().contains("shadows"), "{wrong:?}");
        }
    }
}
