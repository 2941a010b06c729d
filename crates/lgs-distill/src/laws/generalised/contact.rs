//! Contacts of rigid bodies (method §5.7): laws through the impacts of a track, and planes at rest that a
//! body has not met yet.

use super::evidence::penalty;
use super::geometry::center_of_mass;
use super::observed::{ObservedPoses, mean_pose};
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{
    CENTER_COEFFICIENTS, EXPECTED_TIMES, JUDGED_WINDOWS, LIGHTEST, MOST_WALLS_AHEAD, NEAR, NEAR_PATH, STILL,
    WITHIN_REACH,
};
use glam::{DMat3, DVec3};
use lgs_core::geometry::quaternion;
use lgs_mechanics::choose::DESCRIBED;
use lgs_mechanics::collisions::{Body, Bounced, Observed, explain};
use lgs_mechanics::contact::{Contact, Ground, Surface, planes};
use lgs_mechanics::coordinates::{Ball, Coordinates, Port, State};
use lgs_mechanics::fit::Fitted;
use lgs_mechanics::{Candidate, Edit, System};
use std::f64::consts::{PI, TAU};

/// What is around a body.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surroundings<'a> {
    /// Places of points at rest.
    pub(crate) at_rest: &'a [[f64; 3]],
    /// Times at which other bodies are struck that this one touches then, in the clock of its motion.
    pub(crate) hits: &'a [f64],
}

/// A law through impacts about a centre of mass.
pub(super) struct Impacted {
    pub(super) bounced: Bounced,
    /// The centre of mass in shape axes.
    middle: DVec3,
}

/// The likeliest law through the impacts of a body's track; `None` where there is no impact or no such law.
/// Errors of a size (world units) that change slowly are allowed for where there is no law without.
/// The centre of mass is that of a ball, else that of the particles, or the point that flies along a parabola
/// where the flight says so.
pub(super) fn through_impacts(
    observed: &ObservedPoses,
    motion: &SharedMotion,
    surroundings: Surroundings<'_>,
    slow_error: f64,
) -> Option<Impacted> {
    let within = |slow: f64| within((observed, observed.least(slow)), motion, surroundings);
    within(0.0).or_else(|| if slow_error > 0.0 { within(slow_error) } else { None })
}

/// The same for poses that are known no better than by some standard deviations.
fn within(
    (observed, least): (&ObservedPoses, [f64; 2]),
    motion: &SharedMotion,
    surroundings: Surroundings<'_>,
) -> Option<Impacted> {
    let first = &observed.poses[0];
    let whole = surface(motion, first, &first.shift.to_array());
    let ball = (whole.radius > 0.0).then(|| first.linear.transpose() * DVec3::from(whole.points[0]));
    let about = |center: DVec3| about(center, (observed, least), motion, surroundings);
    let found = about(ball.unwrap_or_default())?;
    if ball.is_some() || found.bounced.chi_square <= DESCRIBED {
        return Some(found);
    }
    let flight = found.bounced.free.clone();
    let center =
        center_of_mass(&observed.poses[flight.clone()], &observed.times[flight], CENTER_COEFFICIENTS[1]);
    let other = center.and_then(about);
    let more = penalty(3.0, 6 * observed.times.len());
    Some(other.filter(|other| other.bounced.evidence() + more < found.bounced.evidence()).unwrap_or(found))
}

/// The same for a body with its centre of mass at a point of the shape.
fn about(
    middle: DVec3,
    (observed, least): (&ObservedPoses, [f64; 2]),
    motion: &SharedMotion,
    surroundings: Surroundings<'_>,
) -> Option<Impacted> {
    let turns = observed.turns(STILL);
    let coordinates = if turns { Coordinates::Rigid(observed.inertia) } else { Coordinates::Point };
    let x = configurations(observed, &observed.poses, (&coordinates, middle));
    let surface = surface(motion, &observed.poses[0], &x[0]);
    let centers: Vec<DVec3> = x.iter().map(|x| center(x)).collect();
    let spins = if turns { spins(observed) } else { Vec::new() };
    let body = Body {
        centers: observed.laws.candidates(&Coordinates::Point).into_iter().filter(is_of_flight).collect(),
        spins,
        grounds: grounds(surroundings, &centers, surface.extent()),
        surface,
        is_shell: turns,
        coordinates,
        hits: surroundings.hits.to_vec(),
    };
    let bounced =
        explain(&body, &Observed { times: &observed.times, x: &x, deviations: &observed.deviations, least })?;
    let bounced = with_walls_ahead(bounced, [observed.times[0], motion.duration()], surroundings);
    Some(Impacted { bounced, middle })
}

