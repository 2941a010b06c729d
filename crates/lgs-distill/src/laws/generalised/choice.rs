//! The choice of coordinates and terms for the motion of a rigid body, by one evidence for all of them: χ² of
//! the poses, whitened, and the Bayesian penalty of all unknowns, those of the joints included (method §5.4).

use super::evidence::Evidence;
use super::kinematics::{Configured, free_systems, rigid, systems};
use super::observed::ObservedPoses;
use super::rated::Rated;
use super::rigid_law::combined;
use crate::motion::pose::Pose;
use crate::thresholds::MOST_KINEMATIC;
use glam::DVec3;
use lgs_mechanics::choose::{Choice, Judged};
use lgs_mechanics::coordinates::{Ball, Coordinates, Inertia, Port, State};
use lgs_mechanics::fit::{Fitted, Track};
use lgs_mechanics::terms::Scales;
use lgs_mechanics::{Candidate, Edit, System};
use rayon::prelude::*;

/// Rates the laws of one body in all systems of coordinates; `None` if no law can be fitted.
pub(super) fn choose_law(observed: &ObservedPoses) -> Option<Rated> {
    let of_system = |system: Configured| {
        let choice = choose_of_system(&system, observed)?;
        Some((system, choice))
    };
    let samples = observed.track.independent_samples();
    let explains = |(system, choice): &(Configured, Choice)| {
        choice.law().fitted.loss + system.chi_square <= observed.explained()
    };
    let mut found: Vec<(Configured, Choice)> = Vec::new();
    let joints = systems(observed).into_iter().filter(|system| system.chi_square <= MOST_KINEMATIC * samples);
    // More freedoms than explain the motion to within the scatter of χ² are not needed. Inertias about one
    // pivot have the same, and which of them it is matters to forecasts.
    let mut kind = None;
    for system in joints {
        let own = Some(std::mem::discriminant(&system.coordinates));
        if kind != own && found.iter().any(explains) {
            break;
        }
        kind = own;
        found.extend(of_system(system));
    }
    if !found.iter().any(explains) {
        let of_point = found.iter().find(|(system, _)| system.coordinates == Coordinates::Point);
        let free = choose_free(observed, of_point.map(|(_, choice)| choice));
        found.extend(free);
    }
    let size = (samples, 6 * observed.times.len());
    let evidence = |system: &Configured, law: &Judged| {
        // The surface that friction needs is there to be seen, which speaks for it as one unknown less would.
        let rubs = law.fitted.law.terms.iter().any(|term| term.kind.name() == "dry-friction");
        let known = if observed.slides && rubs { law.fitted.law.assumed_unknowns().max(1) } else { 0 };
        Evidence::of(system, law, size).with_known(known, size.1)
    };
    let rated = Rated::new(found, &evidence)?;
    Some(rated.with_geometry(&[observed]))
}

/// The laws in a system of coordinates of a point or of a joint.
fn choose_of_system(system: &Configured, observed: &ObservedPoses) -> Option<Choice> {
    match &system.coordinates {
        Coordinates::Point => {
            let track = center_track(observed, system, 0);
            let choice = observed.choose_in(&Coordinates::Point, &track);
            observed.choose_further(choice, (&Coordinates::Point, &track), system.chi_square)
        }
        Coordinates::Ball(ball) => choose_about_pivot(observed, &system.x, ball),
        _ => choose_along_joint(system, observed),
    }
}

/// The laws of a free body: those of each of its centres with those of its rotation, of which there is one
/// for each inertia. Those of the first centre are the ones of a point, where these are known.
fn choose_free(observed: &ObservedPoses, of_point: Option<&Choice>) -> Vec<(Configured, Choice)> {
    let mut systems = free_systems(observed);
    let centers = systems.first().map_or(&[][..], Vec::as_slice);
    let chosen =
        |system: &Configured| observed.choose_in(&Coordinates::Point, &center_track(observed, system, 4));
    let of_center = |(index, system): (usize, &Configured)| match of_point {
        Some(choice) if index == 0 => Some(choice.clone()),
        _ => chosen(system),
    };
    let mut of_centers: Vec<Option<Choice>> = centers.par_iter().enumerate().map(of_center).collect();
    let own = of_centers.first().and_then(Option::as_ref).and_then(|choice| center_about(observed, choice));
    if let Some(center) = own {
        systems.iter_mut().for_each(|of_inertia| {
            let Coordinates::Rigid(inertia) = of_inertia[0].coordinates else { return };
            of_inertia.push(rigid(observed, &inertia, Some(center)));
        });
        of_centers.extend(systems.first().and_then(|all| all.last()).map(chosen));
    }
    let centers = systems.first().map_or(&[][..], Vec::as_slice);
    further_of_best(observed, centers, &mut of_centers);
    let of_inertia = |systems: Vec<Configured>| {
        let Coordinates::Rigid(inertia) = systems[0].coordinates else { return Vec::new() };
        let of_spin = choose_spin(observed, &systems[0].x, inertia);
        let together = |(system, of_center): (Configured, &Option<Choice>)| {
            let choice = combined(of_center.as_ref()?, of_spin.as_ref()?, &inertia)?;
            Some((system, choice))
        };
        systems.into_iter().zip(&of_centers).filter_map(together).collect()
    };
    systems.into_par_iter().flat_map_iter(of_inertia).collect()
}

