//! Constants that decide something in this crate, each with its reason.

/// Square of the Newton step of an alignment, squared radians, after which one more leaves rounding error of
/// single precision: it squares the error that is left.
pub(crate) const CONVERGED: f64 = 1e-10;

/// Newton steps of an alignment before a lane goes to the scalar path: a step of a rollout turns a support by
/// a fraction of a radian, from which four leave rounding error.
pub(crate) const ALIGNMENT_ITERATIONS: usize = 6;
