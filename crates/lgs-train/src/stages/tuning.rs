//! What the two photometric stages have in common, and all that the loop that drives them needs.

use lgs_model::{LagrangianScene, TensorFile, TensorFileError};

use super::StepReport;
use crate::checkpoint::Stage;

/// A stage that descends a loss on the images step by step.
pub trait Tuning {
    /// Which one.
    fn stage(&self) -> Stage;

    /// Steps in all.
    fn steps(&self) -> usize;

    /// Steps done.
    fn step_index(&self) -> usize;

    /// Whether all steps are done; so they are where there is nothing to tune or nothing to tune against.
    fn is_finished(&self) -> bool;

    /// One optimiser step.
    fn step(&mut self) -> StepReport;

    /// The scene with what has been learned so far.
    fn scene(&self) -> LagrangianScene;

    /// What a resumed run needs: the scene that it makes the stage from, and the state that [`Self::restore`]
    /// reads.
    fn checkpoint(&self) -> TensorFile;

    /// Continues from a checkpoint of `step` steps, whose scene this stage was made from.
    ///
    /// # Errors
    /// If a tensor is absent or does not fit the scene.
    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError>;
}
