//! Moments of inertia of the particles, about which those of the motion are fitted.

use crate::thresholds::LEAST_MOMENT;
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, principal_axes, quaternion, scalar, trace};
use lgs_mechanics::coordinates::{Inertia, InertiaForm};

/// Inertia about the centre of particles with these second moments.
pub(super) fn of_particles(covariance: &DMat3) -> Inertia {
    let [(first, _), (second, _), (third, _)] = principal_axes(covariance);
    let sum = first + second + third;
    let tensor = scalar(sum) - *covariance;
    of_tensor(&tensor, LEAST_MOMENT * sum)
}

/// The principal axes and moments of a tensor, none below `least`.
fn of_tensor(tensor: &DMat3, least: f64) -> Inertia {
    let [(last, z), (middle, y), (first, _)] = principal_axes(tensor);
    let frame = DQuat::from_mat3(&DMat3::from_cols(y.cross(z), y, z)).normalize();
    Inertia {
        form: InertiaForm::Prior,
        frame: components(frame),
        moments: [first, middle, last].map(|moment| moment.max(least)),
    }
}

/// The tensor of an inertia in the axes of the shape.
fn tensor_of(inertia: &Inertia) -> DMat3 {
    let frame = DMat3::from_quat(quaternion(&inertia.frame));
    frame * DMat3::from_diagonal(DVec3::from_array(inertia.moments)) * frame.transpose()
}

/// The inertia of a body that is round about a direction (shape axes), with the mean of the moments of
/// another across it: that of a top about its tip.
pub(super) fn round_about(other: &Inertia, direction: DVec3) -> Inertia {
    let axis = direction.normalize_or(DVec3::Z);
    let (first, second) = axis.any_orthonormal_pair();
    let tensor = tensor_of(other);
    let along = axis.dot(tensor * axis);
    let across = 0.5 * (trace(&tensor) - along);
    let frame = DQuat::from_mat3(&DMat3::from_cols(first, second, axis)).normalize();
    Inertia { form: InertiaForm::Round, frame: components(frame), moments: [across, across, along] }
}
