//! Gaussians of bodies that deform: a linear map takes a covariance Σ to L Σ Lᵀ, so that a body that
//! stretches grows no gaps and keeps its outline.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, fit_affine, nearest_rotation, outer, quaternion, wide};
use lgs_core::linear::{quat_mul, quat_normalize};
use lgs_mechanics::coordinates::Coordinates;
use rayon::prelude::*;

use super::{LagrangianScene, ObjectModel, SceneState};

/// Sweeps over the pairs of axes at most; convergence is quadratic, and four are enough for most.
const SWEEPS: usize = 16;
/// Cosine below which two axes count as orthogonal, beyond what single precision holds.
const ORTHOGONAL: f64 = 1e-9;

/// Rotation and log-scales of a Gaussian whose covariance a linear map has changed: the singular value
/// decomposition of the mapped axes by one-sided Jacobi rotations, which leave axes as near to where they
/// were as may be.
#[must_use]
pub fn mapped_shape(linear: &DMat3, rotation: [f32; 4], log_scales: [f32; 3]) -> ([f32; 4], [f32; 3]) {
    let turn = DMat3::from_quat(quaternion(&quat_normalize(rotation).map(f64::from)));
    let scales = DVec3::from(log_scales.map(f64::from)).exp();
    let mut axes = *linear * turn * DMat3::from_diagonal(scales);
    for _ in 0..SWEEPS {
        let turned = [(0, 1), (0, 2), (1, 2)].map(|pair| orthogonalise(&mut axes, pair));
        if turned == [false; 3] {
            break;
        }
    }
    let least = f64::from(f32::MIN_POSITIVE);
    let lengths = [0, 1, 2].map(|i| axes.col(i).length().max(least));
    let [x, y] = [0, 1].map(|i| axes.col(i) / lengths[i]);
    let frame = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y)));
    let has_frame = lengths.iter().all(|&length| length > least) && frame.is_finite();
    let new = if has_frame { components(frame.normalize()).map(|c| c as f32) } else { rotation };
    (new, lengths.map(|length| length.ln() as f32))
}

/// Turns two columns of a matrix in their plane until they are orthogonal; `false` if they are.
fn orthogonalise(axes: &mut DMat3, (i, j): (usize, usize)) -> bool {
    let (a, b) = (axes.col(i), axes.col(j));
    let (product, squares) = (a.dot(b), [a.length_squared(), b.length_squared()]);
    if product.abs() <= ORTHOGONAL * (squares[0] * squares[1]).sqrt() {
        return false;
    }
    let cotangent = (squares[1] - squares[0]) / (2.0 * product);
    let tangent = cotangent.signum() / (cotangent.abs() + cotangent.hypot(1.0));
    let cosine = tangent.hypot(1.0).recip();
    *axes.col_mut(i) = cosine * (a - tangent * b);
    *axes.col_mut(j) = cosine * (b + tangent * a);
    true
}

impl ObjectModel {
    /// Whether its law, or its recording as one body, changes its shape.
    #[must_use]
    pub fn deforms(&self) -> bool {
        if let Some(recording) = &self.recording {
            return recording.deforms();
        }
        self.dynamics
            .generalised()
            .is_some_and(|dynamics| matches!(dynamics.law.coordinates, Coordinates::Modal(_)))
    }
}

impl LagrangianScene {
    /// Rotations and log-scales of the dynamic Gaussians in a state.
    #[must_use]
    pub fn shapes_at(&self, state: &SceneState) -> (Vec<[f32; 4]>, Vec<[f32; 3]>) {
        let own = &self.dynamic_gaussians;
        let turned = state.rotation.iter().zip(&own.rotations);
        let mut rotations: Vec<[f32; 4]> = turned.map(|(&r, &r0)| quat_mul(r, quat_normalize(r0))).collect();
        let mut log_scales = own.log_scales.clone();
        for object in self.objects.iter().filter(|object| object.deforms()) {
            let linear = self.linear_map(&object.members, state);
            let rows = object.members.clone();
            let shapes = rotations[rows.clone()].par_iter_mut().zip(&mut log_scales[rows.clone()]);
            shapes.zip(rows).for_each(|((rotation, log_scales), row)| {
                (*rotation, *log_scales) = mapped_shape(&linear, own.rotations[row], own.log_scales[row]);
            });
        }
        (rotations, log_scales)
    }

    /// The linear map by which some dynamic Gaussians have moved since t = 0, by least squares.
    #[must_use]
    pub fn linear_map(&self, rows: &Range<usize>, state: &SceneState) -> DMat3 {
        let (before, now) = (&self.dynamic_gaussians.means[rows.clone()], &state.q[rows.clone()]);
        let (from, to) = (center(before), center(now));
        let (mut moment, mut covariance) = (DMat3::ZERO, DMat3::ZERO);
        for (&a, &b) in before.iter().zip(now) {
            moment += outer(wide(b) - to, wide(a) - from);
            covariance += outer(wide(a) - from, wide(a) - from);
        }
        fit_affine(&moment, &covariance, &nearest_rotation(&moment))
    }
}

fn center(points: &[[f32; 3]]) -> DVec3 {
    points.iter().map(|&p| wide(p)).sum::<DVec3>() / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::geometry::rotation_by;

    fn covariance(rotation: [f32; 4], log_scales: [f32; 3]) -> DMat3 {
        let turn = DMat3::from_quat(quaternion(&rotation.map(f64::from)).normalize());
        let root = turn * DMat3::from_diagonal(DVec3::from(log_scales.map(f64::from)).exp());
        root * root.transpose()
    }

    #[test]
    fn a_linear_map_changes_the_covariance() {
        let linear = rotation_by(DVec3::new(0.3, -0.4, 0.8))
            * DMat3::from_cols_array(&[1.3, 0.1, 0.0, 0.1, 0.8, 0.2, 0.0, 0.2, 1.1]);
        for (rotation, log_scales) in
            [([0.9, 0.1, -0.3, 0.2], [-3.0, -2.0, -5.0]), ([1.0, 0.0, 0.0, 0.0], [-2.0; 3])]
        {
            let (turned, scaled) = mapped_shape(&linear, rotation, log_scales);
            let expected = linear * covariance(rotation, log_scales) * linear.transpose();
            let apart = covariance(turned, scaled) - expected;
            let largest = apart.to_cols_array().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(largest < 1e-6 * expected.determinant().cbrt().max(1e-3), "{apart}");
        }
    }

    #[test]
    fn what_does_not_deform_keeps_its_axes() {
        let (rotation, log_scales) = ([0.5, 0.5, -0.5, 0.5], [-3.0, -2.0, -5.0]);
        let (same, scaled) = mapped_shape(&DMat3::IDENTITY, rotation, log_scales);
        assert!(same.iter().zip(rotation).all(|(a, b)| (a - b).abs() < 1e-5), "{same:?}");
        assert!(scaled.iter().zip(log_scales).all(|(a, b)| (a - b).abs() < 1e-5), "{scaled:?}");
        assert!(mapped_shape(&DMat3::ZERO, rotation, log_scales).1.iter().all(|x| x.is_finite()));
    }
}
