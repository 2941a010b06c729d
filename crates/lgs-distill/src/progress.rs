//! Progress of stage 1 as its caller sees it.

/// How far stage 1 of an object is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistillProgress {
    /// The part that runs.
    pub stage: DistillStage,
    /// Steps of this part that are done.
    pub step: usize,
    /// Steps of this part in all.
    pub steps: usize,
    /// Loss of the step, if the part has one.
    pub loss: Option<f32>,
}

/// The parts of stage 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DistillStage {
    /// Shared motion and choice of the law.
    Law,
    /// Acceleration matching of the networks.
    Matching,
    /// Rollout distillation of the networks (Eq. 7).
    Rollout,
}

/// What looks on while stage 1 of a scene runs; `()` does nothing and has time.
pub trait DistillObserver {
    /// Is told how far an object is, with its number and that of all objects.
    fn progress(&mut self, _object: usize, _objects: usize, _progress: DistillProgress) {}

    /// Whether there is time to distil all objects another time, the `round`th (from the second on), after
    /// those that are parts of others have been dissolved.
    fn has_time_for(&mut self, _round: usize) -> bool {
        true
    }
}

impl DistillObserver for () {}
