//! Laws in generalised coordinates for objects whose particles share a rigid or an affine motion (method §4.7
//! and §5.4).

mod choice;
mod compared;
mod contact;
mod couples;
mod decomposition;
mod evidence;
mod flying;
mod forecast;
mod geometry;
#[cfg(test)]
mod geometry_tests;
mod inertia;
mod kinematics;
mod known;
mod law;
mod mixture;
mod modal;
mod nearest;
mod noise_left;
mod normal_modes;
mod observed;
mod parts;
mod placed;
mod posterior;
mod rated;
mod rigid_law;
mod search;
mod sliding;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod top_tests;
mod turning;
#[cfg(test)]
mod wind_tests;
mod window;

pub(crate) use contact::Surroundings;
pub(crate) use evidence::Evidence;
pub(crate) use known::GeneralisedLaw;
pub(crate) use law::{Errors, law_within};
pub(crate) use observed::Laws;
pub(crate) use parts::{PartOfWindow, PartSearch};
pub(crate) use search::{find_law, within_errors, within_noise};
