//! Constants that decide something in this crate, each with its reason.

/// Square of the Newton step of an alignment, squared radians, after which one more leaves rounding error of
/// single precision: it squares the error that is left.
pub(crate) const CONVERGED: f64 = 1e-10;

/// Newton steps of an alignment before a lane goes to the scalar path: a step of a rollout turns a support by
/// a fraction of a radian, from which four leave rounding error.
pub(crate) const ALIGNMENT_ITERATIONS: usize = 6;

/// As [`CONVERGED`], of alignments on devices.
#[cfg(feature = "gpu")]
pub(crate) const CONVERGED_F32: f32 = 1e-10;

/// As [`ALIGNMENT_ITERATIONS`], on devices, where no scalar path with more of them follows.
#[cfg(feature = "gpu")]
pub(crate) const ALIGNMENT_ITERATIONS_F32: u32 = 12;

/// Square of the last Newton step on a device, squared radians, with which a support still counts as fitted:
/// single precision moves those of a thousandth of their length in width by a hundredth of a radian about it,
/// which is a hundred-thousandth of the length.
#[cfg(feature = "gpu")]
pub(crate) const NEARLY_CONVERGED: f32 = 1e-4;

/// Largest entry of a support's matrix that is one of squares of lengths: single precision holds its inverse
/// too.
#[cfg(feature = "gpu")]
pub(crate) const LEAST_SCALE: f32 = 1e-30;

/// Sweeps of Jacobi rotations over a 4×4 matrix: they converge quadratically, and five leave rounding error.
#[cfg(feature = "gpu")]
pub(crate) const SWEEPS: u32 = 8;

/// Entry beside the diagonal of a matrix of size one that is zero to single precision.
#[cfg(feature = "gpu")]
pub(crate) const LEAST_OFF_DIAGONAL: f32 = 1e-9;

/// Difference of two eigenvalues, over the greatest, below which a support leaves the rotation between their
/// vectors open: ten times [`lgs_core::thresholds::LEAST_DETERMINANT`], as a support has no curvature below
/// that, and rounding adds to it.
#[cfg(feature = "gpu")]
pub(crate) const EIGENVALUE_GAP: f32 = 1e-5;

/// Square of the cosine of half the smallest rotation that a support leaves open, below which it is half a
/// turn to single precision, about any axis.
#[cfg(feature = "gpu")]
pub(crate) const LEAST_PROJECTION: f32 = 1e-6;
