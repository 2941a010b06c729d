//! Networks that learn what a linear law leaves of an object's motion, or all of it.

mod descent;
pub(crate) mod force_ratio;
mod matching;
pub(crate) mod per_particle;
mod rollouts;
pub(crate) mod training;
pub(crate) mod velocity_field;
