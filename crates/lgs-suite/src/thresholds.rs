//! The constant that decides what the tables of a suite say.

/// Change of PSNR up to which a variant costs nothing, dB: about one per cent of the mean squared error,
/// which nobody sees.
pub(crate) const NO_CHANGE: f64 = 0.05;
