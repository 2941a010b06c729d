//! The motion of an object's particles, denoised: one pose per sample for all of them where they share one,
//! and smooth functions of time.

pub(crate) mod curve;
pub(crate) mod denoise;
pub(crate) mod object_motion;
pub(crate) mod paths;
pub(crate) mod pose;
pub(crate) mod procrustes;
mod scales;
pub(crate) mod shared_motion;
pub(crate) mod smooth_motion;
