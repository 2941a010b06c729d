//! Terms: the summands of a law, each a potential energy or a generalised force.
//!
//! A kind of term is a value that implements [`TermKind`] in a file of its own, and one line in the list
//! below. It acts on a *space*: a vector `y` with velocity `w = ẏ` that coordinates offer, such as the centre
//! of a body, the angle of a hinge, the amplitudes of modes or the separation of two points. All forces are
//! per unit of mass (or of whatever inertia the coordinates are measured in), so they are accelerations.
//!
//! Energies and forces are autonomous: no signature takes a time.

mod kind;
mod parameter;
mod placed;
mod quadratic;
#[cfg(test)]
mod tests;

pub use kind::{At, Block, Derivatives, Role, TermKind};
pub use parameter::{Entry, Parameter, Quantity, Scales, Space, Unit};
pub use placed::Term;

/// Declares the modules of all kinds and lists their values in the order in which files and tables name them.
macro_rules! kinds {
    ($($module:ident: $($value:ident),+;)*) => {
        $(mod $module;)*
        /// Every kind of term.
        static KINDS: &[&dyn TermKind] = &[$($(&$module::$value),+),*];
    };
}

kinds! {
    uniform_field: UNIFORM_FIELD;
    spring: ISOTROPIC, AXIAL, FULL, POSITIVE;
    rest_length: REST_LENGTH;
    quartic: RADIAL, AXIS;
    polynomial: CUBIC, QUARTIC;
    central: INVERSE_SQUARE, LOGARITHM, POWER;
    fourier: FIRST, SECOND;
    linear_drag: LINEAR_DRAG;
    quadratic_drag: QUADRATIC_DRAG;
    damping: DAMPING;
    dry_friction: DRY_FRICTION;
    gyroscopic: GYROSCOPIC;
    constant_drive: CONSTANT_DRIVE;
}

/// Every kind of term, in a fixed order.
#[must_use]
pub fn kinds() -> &'static [&'static dyn TermKind] {
    KINDS
}

/// The kind with this name in files; `None` if there is none.
#[must_use]
pub fn kind(name: &str) -> Option<&'static dyn TermKind> {
    KINDS.iter().copied().find(|kind| kind.name() == name)
}
