//! Networks that learn what a linear law leaves of an object's motion, or all of it.

mod descent;
mod matching;
mod rollouts;
pub(crate) mod training;
pub(crate) mod velocity_field;
