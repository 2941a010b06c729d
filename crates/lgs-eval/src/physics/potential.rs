//! The learned potential against the true one: −∇U against a uniform field, and the curvature of U against
//! ω².
//!
//! Both are taken over the states that moving Gaussians visit in the captured window, at α = β = γ = 1. What
//! acts besides the potential is not counted: a law that puts part of the acceleration into Q is off here
//! even if its motion is right; for harmonic laws `net_error` says so. The constants of the truth are
//! those of `scene.json`.

use glam::{DMat3, DVec3};
use lgs_core::geometry::{inverse, outer, scalar, trace, wide};
use lgs_model::{LagrangianScene, Motion, ObjectFields, ObjectModel};

use super::{Truth, most_common, window_steps};
use crate::finite::finite;
use crate::metrics::{ObjectPotential, PotentialAgainstTruth};

pub use super::true_force::TrueForce;
use crate::thresholds::{CURVATURE_RIDGE, STATE_STRIDE};

/// The true label of each object of a scene: that of most true points nearest to its Gaussians at t = 0;
/// nothing for an object that is static in truth.
#[must_use]
pub fn true_labels(scene: &LagrangianScene, truth: &Truth<'_>) -> Vec<Option<i32>> {
    let nearest = truth.matches(&scene.dynamic_gaussians.means);
    let label_of = |object: &ObjectModel| {
        let labels = nearest[object.members.clone()].iter().map(|&p| truth.object(p));
        most_common(labels).filter(|&label| label >= 0)
    };
    scene.objects.iter().map(label_of).collect()
}

/// The true conservative acceleration of every object of a scene, where `scene.json` tells.
#[must_use]
pub fn true_forces(scene: &LagrangianScene, truth: &Truth<'_>) -> Vec<Option<TrueForce>> {
    let labels = true_labels(scene, truth);
    labels.into_iter().map(|label| TrueForce::of_law(truth.law(label?)?)).collect()
}

