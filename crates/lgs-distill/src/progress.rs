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

/// What looks on while stage 1 of a scene runs.
pub struct DistillObserver<'a> {
    /// Is told of an object, the number of objects, and how far the object is.
    pub progress: &'a mut dyn FnMut(usize, usize, DistillProgress),
    /// Says whether there is time to distil all objects another time, from the second time on, after those
    /// that no system follows have been dissolved.
    pub has_time_for: &'a mut dyn FnMut(usize) -> bool,
}
