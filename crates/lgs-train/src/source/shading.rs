//! Learning how Gaussians are lit over time ([`lgs_model::Shading`]), beside their motion: what motion and
//! constant colours explain is theirs, and brightness gets what is left. On trial, nothing is drawn with what
//! is learned, so that Gaussians and motion are those of constant colours if it is given up.

use std::ops::RangeInclusive;

use burn::tensor::Tensor;
use lgs_model::{Shading, ShadingTimes};

use super::config::SourceConfig;
use crate::cloud_tensors::CloudTensors;
use crate::thresholds::SMOOTH_BRIGHTNESS;
use crate::trainable_cloud::TrainableCloud;

/// The times at which brightnesses of all Gaussians are learned, and from when on.
pub(super) struct ShadingSchedule {
    times: ShadingTimes,
    after: usize,
    /// The iteration after which brightness that does not change smoothly is given up.
    judged_after: Option<usize>,
    weights: [f32; 2],
}

/// The logarithms `[n, 1]` of the factors of all Gaussians' colours at the known times around a step's, and
/// the weight of the second.
pub(super) struct StepShading {
    around: [Tensor<2>; 2],
    part: f32,
    weights: [f32; 2],
    is_on_trial: bool,
}

impl ShadingSchedule {
    /// The schedule of settings for a window from its first to its last time; nothing where they ask for
    /// none, training ends before, or all images are of one time.
    pub(super) fn new(config: &SourceConfig, span: [f32; 2]) -> Option<Self> {
        let shading = &config.shading;
        let is_due = shading.times > 1 && shading.after < config.iterations;
        (is_due && span[0] < span[1]).then_some(Self {
            times: ShadingTimes { span, count: shading.times },
            after: shading.after,
            judged_after: (shading.trial > 0).then_some(shading.after + shading.trial),
            weights: [shading.weight, shading.change_weight],
        })
    }

    /// Number of times, that of columns of logarithms.
    pub(super) fn columns(&self) -> usize {
        self.times.count
    }

    /// The part of tracked logarithms `[n, times]` that a step at a time has; nothing before it is due.
    pub(super) fn at(&self, iteration: usize, time: f32, log_gains: &Tensor<2>) -> Option<StepShading> {
        if iteration <= self.after {
            return None;
        }
        let (before, part) = self.times.at(time);
        let around = [before, before + 1].map(|column| log_gains.clone().narrow(1, column, 1));
        Some(StepShading { around, part, weights: self.weights, is_on_trial: self.is_on_trial(iteration) })
    }

    /// Whether brightness is to be judged after some iterations.
    pub(super) fn is_judged_in(&self, iterations: &RangeInclusive<usize>) -> bool {
        self.judged_after.is_some_and(|judged| iterations.contains(&judged))
    }

    /// Whether nothing is drawn with brightness yet at an iteration.
    pub(super) fn is_on_trial(&self, iteration: usize) -> bool {
        self.judged_after.is_some_and(|judged| iteration <= judged)
    }

    /// Whether brightness has been judged by an iteration.
    pub(super) fn is_judged_by(&self, iteration: usize) -> bool {
        self.judged_after.is_some_and(|judged| judged <= iteration)
    }

    /// Whether learned logarithms, row by row, change smoothly over time, as those of what moves in light do.
    /// What errors of shape and motion leave has no order in time.
    pub(super) fn is_smooth(&self, log_gains: &[f32]) -> bool {
        let (mut changes, mut squares) = (0.0, 0.0);
        for row in log_gains.chunks_exact(self.times.count) {
            let count = row.len() as f64;
            let mean = row.iter().copied().map(f64::from).sum::<f64>() / count;
            squares += row.iter().map(|&gain| (f64::from(gain) - mean).powi(2)).sum::<f64>() / count;
            let pairs = row.windows(2).map(|pair| f64::from(pair[1] - pair[0]).powi(2));
            changes += pairs.sum::<f64>() / (count - 1.0);
        }
        tracing::debug!(ratio = changes / squares, "changes of brightness over its variance");
        changes < SMOOTH_BRIGHTNESS * squares
    }

    /// What has been learned.
    pub(super) fn learned(&self, cloud: &TrainableCloud) -> Shading {
        Shading::new(self.times, cloud.shading())
    }
}

impl StepShading {
    /// Gaussians in the colours that they have at the step's time; on trial in constant ones, with the
    /// gradient that brightness would have.
    pub(super) fn applied(&self, cloud: CloudTensors) -> CloudTensors {
        let [before, after] = self.around.clone();
        let log_gains = before.clone() + (after - before).mul_scalar(self.part);
        let drawn = if self.is_on_trial { log_gains.clone() - log_gains.detach() } else { log_gains };
        let n = cloud.len();
        cloud.lit(drawn.exp().reshape([n]))
    }

