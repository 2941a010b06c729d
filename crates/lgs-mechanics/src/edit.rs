//! Edits of a motion.

use crate::terms::Role;

/// Scales of an edited motion (Eq. 9): α of the velocity at t = 0, β of the forces that have an energy, γ of
/// all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edit {
    /// α.
    pub velocity: f64,
    /// β.
    pub potential: f64,
    /// γ.
    pub force: f64,
}

impl Edit {
    /// The motion as it is.
    pub const NONE: Self = Self { velocity: 1.0, potential: 1.0, force: 1.0 };

    /// The factor of a term.
    pub(crate) fn factor(&self, role: Role) -> f64 {
        if role == Role::Conserves { self.potential } else { self.force }
    }
}

impl Default for Edit {
    fn default() -> Self {
        Self::NONE
    }
}
