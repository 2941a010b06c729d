//! Displacements of bodies over time, learned beside the Gaussians by the refinement (method §6).
//!
//! Tracks of a source slip over surfaces, and Gaussians that are tuned to a motion that slips hold the poses
//! that images show to it. So a body that no law explains may be displaced while its Gaussians are refined,
//! by polynomials in time. The displacement is dropped with the stage: the poses that images show of the
//! refined Gaussians contain it.

use burn::tensor::{Device, Gradients, Int, Tensor, TensorData};
use lgs_core::linear::{norm, sub};
use lgs_model::{LagrangianScene, ObjectModel, Recording, TensorFile, TensorFileError};

use super::initial_pose::mean;
use super::law_choice::own_law;
use super::thresholds::{DISPLACEMENT_DEGREE, DISPLACEMENT_RATE};
use crate::adam::{AdamGroup, AdamSteps};
use crate::cloud_tensors::{CloudTensors, host_rows, quat_mul, quat_rotate, row_indices, rows};
use crate::thresholds::FEWEST_OF_BODY;

/// Name of the coefficients in a checkpoint.
const NAME: &str = "tune.displacements";
/// Name of the radii in a checkpoint: those of the Gaussians that the stage began with.
const RADII: &str = "tune.displaced_radii";
/// Numbers of a displacement: a translation in radii of the body, and a rotation vector to first order.
const SIZE: usize = 6;

/// Displacements of the bodies of a scene that no law explains.
pub(super) struct BodyDisplacements {
    /// `[degree, 6 bodies]`, of Chebyshev polynomials.
    coefficients: AdamGroup<2>,
    /// The body of every dynamic Gaussian `[n]`; the number of bodies for those of none.
    body_of: Tensor<1, Int>,
    /// `[bodies + 1, n]`: takes the mean over a body; zero in the last row.
    mean_over: Tensor<2>,
    /// Root mean square distances from the centres `[bodies, 1]`, world units.
    radii: Tensor<2>,
    /// End of the captured window.
    window: f32,
}

/// Leaves of the coefficients in a step's graph.
pub(super) struct DisplacementLeaf(Tensor<2>);

/// Gaussians at a time with their bodies displaced, where any are, and the leaf of that.
pub(super) fn displaced(
    displacements: Option<&BodyDisplacements>,
    cloud: CloudTensors,
    time: f32,
) -> (CloudTensors, Option<DisplacementLeaf>) {
    let Some(displacements) = displacements else { return (cloud, None) };
    let (cloud, leaf) = displacements.displaced(cloud, time);
    (cloud, Some(leaf))
}

impl BodyDisplacements {
    /// No displacement yet; nothing for a scene whose bodies all have laws that explain them.
    pub(super) fn new(scene: &LagrangianScene, device: &Device) -> Option<Self> {
        let bodies: Vec<_> =
            scene.objects.iter().filter(|object| may_slip(object)).flat_map(ObjectModel::bodies).collect();
        if bodies.is_empty() {
            return None;
        }
        let n = scene.dynamic_gaussians.len();
        let (mut body_of, mut mean_over) = (vec![bodies.len(); n], vec![0.0_f32; (bodies.len() + 1) * n]);
        for (index, rows) in bodies.iter().enumerate() {
            body_of[rows.clone()].fill(index);
            mean_over[index * n + rows.start..index * n + rows.end].fill(1.0 / rows.len() as f32);
        }
        let radii: Vec<[f32; 1]> =
            bodies.iter().map(|rows| [radius(&scene.dynamic_gaussians.means[rows.clone()])]).collect();
        let shape = [DISPLACEMENT_DEGREE, SIZE * bodies.len()];
        Some(Self {
            coefficients: AdamGroup::new(vec![0.0; shape[0] * shape[1]], shape, device),
            body_of: row_indices(body_of, device),
            mean_over: Tensor::from_data(TensorData::new(mean_over, [bodies.len() + 1, n]), device),
            radii: rows(&radii, device),
            window: scene.motion.time_window,
        })
    }

