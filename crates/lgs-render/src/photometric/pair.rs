//! Two images of one size, as interleaved rows.

/// Floats of a pixel.
pub(super) const CHANNELS: usize = 3;

/// Two images as interleaved rows.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a> {
    pub(super) a: &'a [f32],
    pub(super) b: &'a [f32],
    /// Floats of a row: three times the width.
    pub row: usize,
    pub height: usize,
}

impl<'a> Pair<'a> {
    pub(super) fn new(a: &'a [[f32; 3]], b: &'a [[f32; 3]], [width, height]: [usize; 2]) -> Self {
        assert_eq!(a.len(), width * height, "pixels of the first image");
        assert_eq!(b.len(), width * height, "pixels of the second image");
        Self { a: a.as_flattened(), b: b.as_flattened(), row: 3 * width, height }
    }

    /// A row of both images.
    #[inline(always)]
    pub(super) fn at(&self, y: usize) -> [&'a [f32]; 2] {
        let floats = y * self.row..(y + 1) * self.row;
        [&self.a[floats.clone()], &self.b[floats]]
    }
}