/// All objects whose law has a potential, and the worst of each error; nothing if there is none.
#[must_use]
pub fn potential_against_truth(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
) -> Option<PotentialAgainstTruth> {
    let labels = true_labels(scene, truth);
    let forces = true_forces(scene, truth);
    let compared = forces.into_iter().zip(labels).enumerate();
    let objects: Vec<ObjectPotential> = compared
        .filter_map(|(index, (force, label))| {
            let is_joint = scene.objects[index].dynamics.generalised().is_some();
            // A joint turns without a force; only particles by themselves need one to stay on their circles.
            let force = force.filter(|force| !(is_joint && force.is_of_rotation()));
            Some(ObjectPotential { object: label?, ..against(&visited(motion, index), &force?) })
        })
        .collect();
    let worst = |pick: fn(&ObjectPotential) -> Option<f64>| {
        objects.iter().filter_map(pick).max_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    (!objects.is_empty()).then(|| PotentialAgainstTruth {
        magnitude_error: worst(|o| o.magnitude_error),
        direction_error_degrees: worst(|o| o.direction_error_degrees),
        curvature_error: worst(|o| o.curvature_error),
        objects: objects.clone(),
    })
}

/// Positions, −∇U and −∇U + Q of an object at the states that are measured.
struct Visited {
    positions: Vec<DVec3>,
    conservative: Vec<DVec3>,
    net: Vec<DVec3>,
}

fn against(visited: &Visited, force: &TrueForce) -> ObjectPotential {
    let mut found = ObjectPotential::default();
    match force {
        TrueForce::Uniform(g) => {
            let mean = mean_of(&visited.conservative);
            found.gradient = Some((-mean).to_array());
            found.magnitude_error = finite(mean.length() / g.length() - 1.0);
            found.direction_error_degrees = finite(angle(mean, *g));
        }
        TrueForce::Harmonic { curvature, directions, .. } => {
            let of = |accelerations: &[DVec3]| curvatures(&visited.positions, accelerations, directions);
            if let (Some(own), Some(net)) = (of(&visited.conservative), of(&visited.net)) {
                let mean = own.iter().sum::<f64>() / own.len() as f64;
                found.curvature = Some(mean);
                found.curvature_error = finite(mean / curvature - 1.0);
                found.net_error =
                    finite(net.iter().sum::<f64>() / net.len() as f64 / curvature - 1.0).map(f64::abs);
            }
        }
    }
    found
}

fn visited(motion: &mut Motion<'_>, object: usize) -> Visited {
    let mut all = Visited { positions: Vec::new(), conservative: Vec::new(), net: Vec::new() };
    let (steps, rows) =
        (window_steps(&motion.scene().motion), motion.scene().objects[object].members.clone());
    let is_body = motion.scene().objects[object].dynamics.generalised().is_some();
    // A body feels the potential at its centre, particles each at its own place.
    let seen = |vectors: Vec<DVec3>| if is_body { vec![mean_of(&vectors)] } else { vectors };
    let all_wide = |vectors: &[[f32; 3]]| vectors.iter().map(|&v| wide(v)).collect();
    for step in (0..=steps).step_by(STATE_STRIDE) {
        let ObjectFields { conservative, force, .. } = motion.fields(object, step);
        let net = conservative.iter().zip(&force).map(|(&a, &f)| wide(a) + wide(f)).collect();
        all.positions.extend(seen(all_wide(&motion.states(step)[step].q[rows.clone()])));
        all.conservative.extend(seen(all_wide(&conservative)));
        all.net.extend(seen(net));
    }
    all
}

/// Minus the slope of the accelerations over the positions (least squares over all three coordinates), along
/// each direction.
fn curvatures(positions: &[DVec3], accelerations: &[DVec3], directions: &[DVec3]) -> Option<Vec<f64>> {
    let (q0, a0) = (mean_of(positions), mean_of(accelerations));
    let (mut qq, mut aq) = (DMat3::ZERO, DMat3::ZERO);
    for (&q, &a) in positions.iter().zip(accelerations) {
        qq += outer(q - q0, q - q0);
        aq += outer(a - a0, q - q0);
    }
    let ridge = CURVATURE_RIDGE * trace(&qq) / 3.0;
    let slope = aq * inverse(&(qq + scalar(ridge)))?;
    let found: Vec<f64> = directions.iter().map(|&e| -e.dot(slope * e)).collect();
    (!found.is_empty() && found.iter().all(|v| v.is_finite())).then_some(found)
}

fn mean_of(vectors: &[DVec3]) -> DVec3 {
    vectors.iter().sum::<DVec3>() / vectors.len().max(1) as f64
}

/// Angle of two vectors in degrees, exact for small ones.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curvature_of_an_anisotropic_field_is_found_along_each_direction() {
        let positions: Vec<DVec3> = (0..50)
            .map(|i| f64::from(i) * 0.37)
            .map(|t| DVec3::new(t.cos() + 4.0, t.sin(), 0.3 * t.cos() * t.sin()))
            .collect();
        let accelerations: Vec<DVec3> =
            positions.iter().map(|q| DVec3::new(1.0 - 4.0 * q.x, -9.0 * q.y + 0.5, 2.0 * q.z)).collect();
        let found = curvatures(&positions, &accelerations, &[DVec3::X, DVec3::Y]).expect("regression");
        assert!((found[0] - 4.0).abs() < 1e-6 && (found[1] - 9.0).abs() < 1e-6, "{found:?}");
        let flat: Vec<DVec3> = positions.iter().map(|q| DVec3::new(q.x, q.y, 0.0)).collect();
        let found = curvatures(&flat, &accelerations, &[DVec3::Y]).expect("a flat motion");
        assert!((found[0] - 9.0).abs() < 1e-3, "{found:?}");
        assert_eq!(curvatures(&[DVec3::ZERO], &[DVec3::ZERO], &[DVec3::X]), None);
    }

    #[test]
    fn small_angles_are_exact() {
        assert!(
            (angle(DVec3::new(1e-5, 0.0, -1.0), 2.0 * DVec3::NEG_Z) - 1e-5_f64.to_degrees()).abs() < 1e-12
        );
        assert!((angle(DVec3::Z, DVec3::NEG_Z) - 180.0).abs() < 1e-9);
    }
}
