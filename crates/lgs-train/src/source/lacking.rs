//! What an image shows and the model lacks, block by block.
//!
//! The signed difference of truth and drawing is averaged over a block and those around it: texture that is
//! not yet sharp averages out, a thing that is absent does not.

use lgs_core::{Camera, Image};

use crate::thresholds::{BLOCKS_PER_WIDTH, LACKING};

/// Blocks of an image and of what a model draws in its place.
pub(super) struct Blocks {
    camera: Camera,
    /// Side of a block, pixels.
    side: usize,
    /// Blocks per row and column.
    size: [usize; 2],
    /// Mean colour of the truth.
    truth: Vec<[f32; 3]>,
    /// Mean difference of a block and its neighbours, its largest channel.
    lack: Vec<f32>,
}

impl Blocks {
    /// Compares a drawing with the truth of a camera.
    pub(super) fn new(camera: Camera, truth: &Image, drawn: &[[f32; 3]]) -> Self {
        let side = (camera.width as usize / BLOCKS_PER_WIDTH).max(1);
        let [width, height] = [camera.width, camera.height].map(|pixels| pixels as usize);
        let size = [width.div_ceil(side), height.div_ceil(side)];
        let mut sums = vec![([0.0; 3], [0.0; 3], 0.0); size[0] * size[1]];
        for (i, (truth, drawn)) in truth.pixels.iter().zip(drawn).enumerate() {
            let (colors, differences, count) = &mut sums[i / width / side * size[0] + i % width / side];
            for c in 0..3 {
                colors[c] += truth[c];
                differences[c] += truth[c] - drawn[c].clamp(0.0, 1.0);
            }
            *count += 1.0;
        }
        let lack = (0..sums.len()).map(|block| {
            let (mut sum, mut count) = ([0.0_f32; 3], 0.0);
            for near in around(block, size) {
                (0..3).for_each(|c| sum[c] += sums[near].1[c]);
                count += sums[near].2;
            }
            sum.iter().fold(0.0_f32, |most, s| most.max(s.abs())) / count
        });
        Self {
            lack: lack.collect(),
            truth: sums.iter().map(|(colors, _, count)| colors.map(|c| c / count)).collect(),
            camera,
            side,
            size,
        }
    }

    /// The blocks that lack something.
    pub(super) fn lacking(&self) -> Vec<usize> {
        (0..self.lack.len()).filter(|&block| self.is_lacking(block)).collect()
    }

    /// Whether the drawing differs from the truth in a block by more than its texture.
    pub(super) fn is_lacking(&self, block: usize) -> bool {
        self.lack[block] > LACKING
    }

    /// The colour of the truth in a block.
    pub(super) fn color(&self, block: usize) -> [f32; 3] {
        self.truth[block]
    }

    /// The block that a world point is seen in; nothing out of view.
    pub(super) fn seen_in(&self, point: [f32; 3]) -> Option<usize> {
        let ([x, y], depth) = self.camera.pixel_from_world(point);
        let inside = x >= 0.0 && y >= 0.0 && x < self.camera.width as f32 && y < self.camera.height as f32;
        (depth > self.camera.near && inside)
            .then(|| y as usize / self.side * self.size[0] + x as usize / self.side)
    }

    /// The centre of projection and the unit direction of the ray through the middle of a block.
    pub(super) fn ray(&self, block: usize) -> ([f32; 3], [f32; 3]) {
        let middle = |index: usize| (index as f32 + 0.5) * self.side as f32;
        let pixel = [middle(block % self.size[0]), middle(block / self.size[0])];
        (self.camera.center_in_world(), self.camera.ray_direction_in_world(pixel))
    }

    /// The width, world units, that a block covers at a point's depth.
    pub(super) fn width_at(&self, point: [f32; 3]) -> f32 {
        self.camera.pixel_from_world(point).1 * self.side as f32 / self.camera.fx
    }
}

/// A block and its neighbours.
fn around(block: usize, [columns, rows]: [usize; 2]) -> impl Iterator<Item = usize> {
    let (x, y) = (block % columns, block / columns);
    let reach = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    reach(y, rows).flat_map(move |y| reach(x, columns).map(move |x| y * columns + x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_thing_is_lacking_and_blurred_texture_is_not() {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.7, 80, 60);
        let mut truth = Image { width: 80, height: 60, pixels: vec![[1.0; 3]; 80 * 60] };
        let mut drawn = truth.pixels.clone();
        for (i, (truth, drawn)) in truth.pixels.iter_mut().zip(&mut drawn).enumerate() {
            let (x, y) = (i % 80, i / 80);
            if x < 30 {
                let checker = (x + y) % 2;
                (*truth, *drawn) = ([checker as f32; 3], [0.5; 3]);
            } else if (50..65).contains(&x) && (20..40).contains(&y) {
                *truth = [0.2, 0.2, 0.9];
            }
        }
        let blocks = Blocks::new(camera, &truth, &drawn);
        let found = blocks.lacking();
        let columns = blocks.size[0];
        assert!(!found.is_empty());
        for block in found {
            let x = (block % columns + 1) * blocks.side;
            assert!((45..70).contains(&x), "{x}");
        }
        let (eye, direction) = blocks.ray(columns + 3);
        let point: [f32; 3] = std::array::from_fn(|i| eye[i] + 4.0 * direction[i]);
        assert_eq!(blocks.seen_in(point), Some(columns + 3), "a ray leads back to its block");
        assert_eq!(blocks.seen_in([0.0, -5.0, 0.0]), None, "behind the camera");
    }
}
