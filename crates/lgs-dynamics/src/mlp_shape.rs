//! Where the weights of a network lie in the parameter vector.

use std::ops::Range;

/// Sizes of a network and where it starts in the parameter vector; each layer's weight `[out, in]` is
/// followed by its bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MlpShape {
    pub(crate) start: usize,
    pub(crate) inputs: usize,
    pub(crate) hidden: usize,
    pub(crate) hidden_layers: usize,
    pub(crate) outputs: usize,
}

impl MlpShape {
    pub(crate) fn layer_inputs(&self, layer: usize) -> usize {
        if layer == 0 { self.inputs } else { self.hidden }
    }

    pub(crate) fn layer_outputs(&self, layer: usize) -> usize {
        if layer == self.hidden_layers { self.outputs } else { self.hidden }
    }

    fn layer_len(&self, layer: usize) -> usize {
        self.layer_outputs(layer) * (self.layer_inputs(layer) + 1)
    }

    pub(crate) fn weight(&self, layer: usize) -> Range<usize> {
        let start = self.start + (0..layer).map(|l| self.layer_len(l)).sum::<usize>();
        start..start + self.layer_outputs(layer) * self.layer_inputs(layer)
    }

    pub(crate) fn bias(&self, layer: usize) -> Range<usize> {
        let start = self.weight(layer).end;
        start..start + self.layer_outputs(layer)
    }

    pub(crate) fn len(&self) -> usize {
        (0..=self.hidden_layers).map(|l| self.layer_len(l)).sum()
    }
}
