//! The law of an object's shared motion: fits by rollouts, and the choice of one by forecasts.

pub(crate) mod candidate;
mod fit;
pub(crate) mod fitted_law;
pub(crate) mod generalised;
mod least_squares;
pub(crate) mod linear;
mod rigid_body;
mod rollout;
pub(crate) mod selection;
