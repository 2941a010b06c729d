//! The gradient of a step on a device: that of [`super::gradient`], by the operations on tensors.

use super::gradient::Gradient;
use super::learner::Learner;
use super::lesson::{Exercise, Lesson};
use crate::networks::matching::FORCE_ONLY;
use burn::tensor::{Device, Int, Tensor, TensorData};
use lgs_dynamics::tensor::{acceleration, rollout};
use lgs_dynamics::{ForceKind, State};

/// A lesson whose targets are on the device.
pub(super) struct LessonOnDevice<'a> {
    lesson: &'a Lesson<'a>,
    /// `[T, n, 3]`.
    targets: Tensor<3>,
    device: Device,
}

/// The leaves of a step's graph.
struct Leaves {
    params: Tensor<1>,
    velocities: Tensor<2>,
}

/// Positions and velocities `[n, 3]` of a sample, as constants.
type Sample = (Tensor<2>, Tensor<2>);

impl<'a> LessonOnDevice<'a> {
    /// Brings the targets to the lesson's device.
    pub(super) fn new(lesson: &'a Lesson<'a>) -> Self {
        let device = lesson.device.clone().autodiff();
        let shape = [lesson.targets.len(), lesson.targets[0].len(), 3];
        let values: Vec<f32> = lesson.targets.iter().flatten().flatten().copied().collect();
        Self { lesson, targets: Tensor::from_data(TensorData::new(values, shape), &device), device }
    }

    /// Nothing if the rollout leaves the finite numbers.
    pub(super) fn gradient(&self, learner: &Learner, exercise: &Exercise) -> Option<Gradient> {
        let start = learner.start(self.lesson, &exercise.particles);
        let leaves = Leaves {
            params: Tensor::from_data(learner.system.params.as_slice(), &self.device).require_grad(),
            velocities: self.points(&start.v).require_grad(),
        };
        let (loss, penalised) = self.loss((learner, &start), exercise, &leaves);
        let penalty = self.penalty(learner, penalised, &leaves.params);
        let all = penalty.map_or(loss.clone(), |penalty| loss.clone() + penalty);
        let mut gradients = all.backward();
        let of_system = leaves.params.grad_remove(&mut gradients)?;
        let of_velocities = leaves.velocities.grad_remove(&mut gradients)?.reshape([-1]);
        // One transfer for all.
        let values = Tensor::cat(vec![loss.inner(), of_system, of_velocities], 0).into_data();
        let values = values.try_into_vec::<f32>().expect("gradients are in single precision");
        let (of_system, of_velocities) = values[1..].split_at(learner.system.params.len());
        values.iter().all(|value| value.is_finite()).then(|| Gradient {
            loss: values[0],
            of_system: of_system.to_vec(),
            of_velocities: of_velocities.as_chunks::<3>().0.to_vec(),
        })
    }

    /// The loss of a step `[1]`, in windows that each begin with constants, and the sample whose forces are
    /// penalised.
    fn loss(
        &self,
        (learner, start): (&Learner, &State),
        exercise: &Exercise,
        leaves: &Leaves,
    ) -> (Tensor<1>, Sample) {
        let &Exercise { ref particles, ref supports, horizon, window, penalised } = exercise;
        let (lesson, n) = (self.lesson, particles.len());
        let rows: Vec<i64> = particles.iter().map(|&j| j as i64).collect();
        let targets = self.targets.clone().select(1, Tensor::<1, Int>::from_data(&rows[..], &self.device));
        let (mut q, mut v) = (self.points(&start.q), leaves.velocities.clone());
        let mut sums = Tensor::zeros([1], &self.device);
        let mut kept = (q.clone().detach(), v.clone().detach());
        for first in (0..horizon).step_by(window.max(1)) {
            let steps = window.min(horizon - first);
            let call = lesson.call(learner.system.config, steps, supports.clone());
            let states = rollout(leaves.params.clone(), q, v, call);
            let positions = states.clone().slice([1..steps + 1, 0..n, 0..3]);
            let errors = positions - targets.clone().narrow(0, first + 1, steps);
            // By time first: a sum of everything is slow on devices.
            sums = sums + errors.square().sum_dim(0).sum();
            let states = states.detach();
            let sample = |step: usize| {
                let state = states.clone().narrow(0, step, 1).reshape([n, 10]);
                (state.clone().narrow(1, 0, 3), state.narrow(1, 3, 3))
            };
            if (first..=first + steps).contains(&penalised) {
                kept = sample(penalised - first);
            }
            (q, v) = sample(steps);
        }
        let unit = learner.system.config.normalisation.length;
        (sums.div_scalar(unit * unit * (n * horizon) as f32), kept)
    }

