//! Contact between the objects of a trained scene, from the hits that their laws have.

use std::borrow::Cow;

use glam::{DMat3, DVec3};
use lgs_core::geometry::{quaternion, wide};
use lgs_data::dataset::Frame;
use lgs_mechanics::bands::{DrawnLaws, StartedLaw};
use lgs_mechanics::contact::{Origin, noticeable};
use lgs_mechanics::coordinates::State;
use lgs_mechanics::mutual_contact::{SeenBody, SeenContact, SurfaceGaussian, mutual_contact};
use lgs_mechanics::{Edit, Law, System};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectContact};

/// The scene with the contact of those of its objects that hit each other in the captured window. Where hits
/// as a contact has them do not follow the laws through the window, objects keep the impulses that they were
/// seen to get, and pass through each other otherwise.
pub(crate) fn with_contact(mut scene: LagrangianScene, frames: &[Frame]) -> LagrangianScene {
    let found = contact_of(&scene, interval(&scene, frames));
    if let Some(ObjectContact { objects, .. }) = &found {
        let window = f64::from(scene.motion.time_window);
        for &object in objects {
            if let Dynamics::Generalised(dynamics) = &mut scene.objects[object].dynamics {
                take_impulses(dynamics, window);
            }
        }
    }
    LagrangianScene { contact: found, ..scene }.with_bands_of_hits()
}

/// Takes impulses in the place of a plane that may be another body; so do the laws that are drawn from what
/// is known of the motion, but those that meet the plane more or less often.
fn take_impulses(dynamics: &mut GeneralisedDynamics, window: f64) {
    let Some(Cow::Owned(law)) = law_by_impulses((&dynamics.law, &dynamics.start), window) else { return };
    let count = law.impulses.len();
    let by_impulses = |StartedLaw { law, start }: &StartedLaw| {
        let law = law_by_impulses((law, start), window)?.into_owned();
        (law.impulses.len() == count).then(|| StartedLaw { law, start: start.clone() })
    };
    dynamics.law = law;
    if let Some(mut posterior) = dynamics.known.posterior.take() {
        let of_each = |laws: DrawnLaws| {
            let drawn = laws.drawn.iter().filter_map(by_impulses).collect();
            Some(DrawnLaws { middle: by_impulses(&laws.middle)?, drawn, ..laws })
        };
        posterior.laws = posterior.laws.into_iter().filter_map(of_each).collect();
        dynamics.known.posterior = (!posterior.laws.is_empty()).then_some(posterior);
    }
}

/// Time between two of the captured times.
fn interval(scene: &LagrangianScene, frames: &[Frame]) -> f64 {
    let mut times: Vec<f32> = frames.iter().map(|frame| frame.time).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    let steps = times.len().saturating_sub(1).max(1);
    f64::from((scene.motion.time_window / steps as f32).max(scene.motion.dt))
}

/// The law of a single body with the impulses that it gets in a window. A plane that nothing at rest shows
/// may be another body: its impacts are impulses then.
fn law_by_impulses<'a>((law, start): (&'a Law, &State), window: f64) -> Option<Cow<'a, Law>> {
    match &law.contact {
        _ if law.coordinates.bodies() != 1 => None,
        Some(contact)
            if contact.origin == Origin::Fitted && contact.walls.is_empty() && law.impulses.is_empty() =>
        {
            let met = System::new(law, Edit::NONE).impacts(start, window).unwrap_or_default();
            let impulses = noticeable(&met).cloned().collect();
            Some(Cow::Owned(Law { contact: None, impacts: Vec::new(), impulses, ..law.clone() }))
        }
        _ => Some(Cow::Borrowed(law)),
    }
}

