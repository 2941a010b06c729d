//! Rectangles of an image.

use std::ops::Range;

/// A rectangle of an image's pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImagePart {
    /// Columns of the image that it spans.
    pub columns: Range<usize>,
    /// Rows of the image that it spans.
    pub rows: Range<usize>,
}

impl ImagePart {
    /// Number of its pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// Copies it from an image, given row by row.
    #[must_use]
    pub fn of<T: Copy>(&self, image: &[T], width: usize) -> Vec<T> {
        let row = |y: usize| &image[y * width + self.columns.start..y * width + self.columns.end];
        self.rows.clone().flat_map(row).copied().collect()
    }

    /// The same with so many more pixels on each side, as far as an image of a size has them.
    #[must_use]
    pub fn widened(&self, by: usize, [width, height]: [usize; 2]) -> Self {
        let widened = |span: &Range<usize>, size: usize| {
            span.start.saturating_sub(by)..(span.end + by).min(size).max(span.start)
        };
        Self { columns: widened(&self.columns, width), rows: widened(&self.rows, height) }
    }

    /// The least rectangle around two, either of which may be empty.
    pub(crate) fn around(self, other: Self) -> Self {
        if self.pixels() == 0 {
            return other;
        }
        if other.pixels() == 0 {
            return self;
        }
        let both = |a: Range<usize>, b: Range<usize>| a.start.min(b.start)..a.end.max(b.end);
        Self { columns: both(self.columns, other.columns), rows: both(self.rows, other.rows) }
    }

    /// Whether the two have a pixel in common.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        let meet = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
        meet(&self.columns, &other.columns) && meet(&self.rows, &other.rows)
    }
}
