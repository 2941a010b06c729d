//! Draws for the tests.

use lgs_core::Stream;
use rand::RngExt;

/// A draw of N(0, 1) by the Box–Muller transform.
pub(crate) fn normal(stream: &mut Stream) -> f64 {
    let radius = (-2.0 * (1.0 - stream.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * stream.random::<f64>()).cos()
}