    /// The loss with the cost of factors that are not one, and of their changes, in the share of the image
    /// that Gaussians cover: so much of the loss is theirs.
    pub(super) fn regularised(&self, loss: Tensor<1>, transmittance: &Tensor<2>) -> Tensor<1> {
        let ([before, after], [weight, change_weight]) = (self.around.clone(), self.weights);
        let size = (before.clone().square() + after.clone().square()).mean();
        let change = (after - before).square().mean();
        let covered = transmittance.clone().inner().mean().neg().add_scalar(1.0).autodiff();
        loss + covered * (size.mul_scalar(weight) + change.mul_scalar(change_weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adam::values;
    use crate::device::DeviceName;
    use lgs_core::GaussianCloud;

    fn schedule() -> ShadingSchedule {
        let mut config = SourceConfig::quick();
        config.shading.times = 3;
        config.shading.after = 10;
        config.shading.trial = 0;
        ShadingSchedule::new(&config, [0.0, 1.0]).expect("a schedule")
    }

    #[test]
    fn tensors_are_lit_as_clouds_are() {
        let device = DeviceName::Cpu.device().autodiff();
        let log_gains = [0.3, -0.2, 0.1, 0.0, 0.5, -0.7];
        let mut cloud = GaussianCloud::isotropic(vec![[0.1, 0.2, 0.3]; 2], 0.1, [0.2, 0.5, 0.8], 0.6);
        let tensors = CloudTensors::new(&cloud, &device);
        let columns = Tensor::<1>::from_floats(log_gains, &device).reshape([2, 3]);
        let schedule = schedule();
        assert!(schedule.at(10, 0.35, &columns).is_none(), "not due");
        let found = schedule.at(11, 0.35, &columns).expect("due").applied(tensors).cloud(0);
        Shading::new(schedule.times, log_gains.to_vec()).shade(&mut cloud, 0.35);
        assert!(found.sh.iter().zip(&cloud.sh).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {cloud:?}");
    }

    #[test]
    fn on_trial_colours_are_constant_and_brightness_has_its_gradient() {
        let device = DeviceName::Cpu.device().autodiff();
        let cloud = GaussianCloud::isotropic(vec![[0.1, 0.2, 0.3]; 2], 0.1, [0.2, 0.5, 0.8], 0.6);
        let log_gains = Tensor::<1>::from_floats([0.3, -0.2, 0.1, 0.0, 0.5, -0.7], &device).reshape([2, 3]);
        let log_gains = log_gains.require_grad();
        let on_trial = ShadingSchedule { judged_after: Some(20), ..schedule() };
        let tensors = CloudTensors::new(&cloud, &device);
        let lit = on_trial.at(20, 0.0, &log_gains).expect("due").applied(tensors);
        assert_eq!(lit.cloud(0).sh, cloud.sh);
        let gradients = lit.sh.sum().backward();
        assert!(
            values(&log_gains.grad(&gradients).expect("a gradient").reshape([6])).iter().any(|g| *g > 0.0)
        );
        assert!(on_trial.is_on_trial(20) && !on_trial.is_on_trial(21));
    }

    #[test]
    fn a_cost_pulls_factors_to_one_and_together_in_the_covered_share() {
        let device = DeviceName::Cpu.device().autodiff();
        let columns = Tensor::<1>::from_floats([0.3, -0.2, 0.1], &device).reshape([1, 3]).require_grad();
        let (schedule, loss) = (schedule(), Tensor::<1>::zeros([1], &device));
        let half_covered = Tensor::<1>::from_floats([1.0, 0.0], &device).reshape([1, 2]);
        let lit = schedule.at(11, 0.25, &columns).expect("due");
        let gradients = lit.regularised(loss, &half_covered).backward();
        let gradient = values(&columns.grad(&gradients).expect("a gradient").reshape([3]));
        let [weight, change] = schedule.weights;
        let expected = [0.5 * (0.6 * weight + change), 0.5 * (-0.4 * weight - change), 0.0];
        assert!(
            gradient.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5),
            "{gradient:?} {expected:?}"
        );
    }

    #[test]
    fn images_of_one_time_have_no_schedule() {
        assert!(ShadingSchedule::new(&SourceConfig::standard(), [0.5, 0.5]).is_none());
        assert!(ShadingSchedule::new(&SourceConfig::paper(), [0.0, 1.0]).is_none(), "constant colours");
    }

    #[test]
    fn light_changes_smoothly_and_errors_do_not() {
        let schedule = ShadingSchedule::new(&SourceConfig::quick(), [0.0, 1.0]).expect("a schedule");
        let row = |value: &dyn Fn(f32) -> f32| (0..16).map(|k| value(k as f32)).collect::<Vec<f32>>();
        let light = row(&|k| 0.3 + 0.02 * (0.4 * k).sin());
        let errors = row(&|k| 0.002 * (7.0 * k % 16.0));
        assert!(schedule.is_smooth(&light) && !schedule.is_smooth(&errors));
        assert!(!schedule.is_smooth(&[0.0; 16]), "no brightness");
        assert!(schedule.is_judged_in(&(2500..=2501)) && !schedule.is_judged_in(&(2501..=2502)));
    }
}
