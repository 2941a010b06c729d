//! A network with its weights packed for products in both directions, once per network; the units of hidden
//! layers are padded to whole vectors.

use crate::layer::{Layer, Part};
use crate::layout::MlpShape;
use crate::packed::padded;

/// A network with packed weights.
#[derive(Debug)]
pub struct Mlp {
    pub(crate) shape: MlpShape,
    /// Hidden layers, then the head.
    pub(crate) layers: Vec<Layer>,
    /// Units of a hidden layer in memory.
    pub(crate) units: usize,
}

impl Mlp {
    /// Packs the weights and biases that a shape finds in the parameter vector.
    ///
    /// # Panics
    /// If a layer lies outside of `params`.
    #[must_use]
    pub fn new(shape: MlpShape, params: &[f32]) -> Self {
        let (depth, units) = (shape.layout.hidden.len(), padded(shape.layout.width()));
        let layers = (0..=depth).map(|index| Layer::new(&shape, index, params)).collect();
        Self { shape, layers, units }
    }

    /// The network with other biases of the hidden layers, `[layers][outputs]`.
    #[must_use]
    pub fn with_biases(mut self, biases: &[Vec<f32>]) -> Self {
        for (layer, bias) in self.layers.iter_mut().zip(biases) {
            layer.bias[..bias.len()].copy_from_slice(bias);
        }
        self
    }

    /// Sizes of the network.
    #[must_use]
    pub fn shape(&self) -> &MlpShape {
        &self.shape
    }

    pub(crate) fn head(&self) -> (&Layer, &Part) {
        let head = &self.layers[self.layers.len() - 1];
        (head, head.below.as_ref().expect("a network has at least one hidden layer"))
    }
}
