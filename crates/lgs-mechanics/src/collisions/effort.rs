//! How long a contact is sought.

use crate::thresholds::MOST_CONTACT_STEPS;
use std::cell::Cell;
use std::rc::Rc;

/// The steps that motions through impacts may still take while a body's contact is sought. A body that no law
/// describes has as many supposed impacts and planes as its track has wiggles, and each fit rolls its motion
/// out more than a thousand times; what has been found until then stands.
#[derive(Clone, Debug)]
pub(super) struct Effort(Rc<Cell<f64>>);

impl Effort {
    /// Takes some steps, if there are any left.
    pub(super) fn spend(&self, steps: f64) -> Option<()> {
        let left = self.0.get();
        self.0.set(left - steps);
        (left > 0.0).then_some(())
    }
}

impl Default for Effort {
    fn default() -> Self {
        Self(Rc::new(Cell::new(MOST_CONTACT_STEPS)))
    }
}
