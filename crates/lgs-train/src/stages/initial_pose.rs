//! Where an object is at t = 0, in stage 2: a rigid displacement of what distillation found there.
//!
//! A source model follows a body least well at the ends of the captured window. Where its first pose is off,
//! initial velocity and law can only be as good as a motion from that pose allows, whatever the images say.

use burn::tensor::{Device, Tensor};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{PositiveFactor, outer, scalar, trace, wide};
use lgs_core::linear::{add, cross, scale, sub};
use lgs_model::{TensorFile, TensorFileError};

use crate::adam::{AdamGroup, AdamSteps};
use crate::cloud_tensors::{quat_rotate, rows, vector};

/// Numbers of a displacement: a translation in units of the object's radius, and a rotation vector about its
/// centre, to first order.
const SIZE: usize = 6;

/// One object's displacement.
pub(super) struct InitialPose {
    group: AdamGroup<1>,
    /// `[n, 3]`, from the centre.
    offsets: Tensor<2>,
    /// Root mean square distance from the centre, world units.
    radius: f32,
    /// Angular velocity of the object as a whole.
    spin: [f32; 3],
}

/// A displacement in a step's graph.
pub(super) struct Displacement {
    pub(super) leaf: Tensor<1>,
    /// Of every particle, `[n, 3]`.
    pub(super) change: Tensor<2>,
    /// The rotation in it, `[1, 4]`.
    pub(super) turn: Tensor<2>,
}

impl InitialPose {
    /// No displacement of particles with such positions and velocities.
    pub(super) fn new(points: &[[f32; 3]], velocities: &[[f32; 3]], device: &Device) -> Self {
        let center = mean(points);
        let offsets: Vec<[f32; 3]> = points.iter().map(|&p| sub(p, center)).collect();
        let square = offsets.as_flattened().iter().map(|x| x * x).sum::<f32>() / points.len().max(1) as f32;
        Self {
            group: AdamGroup::new(vec![0.0; SIZE], [SIZE], device),
            spin: spin(&offsets, velocities),
            radius: square.sqrt(),
            offsets: rows(&offsets, device),
        }
    }

    /// Reads what a checkpoint holds under a name.
    pub(super) fn restore(&mut self, file: &TensorFile, name: &str) -> Result<(), TensorFileError> {
        self.group.restore(file, name)
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile, name: &str) {
        self.group.insert_into(file, name);
    }

    pub(super) fn add_step<'a>(
        &'a mut self,
        learning_rate: f64,
        gradient: Option<Tensor<1>>,
        steps: &mut AdamSteps<'a>,
    ) {
        steps.add(&mut self.group, learning_rate, gradient);
    }

    /// The displacement now, as a function of a new leaf.
    pub(super) fn displacement(&self) -> Displacement {
        let leaf = self.group.leaf();
        let translation = leaf.clone().narrow(0, 0, 3).mul_scalar(self.radius).reshape([1, 3]);
        let half = leaf.clone().narrow(0, 3, 3).mul_scalar(0.5).reshape([1, 3]);
        let length = (half.clone().powi_scalar(2).sum_dim(1) + 1.0).sqrt();
        let one = Tensor::ones([1, 1], &leaf.device());
        let turn = Tensor::cat(vec![one, half], 1) / length;
        let offsets = self.offsets.clone().autodiff();
        let turned = quat_rotate(&turn, offsets.clone());
        Displacement { change: turned - offsets + translation, leaf, turn }
    }

    /// What the displacement `[n, 3]` changes in the velocities, `[n, 3]`: the body keeps its linear and
    /// angular velocity, here with an addition `[3]` to the latter.
    pub(super) fn velocity_change(&self, change: &Tensor<2>, more_spin: Option<Tensor<1>>) -> Tensor<2> {
        let spin = vector(&self.spin, &change.device());
        let spin = more_spin.map_or(spin.clone(), |more| spin + more).reshape([1, 3]);
        spin.expand(change.dims()).cross(change.clone(), 1)
    }
}

pub(super) fn mean(points: &[[f32; 3]]) -> [f32; 3] {
    scale(points.iter().fold([0.0; 3], |sum, &p| add(sum, p)), 1.0 / points.len().max(1) as f32)
}

/// The angular velocity of particles as a whole, by least squares; zero where it is undetermined.
pub(super) fn spin(offsets: &[[f32; 3]], velocities: &[[f32; 3]]) -> [f32; 3] {
    let (mut inertia, mut momentum) = (DMat3::ZERO, DVec3::ZERO);
    for (&offset, &velocity) in offsets.iter().zip(velocities) {
        let r = wide(offset);
        inertia += scalar(r.length_squared()) - outer(r, r);
        momentum += wide(cross(offset, velocity));
    }
    let [x, y, z] = [inertia.x_axis, inertia.y_axis, inertia.z_axis];
    let factor = PositiveFactor::new([x.x, x.y, y.y, x.z, y.z, z.z], trace(&inertia));
    factor.map_or([0.0; 3], |factor| factor.solve(momentum.to_array()).map(|v| v as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adam::values;
    use crate::device::DeviceName;

    const POINTS: [[f32; 3]; 4] = [[1.0, 0.0, 0.5], [-0.5, 0.3, 0.0], [0.2, -0.9, 0.1], [0.1, 0.4, -0.8]];
    const SPIN: [f32; 3] = [0.3, -0.5, 1.1];

    fn pose(points: &[[f32; 3]]) -> InitialPose {
        let center = mean(points);
        let velocities: Vec<[f32; 3]> =
            points.iter().map(|&p| add([2.0, 0.0, -1.0], cross(SPIN, sub(p, center)))).collect();
        InitialPose::new(points, &velocities, &DeviceName::Cpu.device())
    }

    #[test]
    fn nothing_moves_at_first_and_then_the_body_moves_rigidly_within_its_field_of_velocities() {
        let mut pose = pose(&POINTS);
        let still = pose.displacement();
        assert!(values(&still.change.inner()).iter().all(|&x| x == 0.0));
        pose.group.replace(vector(&[0.1, 0.0, -0.2, 0.4, 0.2, -0.3], &DeviceName::Cpu.device()));
        let moved = pose.displacement();
        let change: Vec<[f32; 3]> = values(&moved.change.clone().inner()).as_chunks().0.to_vec();
        let after: Vec<[f32; 3]> = POINTS.iter().zip(&change).map(|(&p, &c)| add(p, c)).collect();
        for (i, j) in [(0, 1), (0, 2), (1, 3)] {
            let distance = |p: &[[f32; 3]]| lgs_core::linear::norm(sub(p[i], p[j]));
            assert!((distance(&POINTS) - distance(&after)).abs() < 1e-6);
        }
        let velocities: Vec<[f32; 3]> =
            values(&pose.velocity_change(&moved.change, None).inner()).as_chunks().0.to_vec();
        for (velocity, &change) in velocities.iter().zip(&change) {
            assert!(sub(*velocity, cross(SPIN, change)).iter().all(|x| x.abs() < 1e-5), "{velocity:?}");
        }
    }

    #[test]
    fn points_on_a_line_have_no_spin() {
        assert_eq!(pose(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]).spin, [0.0; 3]);
        assert_eq!(pose(&[]).radius, 0.0);
    }
}
