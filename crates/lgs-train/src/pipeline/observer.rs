//! Stage 1 as training sees it: its progress, and whether the budget has time for another round.

use std::cell::RefCell;

use lgs_distill::{DistillObserver, DistillProgress, LawSearch};

use crate::budget::Budget;
use crate::checkpoint::Stage;
use crate::driver::{Control, Progress};

/// Tells the caller of training how far stage 1 is, and stage 1 what time it has.
pub(super) struct Observer<'a, 'b> {
    pub(super) budget: Option<&'a RefCell<Budget>>,
    pub(super) control: &'a mut Control<'b>,
    /// Gaussians of the source.
    pub(super) gaussians: usize,
}

impl DistillObserver for Observer<'_, '_> {
    fn progress(&mut self, object: usize, objects: usize, progress: DistillProgress) {
        let DistillProgress { step, steps, loss, .. } = progress;
        let left_secs = self.budget.map(|budget| budget.borrow().left());
        (self.control.progress)(Progress {
            stage: Stage::Distill,
            step: object * steps + step,
            steps: objects * steps,
            loss: loss.unwrap_or(0.0),
            psnr: None,
            gaussians: self.gaussians,
            left_secs,
        });
    }

    fn has_time_for(&mut self, round: usize) -> bool {
        self.budget.is_none_or(|budget| budget.borrow_mut().has_time_for_round(round))
    }

    fn has_time_to_seek(&mut self, search: LawSearch, round: usize) -> bool {
        let name = format!("{}, round {round}", search.name());
        let has_time = self.budget.is_none_or(|budget| budget.borrow_mut().has_time_for_search(&name));
        if !has_time {
            tracing::warn!("the budget leaves no time to seek {}", search.name());
        }
        has_time
    }
}
