//! Sizes of networks, and where their parameters lie in the flat vector.

use std::ops::Range;

/// One named array inside the flat parameter vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParamRange {
    /// Name of the array in files.
    pub name: String,
    /// `[outputs, inputs]` for a weight, `[outputs]` for a bias.
    pub shape: Vec<usize>,
    /// Place of the array in the vector.
    pub range: Range<usize>,
}

/// A linear layer's place: weight `[outputs, inputs]`, row by row, then bias `[outputs]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinearRange {
    /// Number of inputs.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Index of the weight's first float.
    pub weight: usize,
    /// Index of the bias's first float.
    pub bias: usize,
}

impl LinearRange {
    /// A layer from float `len` on; moves `len` to its end.
    pub fn take(inputs: usize, outputs: usize, len: &mut usize) -> Self {
        let range = Self { inputs, outputs, weight: *len, bias: *len + inputs * outputs };
        *len = range.end();
        range
    }

    /// Weight and bias.
    #[must_use]
    pub fn range(&self) -> Range<usize> {
        self.weight..self.end()
    }

    /// The weight alone.
    #[must_use]
    pub fn weight_range(&self) -> Range<usize> {
        self.weight..self.bias
    }

    /// The bias alone.
    #[must_use]
    pub fn bias_range(&self) -> Range<usize> {
        self.bias..self.end()
    }

    /// Index behind the last float.
    #[must_use]
    pub fn end(&self) -> usize {
        self.bias + self.outputs
    }

    /// The weight and the bias as `NAME.weight` and `NAME.bias`.
    #[must_use]
    pub fn params(&self, name: &str) -> [ParamRange; 2] {
        [
            ParamRange {
                name: format!("{name}.weight"),
                shape: vec![self.outputs, self.inputs],
                range: self.weight_range(),
            },
            ParamRange { name: format!("{name}.bias"), shape: vec![self.outputs], range: self.bias_range() },
        ]
    }
}

/// The places of layers that have names.
pub trait NamedLayers {
    /// Every layer with its name.
    fn linears(&self) -> Vec<(String, &LinearRange)>;

    /// Names, shapes and ranges of all parameters.
    fn params(&self) -> Vec<ParamRange> {
        self.linears().into_iter().flat_map(|(name, layer)| layer.params(&name)).collect()
    }
}

/// Sizes of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MlpSizes {
    /// Features that enter.
    pub inputs: usize,
    /// Hidden layers, at least one.
    pub depth: usize,
    /// Units of each hidden layer.
    pub width: usize,
    /// Features that come out.
    pub outputs: usize,
    /// The inputs enter again behind this hidden layer, counted from 0; `depth` or more: never.
    pub skip_layer: usize,
}

impl MlpSizes {
    /// A `skip_layer` that no network has.
    pub const NO_SKIP: usize = usize::MAX - 1;
}

/// The places of a network's layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MlpLayout {
    /// Hidden layers. Where one reads inputs, their columns come before those of the layer below.
    pub hidden: Vec<LinearRange>,
    /// The output layer.
    pub head: LinearRange,
    skip_layer: usize,
}

impl MlpLayout {
    /// A network from float `len` on; moves `len` to its end.
    pub fn new(sizes: MlpSizes, len: &mut usize) -> Self {
        let MlpSizes { inputs, depth, width, outputs, skip_layer } = sizes;
        let hidden = (0..depth).map(|layer| {
            let below = if layer == 0 { 0 } else { width };
            let read = if reads_inputs(layer, skip_layer) { inputs } else { 0 };
            LinearRange::take(below + read, width, len)
        });
        Self { hidden: hidden.collect(), head: LinearRange::take(width, outputs, len), skip_layer }
    }

    /// Whether a hidden layer reads the network's inputs.
    #[must_use]
    pub fn reads_inputs(&self, layer: usize) -> bool {
        reads_inputs(layer, self.skip_layer)
    }

    /// All layers in the order of their parameters.
    pub fn linears(&self) -> impl Iterator<Item = &LinearRange> {
        self.hidden.iter().chain([&self.head])
    }

    /// All layers as `layer.0`, `layer.1`, …, `head`.
    pub fn named_linears(&self) -> impl Iterator<Item = (String, &LinearRange)> {
        let hidden = self.hidden.iter().enumerate().map(|(i, layer)| (format!("layer.{i}"), layer));
        hidden.chain([("head".to_owned(), &self.head)])
    }

    /// Index behind the last float.
    #[must_use]
    pub fn end(&self) -> usize {
        self.head.end()
    }

    /// Units of the hidden layers.
    pub(crate) fn width(&self) -> usize {
        self.head.inputs
    }
}

fn reads_inputs(layer: usize, skip_layer: usize) -> bool {
    layer == 0 || layer == skip_layer + 1
}

/// The function between layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// `max(z, 0)`.
    Relu,
    /// `z / (1 + exp(−z))`.
    Silu,
}

/// A network without its parameters' values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MlpShape {
    /// The layers.
    pub layout: MlpLayout,
    /// Columns, at least one, that each input meets in the layers that read inputs. Columns that none meets
    /// take no part: what belongs to them can enter through the biases.
    pub inputs: Vec<Range<usize>>,
    /// The function behind hidden layers.
    pub activation: Activation,
}

impl MlpShape {
    /// A network whose inputs come as one.
    ///
    /// # Panics
    /// If there is no hidden layer.
    #[must_use]
    pub fn new(layout: MlpLayout, activation: Activation) -> Self {
        let all = 0..layout.hidden[0].inputs;
        Self { layout, inputs: vec![all], activation }
    }
}
