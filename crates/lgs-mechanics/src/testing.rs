//! Draws for the tests.

use lgs_core::Stream;
use rand_distr::{Distribution, StandardNormal};

/// A draw of N(0, 1).
pub(crate) fn normal(stream: &mut Stream) -> f64 {
    StandardNormal.sample(stream)
}
