//! Systems of coordinates that can hold the poses of a body: joints are read off the poses, before any law.

use super::geometry::{body_points, center_of_mass, pivot};
use super::inertia::round_about;
use super::nearest::nearest;
use super::observed::{ObservedPoses, mean_pose};
use super::turning::Turning;
use crate::motion::pose::Pose;
use crate::thresholds::{CENTER_COEFFICIENTS, FARTHEST_CONTACT, NEAREST_CONTACT, NEAREST_ROUNDS};
use glam::{DMat3, DVec3};
use lgs_core::geometry::quaternion;
use lgs_mechanics::choose::DESCRIBED;
use lgs_mechanics::coordinates::{
    Ball, Coordinates, Embedding, Hinge, Inertia, InertiaForm, Placement, Rolling,
};

/// A system of coordinates with the configuration at each sample.
pub(super) struct Configured {
    pub(super) coordinates: Coordinates,
    /// Configurations, one for each sample.
    pub(super) x: Vec<Vec<f64>>,
    /// The bodies, in the order in which the coordinates take them.
    pub(super) order: Vec<usize>,
    /// Pose of the shape of each body in the first configuration, in that order.
    pub(super) bases: Vec<Pose>,
    /// Constants of its geometry: those of the joint and of the shape's pose in it.
    pub(super) constants: usize,
    /// χ² of the poses that the coordinates can have nearest to the observed ones.
    pub(super) chi_square: f64,
}

impl Configured {
    fn new(observed: &ObservedPoses, coordinates: Coordinates, x: Vec<Vec<f64>>, constants: usize) -> Self {
        Self::of_bodies((&[observed], &[0]), coordinates, x, constants)
    }

    /// The same for coordinates that take several bodies in an order.
    pub(super) fn of_bodies(
        (bodies, order): (&[&ObservedPoses], &[usize]),
        coordinates: Coordinates,
        x: Vec<Vec<f64>>,
        constants: usize,
    ) -> Self {
        let mut all =
            Self { coordinates, x, order: order.to_vec(), bases: Vec::new(), constants, chi_square: 0.0 };
        all.place(bodies);
        // Rotations alone tell those about a pivot, which is less well known.
        if matches!(all.coordinates, Coordinates::Hinge(_) | Coordinates::Rolling(_) | Coordinates::Tree(_)) {
            let [angle, place] = bodies[0].noise();
            let step = if matches!(all.coordinates, Coordinates::Rolling(_)) { place } else { angle };
            for _ in 0..NEAREST_ROUNDS {
                all.x = nearest(&all.coordinates, &all.x, step, |x| all.left_by(bodies, x));
                all.place(bodies);
            }
        }
        all
    }

    /// Sets the pose of the shape of each body, and what the coordinates leave.
    fn place(&mut self, bodies: &[&ObservedPoses]) {
        let placements = placements(&self.coordinates, &self.x[0], &self.x);
        let base = |(body, &i): (usize, &usize)| {
            let own = placements.iter().map(|of_time| &of_time[body]);
            let back = own.zip(&bodies[i].poses).map(|(place, pose)| place.before(pose));
            mean_pose(&back.collect::<Vec<_>>())
        };
        self.bases = self.order.iter().enumerate().map(base).collect();
        self.chi_square = self.left_by(bodies, &self.x).iter().flatten().map(|d| d * d).sum();
    }

    /// Whitened differences of the observed poses from those of other configurations, sample by sample.
    fn left_by(&self, bodies: &[&ObservedPoses], x: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let placements = placements(&self.coordinates, &self.x[0], x);
        let mut left = vec![Vec::with_capacity(6 * bodies.len()); x.len()];
        for (body, &i) in self.order.iter().enumerate() {
            let predicted: Vec<Pose> =
                placements.iter().map(|of_time| of_time[body].after(&self.bases[body])).collect();
            let whitened: Vec<f64> = bodies[i].whitened(&predicted).collect();
            left.iter_mut().zip(whitened.chunks_exact(6)).for_each(|(left, own)| left.extend(own));
        }
        left
    }

    /// Constants by which the coordinates count as simple: those of a joint. A centre of mass is never quite
    /// at the centre of the particles that are seen, so a law about it is as simple as one about that; and
    /// modes are how a body deforms, whatever their law is.
    pub(super) fn joint_constants(&self) -> usize {
        let is_joint = !matches!(self.coordinates, Coordinates::Rigid(_) | Coordinates::Modal(_));
        if is_joint { self.constants } else { 0 }
    }