fn contact_of(scene: &LagrangianScene, interval: f64) -> Option<ObjectContact> {
    let window = f64::from(scene.motion.time_window);
    let able = scene.objects.iter().enumerate().filter(|(_, object)| object.recording.is_none());
    let able: Vec<(usize, &GeneralisedDynamics, Cow<'_, Law>)> = able
        .filter_map(|(index, object)| {
            let dynamics = object.dynamics.generalised()?;
            Some((index, dynamics, law_by_impulses((&dynamics.law, &dynamics.start), window)?))
        })
        .collect();
    let surfaces: Vec<Vec<SurfaceGaussian>> =
        able.iter().map(|(object, ..)| surface(scene, *object)).collect();
    let bodies: Vec<SeenBody<'_>> = able
        .iter()
        .zip(&surfaces)
        .map(|((_, dynamics, law), gaussians)| SeenBody { law, start: &dynamics.start, gaussians })
        .collect();
    let found = mutual_contact(&bodies, window, interval)?;
    told(&found);
    let all_are_hits = found.bodies.iter().zip(&found.contact.bodies).all(|(&body, round)| {
        let law = &able[body].2;
        matches!(law, Cow::Borrowed(_)) || round.hits.len() == law.impulses.len()
    });
    (found.follows_laws() && all_are_hits).then(|| ObjectContact {
        objects: found.bodies.iter().map(|&body| able[body].0).collect(),
        contact: found.contact,
        drawn: found.drawn,
        replays_window: true,
    })
}

/// The opaque Gaussians of an object.
fn surface(scene: &LagrangianScene, object: usize) -> Vec<SurfaceGaussian> {
    let cloud = &scene.dynamic_gaussians;
    let gaussian = |row: usize| {
        let axes = DMat3::from_quat(quaternion(&cloud.rotations[row].map(f64::from)).normalize());
        let variances = DVec3::from(cloud.log_scales[row].map(|log| f64::from(2.0 * log).exp()));
        let covariance = axes * DMat3::from_diagonal(variances) * axes.transpose();
        SurfaceGaussian { mean: wide(cloud.means[row]), covariance }
    };
    let is_opaque = |row: &usize| cloud.raw_opacities[*row] > 0.0;
    scene.objects[object].members.clone().filter(is_opaque).map(gaussian).collect()
}

fn told(found: &SeenContact) {
    tracing::debug!(?found, "objects that hit each other");
    let SeenContact { bodies, contact, error, .. } = found;
    let (count, percent) = (bodies.len(), 100.0 * error);
    if found.follows_laws() {
        let [deviation, _] = contact.deviations;
        tracing::info!(
            "{count} objects hit each other: restitution {:.2} ± {deviation:.2}, friction {:.2}; places in \
             the window come out to {percent:.1} % of the path",
            contact.restitution,
            contact.friction
        );
    } else {
        tracing::warn!(
            "{count} objects hit each other, but not as balls do ({percent:.0} % of the path off): each \
             keeps its impulses, whatever the edit"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::GaussianCloud;
    use lgs_mechanics::bands::Known;
    use lgs_mechanics::contact::{Contact, Impact, Plane, Surface};
    use lgs_mechanics::coordinates::{Bodies, Coordinates};
    use lgs_model::{MotionConfig, ObjectModel};

    /// Gaussians of a ball of radius 0.3.
    fn ball(x: f64) -> Vec<[f32; 3]> {
        let point = |k: usize| {
            let (z, turn) = (1.0 - (2 * k + 1) as f64 / 80.0, 2.4 * k as f64);
            let across = f64::sqrt(1.0 - z * z);
            (DVec3::X * x + 0.3 * DVec3::new(across * turn.cos(), across * turn.sin(), z))
                .as_vec3()
                .to_array()
        };
        (0..80).map(point).collect()
    }

    /// A ball that hits another one of the same mass at t = 0.4, and keeps a tenth of its velocity.
    fn scene() -> LagrangianScene {
        let means: Vec<[f32; 3]> = [0.0, 1.0].into_iter().flat_map(ball).collect();
        let object = |body: usize| {
            let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("a law");
            let change = [-0.9, 0.9][body];
            let impulses = vec![Impact { time: 0.4, change: vec![change, 0.0, 0.0] }];
            let start = State { x: vec![body as f64, 0.0, 0.0], v: vec![1.0 - body as f64, 0.0, 0.0] };
            let (law, bodies, known) = (Law { impulses, ..law }, Bodies::default(), Known::default());
            let dynamics = Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known });
            ObjectModel { members: 80 * body..80 * (body + 1), dynamics, recording: None }
        };
        LagrangianScene {
            velocities: vec![[0.0; 3]; means.len()],
            dynamic_gaussians: GaussianCloud::isotropic(means, 1e-3, [0.5; 3], 0.9),
            objects: vec![object(0), object(1)],
            ..LagrangianScene::still(
                GaussianCloud::default(),
                MotionConfig { dt: 0.05, time_window: 1.0 },
                [1.0; 3],
            )
        }
    }

    fn law_mut(scene: &mut LagrangianScene, object: usize) -> &mut Law {
        match &mut scene.objects[object].dynamics {
            Dynamics::Generalised(dynamics) => &mut dynamics.law,
            Dynamics::Particles(_) => panic!("a law"),
        }
    }

    #[test]
    fn balls_that_were_seen_to_hit_each_other_have_a_contact() {
        let ObjectContact { objects, contact, .. } = with_contact(scene(), &[]).contact.expect("a contact");
        assert_eq!(objects, [0, 1]);
        assert!((contact.restitution - 0.8).abs() < 0.02, "{contact:?}");
        assert!((contact.bodies[1].mass - 1.0).abs() < 0.02 && contact.bodies[1].hits == [0], "{contact:?}");
        let mut apart = scene();
        law_mut(&mut apart, 1).impulses[0].time = 0.7;
        assert!(with_contact(apart, &[]).contact.is_none());
    }

    #[test]
    fn another_ball_takes_the_place_of_a_plane_that_nothing_shows() {
        let mut scene = scene();
        let surface = Surface { points: vec![[0.0; 3]], radius: 0.3 };
        let plane = Plane { normal: [-1.0, 0.0, 0.0], offset: -0.7 };
        let contact =
            Contact { restitution: 0.0, origin: Origin::Fitted, ..Contact::of(plane, &surface, 1e-3) };
        let law = law_mut(&mut scene, 0);
        (law.contact, law.impulses) = (Some(contact.clone()), Vec::new());
        law_mut(&mut scene, 1).impulses[0].change[0] = 1.0;
        let mut given = scene.clone();
        law_mut(&mut given, 0).contact = Some(Contact { origin: Origin::Given, ..contact });
        let found = with_contact(scene, &[]);
        assert!(found.contact.is_some());
        let law = found.law_of_body(0).map(|dynamics| &dynamics.law).expect("a law without a plane");
        assert!(law.impulses.len() == 1 && (law.impulses[0].time - 0.4).abs() < 1e-6, "{law:?}");
        assert!(with_contact(given, &[]).contact.is_none(), "a plane that is there stays");
    }
}
