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

/// The searches for laws of stage 1, one after the other: each for all objects that those before it have left
/// open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawSearch {
    /// Laws that explain the tracks of an object, or describe them within their noise.
    WithinNoise,
    /// Laws that describe them within errors that their source makes.
    WithinErrors,
    /// Laws of parts of the window.
    OfParts,
    /// Laws of two objects together.
    OfPairs,
}

impl LawSearch {
    /// Those for laws of single objects, in their order; pairs come after them.
    pub const OF_OBJECT: [Self; 3] = [Self::WithinNoise, Self::WithinErrors, Self::OfParts];

    /// What is sought.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::WithinNoise => "laws within the noise of tracks",
            Self::WithinErrors => "laws within errors of the source",
            Self::OfParts => "laws of parts of the window by tracks",
            Self::OfPairs => "laws of pairs",
        }
    }
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

    /// Whether there is time for a search for laws, after the first one, in the `round`th time that objects
    /// are distilled. What has been found until then stays.
    fn has_time_to_seek(&mut self, _search: LawSearch, _round: usize) -> bool {
        true
    }
}

impl DistillObserver for () {}
