//! Terms: the summands of a law, each a potential energy or a generalised force.
//!
//! A kind of term is a value that implements [`TermKind`], alone in a file or with kinds whose formula it
//! shares; the list below names it.
//! It acts on a *space*: a vector `y` with velocity `w = ẏ` that coordinates offer, such as the centre of a
//! body, the angle of a hinge, the amplitudes of modes or the separation of two points. All forces are per
//! unit of mass (or of whatever inertia the coordinates are measured in), so they are accelerations.
//!
//! Energies and forces are autonomous: no signature takes a time.

mod central;
mod constant;
mod damping;
mod drag;
mod flow;
mod fourier;
mod gyroscopic;
mod kind;
mod placed;
mod polynomial;
mod quadratic;
mod quartic;
mod rest_length;
mod spring;
#[cfg(test)]
mod tests;

pub use crate::parameter::{Entry, Parameter, Quantity, Scales, Space, Unit};
pub(crate) use kind::linear_entries;
pub use kind::{At, Block, Derivatives, Label, Role, TermKind};
pub use placed::Term;

/// Every kind of term, in the order in which files and tables name them.
#[rustfmt::skip]
static KINDS: &[&dyn TermKind] = &[
    &constant::FIELD,
    &spring::ISOTROPIC, &spring::DIAGONAL, &spring::AXIAL, &spring::FULL, &spring::POSITIVE,
    &rest_length::REST_LENGTH,
    &quartic::RADIAL, &quartic::AXIS,
    &polynomial::CUBIC, &polynomial::QUARTIC,
    &central::INVERSE_SQUARE, &central::LOGARITHM, &central::POWER,
    &fourier::FIRST, &fourier::SECOND,
    &drag::LINEAR,
    &drag::QUADRATIC,
    &damping::DIAGONAL, &damping::POSITIVE,
    &drag::DRY,
    &gyroscopic::GYROSCOPIC,
    &constant::DRIVE,
    &flow::WIND, &flow::SWIRL, &flow::SELF_EXCITATION,
];

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
