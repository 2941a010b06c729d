//! Contact between the objects of a trained scene, from the hits that their laws have.

use std::borrow::Cow;

use glam::{DMat3, DVec3};
use lgs_core::geometry::{quaternion, wide};
use lgs_data::dataset::Frame;
use lgs_mechanics::Law;
use lgs_mechanics::contact::Origin;
use lgs_mechanics::mutual_contact::{SeenBody, SeenContact, SurfaceGaussian, mutual_contact};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectContact};

/// The scene with the contact of those of its objects that hit each other in the captured window. Where hits
/// as a contact has them do not follow the laws through the window, objects keep the impulses that they were
/// seen to get, and pass through each other otherwise.
pub(crate) fn with_contact(mut scene: LagrangianScene, frames: &[Frame]) -> LagrangianScene {
    let found = contact_of(&scene, interval(&scene, frames));
    if let Some(ObjectContact { objects, .. }) = &found {
        let window = f64::from(scene.motion.time_window);
        for &object in objects {
            let Dynamics::Generalised(dynamics) = &mut scene.objects[object].dynamics else { continue };
            if let Some(Cow::Owned(law)) = law_by_impulses(dynamics, window) {
                dynamics.law = law;
            }
        }
    }
    LagrangianScene { contact: found, ..scene }
}

/// Time between two of the captured times.
fn interval(scene: &LagrangianScene, frames: &[Frame]) -> f64 {
    let mut times: Vec<f32> = frames.iter().map(|frame| frame.time).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    let steps = times.len().saturating_sub(1).max(1);
    f64::from((scene.motion.time_window / steps as f32).max(scene.motion.dt))
}

/// The law of a single body without planes, with the impulses that it gets in a window. A plane that nothing at
/// rest shows may be another body: its impacts are impulses then.
fn law_by_impulses(dynamics: &GeneralisedDynamics, window: f64) -> Option<Cow<'_, Law>> {
    let GeneralisedDynamics { law, .. } = dynamics;
    match &law.contact {
        _ if law.coordinates.bodies() != 1 => None,
        None => Some(Cow::Borrowed(law)),
        Some(contact) if contact.origin == Origin::Fitted && contact.walls.is_empty() => {
            let GeneralisedDynamics { law, .. } = dynamics.clone().with_impacts(window);
            Some(Cow::Owned(Law { contact: None, ..law }))
        }
        Some(_) => None,
    }
}

fn contact_of(scene: &LagrangianScene, interval: f64) -> Option<ObjectContact> {
    let window = f64::from(scene.motion.time_window);
    let able = scene.objects.iter().enumerate().filter(|(_, object)| object.recording.is_none());
    let able: Vec<(usize, &GeneralisedDynamics, Cow<'_, Law>)> = able
        .filter_map(|(index, object)| {
            let dynamics = object.dynamics.generalised()?;
            Some((index, dynamics, law_by_impulses(dynamics, window)?))
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
        matches!(law, Cow::Borrowed(_)) || round.hits.len() == law.events.len()
    });
    (found.follows_laws() && all_are_hits).then(|| ObjectContact {
        objects: found.bodies.iter().map(|&body| able[body].0).collect(),
        contact: found.contact,
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
    let SeenContact { bodies, contact, error } = found;
    let (count, percent) = (bodies.len(), 100.0 * error);
    if found.follows_laws() {
        let [deviation, _] = contact.deviations;
        tracing::info!(
            "{count} objects hit each other: restitution {:.2} ± {deviation:.2}, friction {:.2}; by these their \
             places in the window are within {percent:.1} % of the path",
            contact.restitution,
            contact.friction
        );
    } else {
        tracing::warn!(
            "{count} objects hit each other, but not as balls do ({percent:.0} % of the path off): each keeps \
             its impulses, whatever the edit"
        );
    }
}
