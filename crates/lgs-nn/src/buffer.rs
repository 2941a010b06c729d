//! Zeroed arrays that begin at a cache line.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, which is also the widest vector: a vector that straddles two lines costs two
/// accesses.
const LINE: usize = 64;

/// An array of f32 whose first value lies at the start of a cache line.
#[derive(Debug)]
pub(crate) struct Buffer {
    data: Vec<f32>,
    start: usize,
    len: usize,
}

impl Buffer {
    /// `len` zeros.
    pub(crate) fn zeros(len: usize) -> Self {
        let spare = LINE / size_of::<f32>();
        let data = vec![0.0_f32; len + spare];
        // Where alignment can't be told the array is merely slower.
        let start = data.as_ptr().align_offset(LINE).min(spare);
        Self { data, start, len }
    }
}

impl Deref for Buffer {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.data[self.start..self.start + self.len]
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.data[self.start..self.start + self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_begin_at_a_line_and_have_their_length() {
        for len in [0, 1, 16, 1000] {
            let buffer = Buffer::zeros(len);
            assert_eq!(buffer.len(), len);
            assert!(buffer.iter().all(|&v| v == 0.0));
            assert_eq!(buffer.as_ptr() as usize % LINE, 0);
        }
    }
}