    /// The pose of the shape of each body in a configuration.
    pub(super) fn poses_in(&self, x: &[f64]) -> Vec<Pose> {
        let placed = placements(&self.coordinates, &self.x[0], &[x.to_vec()]);
        placed[0].iter().zip(&self.bases).map(|(place, base)| place.after(base)).collect()
    }
}

/// A rigid placement as a map of poses.
struct Placed {
    rotation: DMat3,
    shift: DVec3,
}

impl Placed {
    fn after(&self, pose: &Pose) -> Pose {
        Pose { linear: self.rotation * pose.linear, shift: self.rotation * pose.shift + self.shift }
    }

    /// The pose that this placement takes to the given one.
    fn before(&self, pose: &Pose) -> Pose {
        let back = self.rotation.transpose();
        Pose { linear: back * pose.linear, shift: back * (pose.shift - self.shift) }
    }
}

/// Placements of each body, by configuration, which are none in the reference.
fn placements(coordinates: &Coordinates, reference: &[f64], x: &[Vec<f64>]) -> Vec<Vec<Placed>> {
    let embedding = Embedding::new(coordinates, reference);
    let of_body =
        |place: Placement| Placed { rotation: place.linear, shift: place.to - place.linear * place.from };
    x.iter().map(|x| embedding.placements(x).into_iter().map(of_body).collect()).collect()
}

/// Every system of coordinates but that of a free body which the poses suggest.
pub(super) fn systems(observed: &ObservedPoses) -> Vec<Configured> {
    let mut all = vec![point(observed)];
    all.extend(joints_of_one_axis(observed));
    all.extend(pivot(&observed.poses).into_iter().flat_map(|pivot| balls(observed, pivot)));
    all
}

/// Takes what a joint of one freedom leaves of poses for noise, if it describes them and errors that change
/// slowly can be the reason: such errors look like a little of any other freedom.
pub(super) fn allow_for_joint(observed: &mut ObservedPoses, slow_error: f64) {
    if slow_error > 0.0
        && let Some(chi_square) = left_by_joint(observed)
        && chi_square <= DESCRIBED
    {
        observed.allow_for(slow_error, chi_square);
    }
}

/// χ² of the poses for each degree of freedom that a joint of one freedom leaves, the best of these.
fn left_by_joint(observed: &ObservedPoses) -> Option<f64> {
    joints_of_one_axis(observed).iter().map(|joint| left_for_each(observed, joint)).min_by(f64::total_cmp)
}

/// χ² of the poses that a joint of one freedom leaves, for each degree of freedom.
fn left_for_each(observed: &ObservedPoses, joint: &Configured) -> f64 {
    // One of six values of a sample is the joint's own.
    let values = observed.track.independent_samples() * 5.0 / 6.0;
    joint.chi_square / (values - joint.constants as f64).max(1.0)
}

/// The joints of a body that turns about one axis. What advances by less than any axle is thick does not
/// roll: its source lets its place drift, or it turns and slides.
fn joints_of_one_axis(observed: &ObservedPoses) -> Vec<Configured> {
    let Some(turning) = Turning::about_one_axis(&observed.poses) else { return Vec::new() };
    let rolling = rolling(observed, &turning).filter(|rolling| advances(observed, &rolling.coordinates));
    hinge(observed, &turning).into_iter().chain(rolling).collect()
}

/// Whether a rolling body advances along its axis, as a screw, or across it by a length per radian that may
/// be the radius of an axle.
fn advances(observed: &ObservedPoses, rolling: &Coordinates) -> bool {
    let Coordinates::Rolling(rolling) = rolling else { return false };
    let (direction, axis) = (DVec3::from_array(rolling.direction), DVec3::from_array(rolling.axis));
    let across = direction.reject_from_normalized(axis).length();
    direction.dot(axis).abs() > across || rolling.radius * across >= NEAREST_CONTACT * observed.radius()
}

/// The systems of a free body: for each inertia, one about the centre of the particles, and one about each
/// centre of mass that the poses suggest, where their noise tells it from the others.
pub(super) fn free_systems(observed: &ObservedPoses) -> Vec<Vec<Configured>> {
    let shown = |coefficients| center_of_mass(&observed.poses, &observed.times, coefficients);
    let noise = observed.noise_of_place();
    let mut centers = vec![None];
    for center in CENTER_COEFFICIENTS.into_iter().filter_map(shown) {
        if centers.iter().all(|other: &Option<DVec3>| other.unwrap_or_default().distance(center) > noise) {
            centers.push(Some(center));
        }
    }
    let of_inertia =
        |inertia: &Inertia| centers.iter().map(|&center| rigid(observed, inertia, center)).collect();
    inertias(&observed.inertia).iter().map(of_inertia).collect()
}

