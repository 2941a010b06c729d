//! The form of a law, before any constant is known.

use super::linear::terms::Terms;

/// A law's form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    /// Its terms.
    pub(crate) terms: Terms,
    /// Whether the object is under the rigid constraint (Eq. 6 with a shared support), or its particles move
    /// independently.
    pub(crate) rigid_constraint: bool,
}
