//! The colour that a step composites images and Gaussians over.

use lgs_core::stream;
use lgs_data::dataset::{Dataset, Frame};
use rand::RngExt;

/// The colour behind everything: the dataset's or, where images have transparent pixels, for some of the
/// steps a random one, behind which nothing of the background's colour can hide.
pub(super) struct Background {
    color: [f32; 3],
    /// Share of the steps with a random colour.
    random_share: f32,
    seed: u64,
}

impl Background {
    /// The background of a dataset's training images, with the share of random ones that is asked for.
    pub(super) fn new(dataset: &Dataset, random_share: f32, seed: u64) -> Self {
        let is_transparent = dataset.split("train").iter().any(Frame::has_alpha);
        let random_share = if is_transparent { random_share } else { 0.0 };
        Self { color: dataset.background, random_share, seed }
    }

    /// The colour of a step.
    pub(super) fn at(&self, step: usize) -> [f32; 3] {
        if self.random_share == 0.0 {
            return self.color;
        }
        let mut random = stream(self.seed, "background", step as u64);
        if random.random_range(0.0..1.0) < self.random_share {
            std::array::from_fn(|_| random.random_range(0.0..1.0))
        } else {
            self.color
        }
    }
}
