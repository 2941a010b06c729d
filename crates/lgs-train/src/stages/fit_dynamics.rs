//! Stage 2, first part: every object's start and the constants of its law by least squares on the images, its
//! Gaussians fixed.

use lgs_data::dataset::Frame;
use lgs_model::{LagrangianScene, TensorFile, TensorFileError, scene_to_tensors};

use super::config::FitDynamicsConfig;
use super::newton::Newton;
use super::{StepReport, Tuning};
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};

/// The fit of a scene's dynamics.
pub struct FitDynamics<'a> {
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: &'a FitDynamicsConfig,
    step: usize,
    newton: Newton,
}

impl<'a> FitDynamics<'a> {
    /// The fit from its first step. `frames` are the training frames.
    #[must_use]
    pub fn new(
        scene: LagrangianScene,
        frames: &'a [Frame],
        config: &'a FitDynamicsConfig,
        seed: u64,
    ) -> Self {
        Self { newton: Newton::new(&scene, seed), scene, frames, config, step: 0 }
    }
}

impl Tuning for FitDynamics<'_> {
    fn stage(&self) -> Stage {
        Stage::FitDynamics
    }

    fn steps(&self) -> usize {
        self.config.steps
    }

    fn step_index(&self) -> usize {
        self.step
    }

    fn is_finished(&self) -> bool {
        self.step >= self.config.steps || self.scene.objects.is_empty() || self.frames.is_empty()
    }

    fn scene(&self) -> LagrangianScene {
        self.newton.applied_to(&self.scene)
    }

    fn step(&mut self) -> StepReport {
        let frames = spread(self.frames, self.config.frames, self.step);
        let report = self.newton.step(&self.scene, &frames);
        self.step += 1;
        report
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene, CHECKPOINT_FORMAT);
        self.newton.insert_into(&mut file);
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        self.step = step;
        self.newton.restore(file)
    }
}

/// At most `count` frames (0: all), spread evenly over time, others in every one of three rounds.
fn spread(frames: &[Frame], count: usize, round: usize) -> Vec<&Frame> {
    let mut ordered: Vec<&Frame> = frames.iter().collect();
    ordered.sort_by(|a, b| a.time.total_cmp(&b.time));
    let count = if count == 0 { ordered.len() } else { count.min(ordered.len()) };
    (0..count).map(|k| ordered[(3 * k + round % 3) * ordered.len() / (3 * count)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::Camera;

    #[test]
    fn frames_are_spread_over_time_and_differ_from_round_to_round() {
        let camera = Camera::look_at([0.0, -1.0, 0.0], [0.0; 3], 0.5, 1, 1);
        let frame = |i: usize| Frame {
            name: String::new(),
            camera_id: 0,
            camera,
            time: ((7 * i) % 12) as f32,
            rgba: vec![0; 4],
        };
        let frames: Vec<Frame> = (0..12).map(frame).collect();
        let times =
            |count, round| -> Vec<f32> { spread(&frames, count, round).iter().map(|f| f.time).collect() };
        assert_eq!(times(3, 0), [0.0, 4.0, 8.0]);
        assert_eq!(times(3, 1), [1.0, 5.0, 9.0]);
        assert_eq!(times(3, 3), times(3, 0));
        assert_eq!(times(0, 2).len(), 12);
        assert_eq!(times(50, 1), times(0, 0), "all of them, once");
    }
}