/// The inertia of the particles: the same for all axes, as it is, with ratios of its moments to be fitted,
/// and with its axes as well.
fn inertias(prior: &Inertia) -> Vec<Inertia> {
    let forms = [InertiaForm::Isotropic, InertiaForm::Prior, InertiaForm::Free, InertiaForm::Whole];
    forms.map(|form| Inertia { form, ..*prior }).to_vec()
}

/// Constants of a pose.
pub(super) const POSE: usize = 6;

fn point(observed: &ObservedPoses) -> Configured {
    let x = observed.poses.iter().map(|pose| pose.shift.to_array().to_vec()).collect();
    // The centre at the start is among the unknowns of the motion.
    Configured::new(observed, Coordinates::Point, x, POSE - 3)
}

/// A free body whose centre of mass is at the centre of its particles, or at a point of the shape.
pub(super) fn rigid(observed: &ObservedPoses, &inertia: &Inertia, center: Option<DVec3>) -> Configured {
    let mut x = observed.configurations(&inertia);
    if let Some(center) = center {
        for (x, pose) in x.iter_mut().zip(&observed.poses) {
            x[4..].copy_from_slice(&pose.apply(center).to_array());
        }
    }
    let constants = if center.is_some() { 3 } else { 0 };
    Configured::new(observed, Coordinates::Rigid(inertia), x, constants)
}

fn hinge(observed: &ObservedPoses, turning: &Turning) -> Option<Configured> {
    let (pivot, _) = pivot(&observed.poses)?;
    let coordinates = Coordinates::Hinge(Hinge { axis: turning.axis.to_array(), pivot: pivot.to_array() });
    let x = turning.angles.iter().map(|&angle| vec![angle]).collect();
    // Axis and pivot have four, and the pose along the angle is among the unknowns of the motion.
    Some(Configured::new(observed, coordinates, x, 4 + POSE - 1))
}

/// A round body that moves by a fixed vector per radian: `c_k = p + θ_k u + R_k r`.
fn rolling(observed: &ObservedPoses, turning: &Turning) -> Option<Configured> {
    let poses = &observed.poses;
    let (points, arms) = body_points(poses, |k| vec![1.0, turning.angles[k]])?;
    let ([center, per_radian], [arm]) = (&points[..], &arms[..]) else { return None };
    let (radius, direction) = (per_radian.length(), per_radian.try_normalize()?);
    if radius > FARTHEST_CONTACT * observed.radius() {
        return None;
    }
    let rolling = Rolling {
        direction: direction.to_array(),
        axis: turning.axis.to_array(),
        radius,
        center: center.to_array(),
    };
    let offset = |pose: &Pose| vec![(pose.shift - pose.linear * *arm - *center).dot(direction)];
    let x = poses.iter().map(offset).collect();
    // Direction and axis have two each, the radius one.
    Some(Configured::new(observed, Coordinates::Rolling(rolling), x, 5 + POSE - 1))
}

/// A body that turns about a fixed point, given with the vector from there to the centre in shape axes.
fn balls(observed: &ObservedPoses, (pivot, arm): (DVec3, DVec3)) -> Vec<Configured> {
    // The moments about the pivot (Steiner), as far as they lie along the principal axes of the centre.
    let own = quaternion(&observed.inertia.frame).inverse() * arm;
    let moments = |i: usize| observed.inertia.moments[i] + own.length_squared() - own[i] * own[i];
    let about_pivot = Inertia { moments: std::array::from_fn(moments), ..observed.inertia };
    let ball = |inertia: Inertia, arm: DVec3| {
        let arm = quaternion(&inertia.frame).inverse() * arm;
        let coordinates = Coordinates::Ball(Ball { pivot: pivot.to_array(), arm: arm.to_array(), inertia });
        let x = observed.configurations(&inertia).iter().map(|x| x[..4].to_vec()).collect();
        Configured::new(observed, coordinates, x, 3 + POSE - 3)
    };
    let forms = inertias(&about_pivot);
    // Without weight no centre counts.
    let weightless = forms.iter().map(|inertia| ball(*inertia, DVec3::ZERO));
    if arm.length() <= 0.0 {
        return weightless.collect();
    }
    let round = round_about(&about_pivot, arm);
    weightless.chain(forms.iter().chain([&round]).map(|inertia| ball(*inertia, arm))).collect()
}
