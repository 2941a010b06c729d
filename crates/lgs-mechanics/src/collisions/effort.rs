//! How long a contact is sought.

use super::thresholds::MOST_CONTACT_STEPS;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_of_one_body_share_their_steps() {
        let first = Effort::default();
        let second = first.clone();
        assert!(first.spend(MOST_CONTACT_STEPS - 1.0).is_some() && second.spend(2.0).is_some());
        assert!(first.spend(1.0).is_none() && second.spend(1.0).is_none());
        assert!(Effort::default().spend(1.0).is_some(), "another body has its own");
    }
}