    /// `weight · mean |Q/σ_a|²` `[1]` at a sample.
    fn penalty(&self, learner: &Learner, (q, v): Sample, params: &Tensor<1>) -> Option<Tensor<1>> {
        let (config, weight) = (learner.system.config, self.lesson.config.force_penalty);
        if weight == 0.0 || config.force == ForceKind::None {
            return None;
        }
        let n = q.dims()[0] as f32;
        let forces = acceleration(config, FORCE_ONLY, params.clone(), q, v);
        let unit = config.normalisation.acceleration;
        Some(forces.square().sum().mul_scalar(weight / (unit * unit * n)))
    }

    fn points(&self, points: &[[f32; 3]]) -> Tensor<2> {
        let values = TensorData::new(points.as_flattened().to_vec(), [points.len(), 3]);
        Tensor::from_data(values, &self.device)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Alignment, DistillConfig, RolloutConfig};
    use crate::motion::denoise::denoise;
    use crate::networks::per_particle::gradient::gradient;
    use crate::trajectories::Trajectories;
    use lgs_core::testing::assert_gradient_close;
    use lgs_dynamics::VelocityPolicy;
    use std::sync::Arc;

    /// Twelve points that fall and turn.
    fn falling() -> Trajectories {
        let times: Vec<f32> = (0..12).map(|i| 0.02 * i as f32).collect();
        let at = |time: f32, j: usize| {
            let (angle, height) = (0.5 * j as f32 + 2.0 * time, 0.1 * (j % 3) as f32);
            [0.3 * angle.cos(), 0.3 * angle.sin(), 1.0 + height - 4.9 * time * time]
        };
        let positions = times.iter().map(|&time| (0..12).map(|j| at(time, j)).collect()).collect();
        Trajectories::unweighted(times, positions)
    }

    #[test]
    fn gradients_are_those_of_the_processor() {
        let trajectories = falling();
        let config = DistillConfig {
            hidden: 8,
            rollout: RolloutConfig { force_penalty: 0.1, ..RolloutConfig::default() },
            ..DistillConfig::networks()
        };
        let alignment = Some(Alignment { support: 5, velocity_policy: VelocityPolicy::Keep });
        for (alignment, window) in [(None, 11), (alignment, 11), (alignment, 4)] {
            let (targets, rollout) = (&trajectories.positions[..], &config.rollout);
            let (dt, device) = (trajectories.dt(), &Device::flex());
            let lesson = Lesson { targets, dt, config: rollout, alignment, device, seed: 3 };
            let mut learner = Learner::new(&lesson, &denoise(&trajectories, &config), &config);
            // The last layer of Q begins with zeros, of which the penalty knows nothing.
            learner.system.params.iter_mut().enumerate().for_each(|(i, p)| *p += 0.05 * (i as f32).sin());
            let particles = vec![0, 2, 3, 5, 6, 7, 9, 11];
            let supports = lesson.supports_among(&particles).map(Arc::new);
            let exercise = Exercise { particles, supports, horizon: 11, window, penalised: 7 };
            let expected = gradient(&lesson, &learner, &exercise).expect("finite");
            let found = LessonOnDevice::new(&lesson).gradient(&learner, &exercise).expect("finite");
            assert!((found.loss / expected.loss - 1.0).abs() < 1e-4, "{} {}", found.loss, expected.loss);
            assert_gradient_close("parameters", &found.of_system, &expected.of_system);
            let [found, expected] = [found, expected].map(|g| g.of_velocities.as_flattened().to_vec());
            assert_gradient_close("velocities", &found, &expected);
        }
    }
}