/// Nothing rubs on a body in flight.
fn is_of_flight(candidate: &Candidate) -> bool {
    candidate.terms.iter().all(|term| term.kind.name() != "dry-friction")
}

/// Configurations of poses in the coordinates of a body with its centre of mass at a point of the shape.
fn configurations(
    observed: &ObservedPoses,
    poses: &[Pose],
    (coordinates, middle): (&Coordinates, DVec3),
) -> Vec<Vec<f64>> {
    let centered: Vec<Pose> = poses.iter().map(|pose| Pose { shift: pose.apply(middle), ..*pose }).collect();
    match coordinates {
        Coordinates::Rigid(inertia) => observed.configurations_of(&centered, inertia),
        _ => centered.iter().map(|pose| pose.shift.to_array().to_vec()).collect(),
    }
}

impl Impacted {
    /// Evidence of other poses at the samples, by a law with so many unknowns beside its start.
    pub(super) fn evidence_of(&self, observed: &ObservedPoses, poses: &[Pose], unknowns: f64) -> f64 {
        let of_body = (&self.bounced.law.coordinates, self.middle);
        self.bounced.evidence_of(&configurations(observed, poses, of_body), unknowns)
    }

    /// The pose of the shape at the start.
    pub(super) fn base(&self, observed: &ObservedPoses) -> Pose {
        let start = &self.bounced.start.x;
        let linear = match &self.bounced.law.coordinates {
            Coordinates::Rigid(inertia) => {
                DMat3::from_quat(quaternion(start).normalize() * quaternion(&inertia.frame).inverse())
            }
            _ => mean_pose(&observed.poses).linear,
        };
        Pose { linear, shift: center(start) - linear * self.middle }
    }
}

/// Laws of a rotation about the centre, on which no weight acts.
fn spins(observed: &ObservedPoses) -> Vec<Candidate> {
    let ball = Ball { pivot: [0.0; 3], arm: [0.0; 3], inertia: observed.inertia };
    let all = observed.laws.candidates(&Coordinates::Ball(ball));
    let is_free = |candidate: &Candidate| candidate.terms.iter().all(|term| term.port != Port::Arm);
    all.into_iter().filter(is_free).collect()
}

/// The surface of the particles, outliers left out, in the axes of the coordinates; `base` is the pose of the
/// shape in the configuration `x`.
pub(super) fn surface(motion: &SharedMotion, base: &Pose, x: &[f64]) -> Surface {
    let (back, center) = match x {
        [rotation @ .., _, _, _] if rotation.len() == 4 => {
            (DMat3::from_quat(quaternion(rotation).normalize().inverse()), DVec3::from_slice(&x[4..]))
        }
        _ => (DMat3::IDENTITY, DVec3::from_slice(x)),
    };
    let least = LIGHTEST / motion.weights.len().max(1) as f64;
    let heavy = motion.shape.iter().zip(&motion.weights).filter(|(_, weight)| **weight >= least);
    Surface::of(&heavy.map(|(&b, _)| (back * (base.apply(b) - center)).to_array()).collect::<Vec<_>>())
}

/// Planes of the points at rest near a path.
pub(super) fn grounds(surroundings: Surroundings<'_>, path: &[DVec3], extent: f64) -> Vec<Ground> {
    let reach = NEAR_PATH * extent;
    let is_near =
        |point: &&[f64; 3]| path.iter().any(|center| center.distance(DVec3::from(**point)) <= reach);
    let near: Vec<[f64; 3]> = surroundings.at_rest.iter().filter(is_near).copied().collect();
    path.first().map_or_else(Vec::new, |first| planes(&near, first.to_array(), NEAR * extent))
}

/// The contact that a body without an impact is expected to make, if it moves by a law of a point or of a
/// rigid body, keeps clear of a plane at rest in the window, and would go through it within the times that a
/// scene is asked for; `base` is the pose of the shape at the start.
pub(super) fn expected(
    fitted: &Fitted,
    base: &Pose,
    motion: &SharedMotion,
    surroundings: Surroundings<'_>,
) -> Option<Bounced> {
    let coordinates = &fitted.law.coordinates;
    if !matches!(coordinates, Coordinates::Point | Coordinates::Rigid(_)) || surroundings.at_rest.is_empty() {
        return None;
    }
    let window = motion.duration();
    let until = JUDGED_WINDOWS[1] * window;
    let times: Vec<f64> = (0..=EXPECTED_TIMES).map(|k| until * k as f64 / EXPECTED_TIMES as f64).collect();
    let states = System::new(&fitted.law, Edit::NONE).states(&fitted.start, &times).ok()?;
    let surface = surface(motion, base, &fitted.start.x);
    let clear = times.iter().filter(|time| **time <= window).count();
    let ground = first_met((&states, clear), &surface, surroundings, &|_| true)?;
    let speed = Contact::resting_speed(acceleration(fitted), NEAR * surface.extent());
    let contact = Contact::expected(ground.plane, &surface, speed);
    let bounced = Bounced::expecting(fitted, contact, &ground, [0.0, window]);
    Some(with_walls_ahead(bounced, [0.0, window], surroundings))
}

