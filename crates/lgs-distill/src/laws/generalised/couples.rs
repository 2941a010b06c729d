//! Laws of two bodies that act on each other: a force between their centres, or joints that hold one of them
//! in the world and the other one on it (method §4.7).

use super::evidence::Evidence;
use super::geometry::{joint, pivot};
use super::kinematics::{Configured, POSE};
use super::observed::ObservedPoses;
use super::rated::Rated;
use super::turning::Turning;
use crate::thresholds::{MOST_KINEMATIC, PARALLEL_AXES};
use glam::DVec3;
use lgs_core::geometry::exp;
use lgs_mechanics::choose::{Choice, choose};
use lgs_mechanics::coordinates::{Coordinates, Port, Tree};
use lgs_mechanics::fit::Track;
use lgs_mechanics::noise::SampleTimes;
use rayon::prelude::*;

/// Two bodies at the same times.
type Two<'a> = [&'a ObservedPoses; 2];

/// Rates the laws of two bodies at the same times. `None` if their poses do not suit any, or the likeliest of
/// these laws lets them move by themselves.
pub(super) fn choose_couple(bodies: Two<'_>) -> Option<Rated> {
    let samples = bodies.iter().map(|body| body.track.independent_samples()).sum::<f64>();
    let values = bodies.iter().map(|body| 6 * body.times.len()).sum();
    let trees = [[0, 1], [1, 0]].into_iter().filter_map(|order| tree(bodies, order));
    let mut all: Vec<Configured> =
        trees.min_by(|a, b| a.chi_square.total_cmp(&b.chi_square)).into_iter().collect();
    all.push(pair(bodies));
    tracing::debug!(kinematic = ?all.iter().map(|s| s.chi_square / samples).collect::<Vec<_>>());
    all.retain(|system| system.chi_square <= MOST_KINEMATIC * samples);
    let with_laws = |system: Configured| {
        let track = track_of(bodies, &system);
        let list = bodies[0].laws.candidates(&system.coordinates);
        let choice = choose(&list, &track, &track.scales(&system.coordinates))?;
        Some((system, choice))
    };
    let found: Vec<(Configured, Choice)> = all.into_par_iter().filter_map(with_laws).collect();
    let rated = Rated::new(found, &|system, law| Evidence::of(system, law, (samples, values)))?;
    let terms = &rated.best().judged.fitted.law.terms;
    let act_on_each_other =
        rated.system().coordinates != Coordinates::Pair || terms.iter().any(|t| t.port == Port::Between);
    act_on_each_other.then(|| rated.with_geometry(&bodies))
}

/// The track of two bodies, no better known than their poses are.
fn track_of(bodies: Two<'_>, system: &Configured) -> Track {
    let deviation = |k: usize| bodies.iter().map(|body| body.samples().deviation(k)).fold(0.0, f64::max);
    let deviations: Vec<f64> = (0..bodies[0].times.len()).map(deviation).collect();
    let samples = SampleTimes { deviations: &deviations, ..bodies[0].samples() };
    let mut track = Track::new(&system.coordinates, samples, &system.x);
    if system.coordinates == Coordinates::Pair {
        track.noise = bodies.iter().flat_map(|body| body.track.noise[3..].iter().copied()).collect();
        return track;
    }
    let noise = track.noise.iter_mut().zip(&system.order);
    noise.for_each(|(noise, &body)| bodies[body].limit_angle(noise));
    track
}

/// Two bodies that do not turn.
fn pair(bodies: Two<'_>) -> Configured {
    let [a, b] = bodies.map(|body| &body.poses);
    let x = a.iter().zip(b).map(|(a, b)| [a.shift.to_array(), b.shift.to_array()].concat()).collect();
    // The centres at the start are among the unknowns of the motion.
    Configured::of_bodies((&bodies, &[0, 1]), Coordinates::Pair, x, 2 * (POSE - 3))
}

/// A body that turns about a hinge in the world, and one that turns about a parallel hinge on the first.
fn tree(bodies: Two<'_>, order: [usize; 2]) -> Option<Configured> {
    let axis = common_axis(bodies)?;
    let [first, second] = order.map(|body| &bodies[body].poses);
    let angles = [first, second].map(|poses| Turning::about(axis, poses).angles);
    let (pivot, _) = pivot(first)?;
    let (on_first, on_second) = joint(first, second)?;
    let samples = first.len() as f64;
    let turned_back = |body: usize, k: usize, v: DVec3| exp(axis * -angles[body][k]) * v;
    let link = (0..first.len()).map(|k| turned_back(0, k, first[k].apply(on_first) - pivot));
    let arm = (0..second.len()).map(|k| turned_back(1, k, -(second[k].linear * on_second)));
    let [link, arm] = [link.sum::<DVec3>() / samples, arm.sum::<DVec3>() / samples];
    let tree =
        Tree { axis: axis.to_array(), pivot: pivot.to_array(), link: link.to_array(), arm: arm.to_array() };
    let x = angles[0].iter().zip(&angles[1]).map(|(&a, &b)| vec![a, b]).collect();
    // Axis, pivot and link have two each; the poses along the angles are among the unknowns of the motion.
    Some(Configured::of_bodies((&bodies, &order), Coordinates::Tree(tree), x, 6 + 2 * (POSE - 1)))
}

/// The axis that both bodies turn about, if there is one: the mean of their own, each by the square of what
/// its body turns.
fn common_axis(bodies: Two<'_>) -> Option<DVec3> {
    let [first, second] = bodies.map(|body| Turning::about_one_axis(&body.poses));
    let (first, second) = (first?, second?);
    let side = first.axis.dot(second.axis);
    let axis = (first.axis * first.mean_square() + second.axis * (second.mean_square() * side.signum()))
        .try_normalize()?;
    (side.abs() >= PARALLEL_AXES).then_some(axis)
}
