//! Right operands of matrix products: as they lie, or packed in panels of columns.

use crate::buffer::Buffer;

/// Columns come in multiples of this: the lanes of the widest vector.
pub(crate) const COLUMNS: usize = 16;

/// Columns of a packed panel: four of the widest vectors.
const PANEL: usize = 4 * COLUMNS;

/// `columns` rounded up to whole vectors.
pub(crate) fn padded(columns: usize) -> usize {
    columns.next_multiple_of(COLUMNS)
}

/// A right operand: panels of columns one after the other, each `[depth, width]`.
#[derive(Clone, Copy)]
pub(crate) struct Right<'a> {
    values: &'a [f32],
    depth: usize,
    columns: usize,
    panel: usize,
}

impl<'a> Right<'a> {
    /// A row-major matrix `[depth, columns]`.
    pub(crate) fn plain(values: &'a [f32], columns: usize) -> Self {
        Self { values, depth: values.len() / columns, columns, panel: columns }
    }

    /// The panels with their first columns.
    pub(crate) fn panels(self) -> impl Iterator<Item = (usize, usize, &'a [f32])> {
        (0..self.columns).step_by(self.panel).map(move |first| {
            let width = self.panel.min(self.columns - first);
            (first, width, &self.values[first * self.depth..][..self.depth * width])
        })
    }
}

/// A matrix packed for reading as a right operand.
#[derive(Debug)]
pub(crate) struct Packed {
    values: Buffer,
    depth: usize,
    columns: usize,
}

impl Packed {
    /// Packs the matrix `[depth, columns]` with the given entries, its columns padded with zeros.
    pub(crate) fn new(depth: usize, columns: usize, entry: impl Fn(usize, usize) -> f32) -> Self {
        let padded = padded(columns);
        let mut values = Buffer::zeros(depth * padded);
        for first in (0..padded).step_by(PANEL) {
            let width = PANEL.min(padded - first);
            for (at, row) in values[first * depth..][..depth * width].chunks_exact_mut(width).enumerate() {
                for (value, column) in row.iter_mut().zip(first..columns.max(first)) {
                    *value = entry(at, column);
                }
            }
        }
        Self { values, depth, columns: padded }
    }

    /// The matrix as a right operand.
    pub(crate) fn right(&self) -> Right<'_> {
        Right { values: &self.values, depth: self.depth, columns: self.columns, panel: PANEL }
    }

    /// The padded row of a matrix of depth 1.
    pub(crate) fn row(&self) -> &[f32] {
        assert_eq!(self.depth, 1, "depth of a row");
        &self.values
    }
}
