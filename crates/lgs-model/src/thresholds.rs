//! Constants that decide something and are no settings, with their reasons.

/// One in so many Gaussians contributes to the agreement of velocity field and deformation: the mean over a
/// quarter of thousands of Gaussians stands for all, at a quarter of the cost.
pub(crate) const AGREEMENT_STRIDE: usize = 4;
