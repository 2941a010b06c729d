//! Parameters before training.

use crate::layout::LinearRange;
use lgs_core::Stream;
use rand::RngExt;

/// Draws the weights and biases of layers uniformly in ±1/√inputs, layer by layer, each weight before its
/// bias.
///
/// # Panics
/// If a layer lies outside of `params`.
pub fn init_uniform<'a>(
    layers: impl IntoIterator<Item = &'a LinearRange>,
    params: &mut [f32],
    random: &mut Stream,
) {
    for layer in layers {
        let bound = 1.0 / (layer.inputs as f32).sqrt();
        params[layer.range()].fill_with(|| random.random_range(-bound..bound));
    }
}
