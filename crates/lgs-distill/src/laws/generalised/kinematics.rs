//! Systems of coordinates that can hold the poses of a body: joints are read off the poses, before any law.

use super::observed::{ObservedPoses, mean_pose};
use crate::motion::pose::Pose;
use glam::{DMat3, DQuat, DVec3};
use lgs_mechanics::coordinates::{Ball, Coordinates, Embedding, Hinge, InertiaForm, Rolling};
use lgs_mechanics::rotation::rotation_vector;
use nalgebra::{DMatrix, DVector, Matrix3};

/// A system of coordinates with the configuration at each sample.
pub(super) struct Configured {
    pub(super) coordinates: Coordinates,
    /// Configurations, one for each sample.
    pub(super) x: Vec<Vec<f64>>,
    /// Pose of the shape in the first configuration.
    pub(super) base: Pose,
    /// Constants of its geometry: those of the joint and of the shape's pose in it.
    pub(super) constants: usize,
    /// χ² of the poses that the coordinates can have nearest to the observed ones.
    pub(super) chi_square: f64,
}

impl Configured {
    fn new(observed: &ObservedPoses, coordinates: Coordinates, x: Vec<Vec<f64>>, constants: usize) -> Self {
        let placements = placements(&coordinates, &x);
        let back = placements.iter().zip(&observed.poses).map(|(place, pose)| place.before(pose));
        let base = mean_pose(&back.collect::<Vec<_>>());
        let predicted: Vec<Pose> = placements.iter().map(|place| place.after(&base)).collect();
        let chi_square = observed.chi_square(&predicted);
        Self { coordinates, x, base, constants, chi_square }
    }