/// The point of a turning body about which the centre of its particles circles while it follows the likeliest
/// law of its motion: `c_k + R_k r` on the path of the law. `None` if it is none but the centre itself.
fn center_about(observed: &ObservedPoses, of_particles: &Choice) -> Option<DVec3> {
    let Fitted { law, start, .. } = &of_particles.law().fitted;
    let path = System::new(law, Edit::NONE).states(start, &observed.times).ok()?;
    let pairs = observed.poses.iter().zip(&path);
    let in_body =
        |(pose, state): (&Pose, &State)| pose.linear.transpose() * (DVec3::from_slice(&state.x) - pose.shift);
    let center = pairs.map(in_body).sum::<DVec3>() / observed.poses.len() as f64;
    (center.length() > observed.noise_of_place()).then_some(center)
}

/// Seeks further laws of the centre whose motion the simple ones describe best.
fn further_of_best(observed: &ObservedPoses, centers: &[Configured], of_centers: &mut [Option<Choice>]) {
    let loss = |choice: &Option<Choice>| {
        let losses = choice.iter().flat_map(|choice| &choice.judged).map(|judged| judged.fitted.loss);
        losses.fold(f64::INFINITY, f64::min)
    };
    let best = (0..of_centers.len()).min_by(|&a, &b| loss(&of_centers[a]).total_cmp(&loss(&of_centers[b])));
    let Some((own, system)) = best.map(|best| (&mut of_centers[best], &centers[best])) else { return };
    let track = center_track(observed, system, 4);
    *own = observed.choose_further(own.take(), (&Coordinates::Point, &track), 0.0);
}

/// The motion of the centre, as that of a point, which begins at a place in each configuration.
fn center_track(observed: &ObservedPoses, system: &Configured, at: usize) -> Track {
    let x: Vec<Vec<f64>> = system.x.iter().map(|x| x[at..].to_vec()).collect();
    let noise = observed.track.noise[3..].to_vec();
    Track { noise, ..Track::new(&Coordinates::Point, observed.samples(), &x) }
}

/// The rotation of a free body: that about a pivot at its centre, on which no weight acts.
fn choose_spin(observed: &ObservedPoses, x: &[Vec<f64>], inertia: Inertia) -> Option<Choice> {
    choose_about_pivot(observed, x, &Ball { pivot: [0.0; 3], arm: [0.0; 3], inertia })
}

fn choose_about_pivot(observed: &ObservedPoses, x: &[Vec<f64>], ball: &Ball) -> Option<Choice> {
    let coordinates = Coordinates::Ball(*ball);
    let x: Vec<Vec<f64>> = x.iter().map(|x| x[..4].to_vec()).collect();
    let noise = observed.track.noise[..3].to_vec();
    let track = Track { noise, ..Track::new(&coordinates, observed.samples(), &x) };
    let arm = ball.arm.iter().map(|a| a * a).sum::<f64>().sqrt();
    let has_arm = arm > 0.0;
    let is_own = |c: &Candidate| c.coordinates == coordinates && has_arm == acts_on(c, Port::Arm);
    let list: Vec<Candidate> =
        observed.laws.candidates(&coordinates).into_iter().filter(|c| is_own(c)).collect();
    let length = if has_arm { arm } else { 1.0 };
    let time = observed.times[observed.times.len() - 1];
    observed.choose(&list, &track, &Scales { length, time, origin: ball.pivot, ..Scales::UNIT })
}

/// Laws along a joint. A body that is balanced on its hinge has no weight to turn it, if a law without weight
/// explains how it turns and is as simple as the likeliest.
fn choose_along_joint(system: &Configured, observed: &ObservedPoses) -> Option<Choice> {
    let joint = &system.coordinates;
    let track = observed.along(joint, Track::new(joint, observed.samples(), &system.x));
    let choice = observed.choose_in(joint, &track);
    let mut choice = observed.choose_further(choice, (joint, &track), system.chi_square)?;
    let is_balanced = matches!(joint, Coordinates::Hinge(hinge) if observed.is_balanced_on(hinge));
    let is_weightless =
        |judged: &Judged| judged.fitted.law.terms.iter().all(|term| !term.kind.name().starts_with("fourier"));
    let most = choice.law().simplicity;
    let will_do =
        |judged: &&Judged| is_weightless(judged) && judged.simplicity <= most && choice.explains(judged);
    if is_balanced && choice.judged.iter().any(|judged| will_do(&judged)) {
        choice.judged.retain(is_weightless);
    }
    Some(choice)
}

fn acts_on(candidate: &Candidate, port: Port) -> bool {
    candidate.terms.iter().any(|term| term.port == port)
}
