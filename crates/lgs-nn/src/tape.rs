//! Activations that a forward pass keeps for its backward pass, and the arrays that calls share.

use crate::buffer::Buffer;
use crate::layout::Activation;
use crate::mlp::Mlp;
use crate::packed::padded;
use std::ops::Range;

/// Extent of what a forward pass keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The result.
    Result,
    /// The activations that the backward pass needs as well.
    Tape,
}

/// The activations of one hidden layer, `[rows, units]` each; empty where the backward pass needs none.
#[derive(Debug)]
pub(crate) struct LayerTape {
    /// `φ(z)`.
    pub(crate) h: Buffer,
    /// `φ'(z)`.
    pub(crate) slope: Buffer,
    /// First `φ''(z)`, then `φ''(z) ⊙ g`, then the cotangent of `z`.
    pub(crate) curvature: Buffer,
    /// `φ'(z) ⊙ g`.
    pub(crate) e: Buffer,
}

/// Activations of one block, kept from a forward pass to the backward pass behind it.
#[derive(Debug)]
pub struct Tape {
    pub(crate) rows: usize,
    pub(crate) layers: Vec<LayerTape>,
}

impl Tape {
    /// Arrays for the value of a network at a number of rows.
    #[must_use]
    pub fn new(mlp: &Mlp, rows: usize) -> Self {
        let slope = if mlp.shape.activation == Activation::Relu { 0 } else { rows };
        Self::sized(mlp, [rows, slope, 0])
    }

    /// As [`Tape::new`], also for the gradient of the only output by the inputs.
    #[must_use]
    pub fn with_curvature(mlp: &Mlp, rows: usize) -> Self {
        Self::sized(mlp, [rows; 3])
    }

    fn sized(mlp: &Mlp, [rows, slope, curvature]: [usize; 3]) -> Self {
        let buffer = |rows: usize| Buffer::zeros(rows * mlp.units);
        let layer = || LayerTape {
            h: buffer(rows),
            slope: buffer(slope),
            curvature: buffer(curvature),
            e: buffer(curvature),
        };
        Self { rows, layers: mlp.shape.layout.hidden.iter().map(|_| layer()).collect() }
    }
}

/// Arrays that calls share and that carry nothing from one to the next.
#[derive(Debug)]
pub struct Scratch {
    /// `[rows, units]` each.
    pub(crate) hidden: [Buffer; 2],
    /// A few values per row, `[rows, few]`.
    pub(crate) narrow: Buffer,
}

impl Scratch {
    /// Arrays for calls of a network with at most `rows` rows.
    #[must_use]
    pub fn new(mlp: &Mlp, rows: usize) -> Self {
        let layout = &mlp.shape.layout;
        let inputs = mlp.shape.inputs.iter().map(Range::len).max().unwrap_or(0);
        let narrow = Buffer::zeros(rows * padded(inputs.max(layout.head.outputs)));
        Self { hidden: [(); 2].map(|()| Buffer::zeros(rows * mlp.units)), narrow }
    }
}

/// The arrays of one call: activations that outlive it, and those that do not.
#[derive(Debug)]
pub struct CallArrays<'a> {
    /// Activations of the block.
    pub tape: &'a mut Tape,
    /// Arrays shared by calls.
    pub scratch: &'a mut Scratch,
}