    /// The pose of the shape in a configuration.
    pub(super) fn pose_in(&self, x: &[f64]) -> Pose {
        placements(&self.coordinates, &[self.x[0].clone(), x.to_vec()])[1].after(&self.base)
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

fn placements(coordinates: &Coordinates, x: &[Vec<f64>]) -> Vec<Placed> {
    let embedding = Embedding::new(coordinates, &x[0]);
    let placed = |x: &Vec<f64>| {
        let place = embedding.placements(x)[0];
        Placed { rotation: place.linear, shift: place.to - place.linear * place.from }
    };
    x.iter().map(placed).collect()
}

/// Every system of coordinates that the poses suggest, the rigid ones last.
pub(super) fn systems(observed: &ObservedPoses) -> Vec<Configured> {
    let mut all = vec![point(observed)];
    let turning = turning_axis(&observed.poses);
    all.extend(turning.and_then(|axis| hinge(observed, axis)));
    all.extend(turning.and_then(|axis| rolling(observed, axis)));
    all.extend([InertiaForm::Prior, InertiaForm::Free].into_iter().filter_map(|form| ball(observed, form)));
    let forms = [InertiaForm::Isotropic, InertiaForm::Prior, InertiaForm::Free];
    all.extend(forms.map(|form| rigid(observed, form)));
    all
}

/// Constants of a pose.
const POSE: usize = 6;

fn point(observed: &ObservedPoses) -> Configured {
    let x = observed.poses.iter().map(|pose| pose.shift.to_array().to_vec()).collect();
    // The centre at the start is among the unknowns of the motion.
    Configured::new(observed, Coordinates::Point, x, POSE - 3)
}

fn rigid(observed: &ObservedPoses, form: InertiaForm) -> Configured {
    let coordinates = Coordinates::Rigid(lgs_mechanics::coordinates::Inertia { form, ..observed.inertia });
    Configured::new(observed, coordinates, observed.track.x.clone(), 0)
}

/// The axis, in world axes, about which all poses turn: the direction in the body whose images differ least.
fn turning_axis(poses: &[Pose]) -> Option<DVec3> {
    let mean = poses.iter().map(|pose| pose.linear).sum::<DMat3>() * (poses.len() as f64).recip();
    let svd = Matrix3::from_column_slice(&mean.to_cols_array()).svd(true, false);
    let u = svd.u?;
    let axis = DVec3::from_slice(u.column(svd.singular_values.imax()).as_slice());
    (axis.is_finite() && axis.length() > 0.5).then(|| axis.normalize())
}

/// Angles about an axis from pose to pose, added up so that they may exceed a full turn.
fn angles(poses: &[Pose], axis: DVec3) -> Vec<f64> {
    let mut angle = 0.0;
    let mut angles = vec![0.0];
    for pair in poses.windows(2) {
        let turn = DQuat::from_mat3(&(pair[1].linear * pair[0].linear.transpose()));
        angle += rotation_vector(turn).dot(axis);
        angles.push(angle);
    }
    angles
}

/// A fixed point and where it is in the body: `c_k = p + R_k r` by least squares. What the rotations do not
/// determine stays at the mean centre.
fn pivot(poses: &[Pose]) -> Option<(DVec3, DVec3)> {
    let mean = poses.iter().map(|pose| pose.shift).sum::<DVec3>() / poses.len() as f64;
    let mut rows = DMatrix::zeros(3 * poses.len(), 6);
    let mut right = DVector::zeros(3 * poses.len());
    for (k, pose) in poses.iter().enumerate() {
        let offset = pose.shift - mean;
        for i in 0..3 {
            rows[(3 * k + i, i)] = 1.0;
            (0..3).for_each(|j| rows[(3 * k + i, 3 + j)] = pose.linear.col(j)[i]);
            right[3 * k + i] = offset[i];
        }
    }
    let svd = rows.svd(true, true);
    let found = svd.solve(&right, UNDETERMINED * svd.singular_values.max()).ok()?;
    let vector = |at: usize| DVec3::new(found[at], found[at + 1], found[at + 2]);
    (found.iter().all(|v| v.is_finite())).then(|| (mean + vector(0), vector(3)))
}

/// Singular values, as a fraction of the largest, below which a direction of a pivot is not determined: a
/// turn by some degrees leaves a hundredth.
const UNDETERMINED: f64 = 3e-3;

fn hinge(observed: &ObservedPoses, axis: DVec3) -> Option<Configured> {
    let (pivot, _) = pivot(&observed.poses)?;
    let coordinates = Coordinates::Hinge(Hinge { axis: axis.to_array(), pivot: pivot.to_array() });
    let x = angles(&observed.poses, axis).into_iter().map(|angle| vec![angle]).collect();
    // Axis and pivot have four, and the pose along the angle is among the unknowns of the motion.
    Some(Configured::new(observed, coordinates, x, 4 + POSE - 1))
}

fn rolling(observed: &ObservedPoses, axis: DVec3) -> Option<Configured> {
    let poses = &observed.poses;
    let center = poses[0].shift;
    let direction = (poses[poses.len() - 1].shift - center).try_normalize()?;
    let path: Vec<f64> = poses.iter().map(|pose| (pose.shift - center).dot(direction)).collect();
    let angles = angles(poses, axis);
    let product: f64 = path.iter().zip(&angles).map(|(s, angle)| s * angle).sum();
    let square: f64 = angles.iter().map(|angle| angle * angle).sum();
    let radius = product / square;
    if !radius.is_finite() || radius == 0.0 {
        return None;
    }
    let coordinates = Coordinates::Rolling(Rolling {
        direction: direction.to_array(),
        axis: (axis * radius.signum()).to_array(),
        radius: radius.abs(),
        center: center.to_array(),
    });
    let x = path.into_iter().map(|s| vec![s]).collect();
    // Direction and axis have two each, the radius one.
    Some(Configured::new(observed, coordinates, x, 5 + POSE - 1))
}

fn ball(observed: &ObservedPoses, form: InertiaForm) -> Option<Configured> {
    let (pivot, arm) = pivot(&observed.poses)?;
    let [w, x, y, z] = observed.inertia.frame;
    let arm = DQuat::from_xyzw(x, y, z, w).inverse() * arm;
    // The moments about the pivot (Steiner), as far as they lie along the principal axes of the centre.
    let square = arm.length_squared();
    let moments = std::array::from_fn(|i| observed.inertia.moments[i] + square - arm[i] * arm[i]);
    let inertia = lgs_mechanics::coordinates::Inertia { form, moments, ..observed.inertia };
    let coordinates = Coordinates::Ball(Ball { pivot: pivot.to_array(), arm: arm.to_array(), inertia });
    let x = observed.track.x.iter().map(|x| x[..4].to_vec()).collect();
    Some(Configured::new(observed, coordinates, x, 3 + POSE - 3))
}