/// A law with its contact, and with the further planes at rest that its motion would go through within the
/// times that a scene is asked for; `first` and `window` are the first time of the track and its duration.
fn with_walls_ahead(
    mut bounced: Bounced,
    [first, window]: [f64; 2],
    surroundings: Surroundings<'_>,
) -> Bounced {
    let time = |k: usize| first + JUDGED_WINDOWS[1] * window * k as f64 / EXPECTED_TIMES as f64;
    let times: Vec<f64> = (0..=EXPECTED_TIMES).map(time).collect();
    let clear = times.iter().filter(|time| **time <= first + window).count();
    for _ in 0..MOST_WALLS_AHEAD {
        let next = || {
            let contact = bounced.law.contact.as_ref()?;
            let states = bounced.states(&times).ok()?;
            let surface = Surface { points: contact.points.clone(), radius: contact.radius };
            let is_another =
                |ground: &Ground| contact.planes().all(|plane| plane.is_of_other_surface(&ground.plane));
            first_met((&states, clear), &surface, surroundings, &is_another)
        };
        let Some(ground) = next() else { break };
        bounced = bounced.with_wall(&ground);
    }
    bounced
}

/// Of the planes at rest that a motion goes through, and of which the body keeps clear in its first states,
/// the one that it meets first.
fn first_met(
    (states, clear): (&[State], usize),
    surface: &Surface,
    surroundings: Surroundings<'_>,
    is_asked: &dyn Fn(&Ground) -> bool,
) -> Option<Ground> {
    let extent = surface.extent();
    let path: Vec<DVec3> = states.iter().map(|state| center(&state.x)).collect();
    let near = NEAR * extent;
    let touch = |ground: &Ground| {
        let contact = Contact::of(ground.plane, surface, 0.0);
        let gaps: Vec<f64> = states.iter().map(|state| contact.gap(&state.x)).collect();
        let touch = gaps.iter().position(|gap| *gap <= near)?;
        let goes_through = gaps[touch..].iter().any(|gap| *gap < -near);
        let is_there = is_covered(surroundings, ground, path[touch], extent);
        (touch >= clear && goes_through && is_there).then_some(touch)
    };
    let asked = grounds(surroundings, &path, extent).into_iter().filter(is_asked);
    let met = asked.filter_map(|ground| Some((touch(&ground)?, ground)));
    met.min_by_key(|(touch, _)| *touch).map(|(_, ground)| ground)
}

fn center(x: &[f64]) -> DVec3 {
    DVec3::from_slice(&x[x.len() - 3..])
}

/// Whether a place lies between points of a plane near it, so that no half of the plane about it is empty:
/// beyond an edge nothing stops a body.
fn is_covered(surroundings: Surroundings<'_>, ground: &Ground, place: DVec3, extent: f64) -> bool {
    let normal = DVec3::from(ground.plane.normal);
    let below = place - normal * ground.plane.height(place);
    let (east, north) = normal.any_orthonormal_pair();
    let is_near = |point: &DVec3| {
        point.distance(below) <= WITHIN_REACH * extent && ground.plane.height(*point).abs() <= NEAR * extent
    };
    let angle = |point: DVec3| (point - below).dot(north).atan2((point - below).dot(east));
    let points = surroundings.at_rest.iter().map(|point| DVec3::from(*point)).filter(is_near);
    let mut angles: Vec<f64> = points.map(angle).collect();
    angles.sort_by(f64::total_cmp);
    let Some(around) = angles.first().map(|first| first + TAU) else { return false };
    let next = angles.iter().skip(1).chain([&around]);
    angles.iter().zip(next).all(|(angle, next)| next - angle < PI)
}

/// Size of the acceleration at the start.
fn acceleration(fitted: &Fitted) -> f64 {
    let [pull, force] = System::new(&fitted.law, Edit::NONE).accelerations(&fitted.start);
    (center(&pull) + center(&force)).length()
}
