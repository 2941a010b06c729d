//! Training images at the widths that a schedule asks for: in full, or halved some times.

use std::sync::Arc;

use lgs_data::dataset::Frame;
use rayon::prelude::*;

/// Training frames, with those of one coarse level in memory.
pub(super) struct ImageLevels<'a> {
    full: &'a [Frame],
    coarse: (usize, Arc<[Frame]>),
}

/// The frames of a level.
pub(super) enum Level<'a> {
    Full(&'a [Frame]),
    Coarse(Arc<[Frame]>),
}

impl std::ops::Deref for Level<'_> {
    type Target = [Frame];

    fn deref(&self) -> &[Frame] {
        match self {
            Self::Full(frames) => frames,
            Self::Coarse(frames) => frames,
        }
    }
}

impl<'a> ImageLevels<'a> {
    pub(super) fn new(full: &'a [Frame]) -> Self {
        Self { full, coarse: (0, Arc::new([])) }
    }

    /// The frames with their width halved `level` times.
    pub(super) fn level(&mut self, level: usize) -> Level<'a> {
        if level == 0 {
            self.coarse = (0, Arc::new([]));
            return Level::Full(self.full);
        }
        if self.coarse.0 != level {
            let smaller = |frame: &Frame| frame.resized((frame.camera.width >> level).max(1));
            self.coarse = (level, self.full.par_iter().map(smaller).collect::<Vec<_>>().into());
        }
        Level::Coarse(Arc::clone(&self.coarse.1))
    }
}
