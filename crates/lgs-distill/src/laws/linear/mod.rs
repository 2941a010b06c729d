//! Laws linear in position and velocity: their terms, steps, fits of accelerations, and place in a system.

pub(crate) mod acceleration_match;
pub(crate) mod law;
pub(crate) mod part;
pub(crate) mod system;
pub(crate) mod terms;