    /// Gaussians at a time with their bodies displaced, and the leaf of the coefficients.
    fn displaced(&self, cloud: CloudTensors, time: f32) -> (CloudTensors, DisplacementLeaf) {
        let (leaf, device) = (self.coefficients.leaf(), self.coefficients.device());
        let bodies = self.radii.dims()[0];
        let found = self.polynomials(time).autodiff().matmul(leaf.clone()).reshape([bodies, SIZE]);
        let shift = found.clone().narrow(1, 0, 3) * self.radii.clone().autodiff();
        let shift = self.of_each(shift, [0.0; 3], &device);
        let half = found.narrow(1, 3, 3).mul_scalar(0.5);
        let length = (half.clone().powi_scalar(2).sum_dim(1) + 1.0).sqrt();
        let turn = Tensor::cat(vec![Tensor::ones([bodies, 1], &device).autodiff(), half], 1) / length;
        let turn = self.of_each(turn, [1.0, 0.0, 0.0, 0.0], &device);
        let centers = self.mean_over.clone().matmul(cloud.means.clone().inner());
        let center = centers.select(0, self.body_of.clone()).autodiff();
        let means = quat_rotate(&turn, cloud.means - center.clone()) + center + shift;
        let rotations = quat_mul(&turn, &cloud.rotations);
        (CloudTensors { means, rotations, ..cloud }, DisplacementLeaf(leaf))
    }

    /// Adds the step that the gradients of a leaf ask for; `decay` is the part of the rate that is left.
    pub(super) fn add_step<'a>(
        &'a mut self,
        leaf: &DisplacementLeaf,
        gradients: &mut Gradients,
        decay: f64,
        steps: &mut AdamSteps<'a>,
    ) {
        steps.add(&mut self.coefficients, DISPLACEMENT_RATE * decay, leaf.0.grad_remove(gradients));
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        self.coefficients.insert_into(file, NAME);
        let radii: Vec<[f32; 1]> = host_rows(&self.radii);
        file.insert(RADII, &[radii.len(), 1], radii.as_flattened());
    }

    pub(super) fn restore(&mut self, file: &TensorFile) -> Result<(), TensorFileError> {
        let radii = super::rows_of_gaussians(file, RADII, self.radii.dims()[0])?;
        self.radii = rows::<1>(&radii, &self.radii.device());
        self.coefficients.restore(file, NAME)
    }

    /// `[1, degree]`: Chebyshev polynomials over the window less their values at the start, where the pose is
    /// that of the Gaussians.
    fn polynomials(&self, time: f32) -> Tensor<2> {
        let angle = |time: f32| (2.0 * time / self.window - 1.0).clamp(-1.0, 1.0).acos();
        let [now, start] = [time, 0.0].map(angle);
        let degree = |k: usize| (k + 1) as f32;
        let row: [f32; DISPLACEMENT_DEGREE] =
            std::array::from_fn(|k| (degree(k) * now).cos() - (degree(k) * start).cos());
        rows(&[row], &self.coefficients.device())
    }

    /// What bodies have `[bodies, D]`, for each of their Gaussians `[n, D]`; others have what stays.
    fn of_each<const D: usize>(&self, of_bodies: Tensor<2>, still: [f32; D], device: &Device) -> Tensor<2> {
        let still = rows(&[still], device).autodiff();
        Tensor::cat(vec![of_bodies, still], 0).select(0, self.body_of.clone())
    }
}

/// Root mean square distance of points from their centre.
fn radius(points: &[[f32; 3]]) -> f32 {
    let center = mean(points);
    let squares: f32 = points.iter().map(|&point| norm(sub(point, center)).powi(2)).sum();
    (squares / points.len().max(1) as f32).sqrt()
}

/// Whether an object may move otherwise than its tracks say: no law of its own is trusted at any time, and no
/// hand holds it.
fn may_slip(object: &ObjectModel) -> bool {
    let is_handled = object.recording.as_ref().is_some_and(Recording::is_handled);
    let is_trusted = own_law(object).is_some_and(|own| own.known.trusted[0] < own.known.trusted[1]);
    object.members.len() >= FEWEST_OF_BODY && !is_handled && !is_trusted
}
