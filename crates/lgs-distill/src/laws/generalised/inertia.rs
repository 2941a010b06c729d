//! Moments of inertia: those of the particles' second moments, and those that the motion itself shows.

use crate::thresholds::{LEAST_MOMENT, PARTICLES_INERTIA_WEIGHT};
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{
    components, cross_matrix, principal_axes, quaternion, scalar, solve_positive, symmetric, trace,
};
use lgs_mechanics::coordinates::{Inertia, InertiaForm};
use nalgebra::DMatrix;

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

/// The inertia that explains a motion about a point, at which `arm` (shape axes) leads to the centre of mass:
/// the angular momentum `R J ω` changes only by the weight's torque, `R J ω = L + ∫ R a dt × g`, which is
/// linear in the six entries of J, in L and in g. The scale is that of `prior`. The motion is given by its
/// times, by the rotations of the shape, and by its angular velocities in its own axes.
pub(super) fn of_motion(
    times: &[f64],
    (turns, spins): (&[DMat3], &[DVec3]),
    prior: &Inertia,
    arm: DVec3,
) -> Option<Inertia> {
    let tensor = tensor_of(prior);
    let mut impulse = DVec3::ZERO;
    let unknowns = ENTRIES + 6;
    let samples = times.len();
    let mut gram = DMatrix::<f64>::zeros(unknowns, unknowns);
    let mut right = DMatrix::<f64>::zeros(unknowns, 1);
    for k in 0..samples {
        if k > 0 {
            let mean = 0.5 * (turns[k] + turns[k - 1]);
            impulse += mean * arm * (times[k] - times[k - 1]);
        }
        let row = equation(&turns[k], spins[k], impulse, &tensor);
        let known = turns[k] * (tensor * spins[k]);
        gram += row.transpose() * &row;
        right -= row.transpose() * DMatrix::from_column_slice(3, 1, &known.to_array());
    }
    let momentum = turns.iter().zip(spins).map(|(turn, &spin)| (*turn * (tensor * spin)).length_squared());
    let ridge = PARTICLES_INERTIA_WEIGHT * momentum.sum::<f64>();
    (0..ENTRIES).for_each(|i| gram[(i, i)] += ridge);
    // A torque or momentum that no arm or spin shows is zero.
    (ENTRIES..unknowns).for_each(|i| gram[(i, i)] += f64::EPSILON * samples as f64);
    let found = solve_positive(gram, &right)?;
    let change = symmetric(&found.as_slice()[..ENTRIES]);
    let fitted = tensor + tensor * change + change.transpose() * tensor;
    let sum = trace(&fitted);
    (fitted.is_finite() && sum > 0.0).then(|| of_tensor(&fitted, LEAST_MOMENT * sum))
}

/// Unknown entries of a symmetric matrix.
const ENTRIES: usize = 6;

/// Derivatives of `R J ω − L − impulse × g` by the relative change of J, by L and by g.
fn equation(turn: &DMat3, spin: DVec3, impulse: DVec3, tensor: &DMat3) -> DMatrix<f64> {
    let mut row = DMatrix::zeros(3, ENTRIES + 6);
    let mut entries = [0.0; ENTRIES];
    for entry in 0..ENTRIES {
        entries.fill(0.0);
        entries[entry] = 1.0;
        let change = symmetric(&entries);
        let column = *turn * ((*tensor * change + change.transpose() * *tensor) * spin);
        (0..3).for_each(|i| row[(i, entry)] = column[i]);
    }
    let by_weight = cross_matrix(impulse);
    for i in 0..3 {
        row[(i, ENTRIES + i)] = -1.0;
        (0..3).for_each(|j| row[(i, ENTRIES + 3 + j)] = -by_weight.col(j)[i]);
    }
    row
}
