//! Figures of the motion itself.
//!
//! Each module computes one: [`cycle`] there and back, [`extent`] in pixels and in space, [`trajectory`]
//! against the truth, [`energy`], [`fall`] times under scaled potentials, [`force`] against potential,
//! [`potential`] against the true one. Sums are in f64 and in the order of Gaussians and times.

pub mod cycle;
pub mod edited;
pub mod energy;
pub mod extent;
pub mod fall;
pub mod force;
mod numbers;
pub mod potential;
pub mod trajectory;
mod true_force;
mod truth;

pub(crate) use numbers::{
    centroid, distance, length, long_steps, mean, most_common, percentile, window_steps,
};
pub use truth::Truth;
