//! Whether a motion follows what moves. A network learns to move something by small steps of its window; what
//! turns or flies too fast for the pace at which the window grows is blurred instead, and stays so: the error
//! of the images is then far above that of the start, and does not fall. Training begins anew in that case,
//! with a window that grows more slowly.

use std::ops::{Range, RangeInclusive};

use burn::tensor::{Device, Tensor};
use lgs_model::{TensorFile, TensorFileError};

use super::config::SourceConfig;
use crate::adam::values;
use crate::thresholds::{
    FAR_ABOVE_START, JUDGED_AFTER, MOST_LEFT_IF_FOLLOWED, PART_OF_WARMUP, SEEN_AGAIN_AFTER, SHARE_OF_MEANS,
};

/// Name of the sums in a checkpoint.
const SUMS: &str = "following.sums";

/// Errors of the images of three stretches of a training: the end of the warm-up, some iterations after the
/// window has become whole, and as many some time later.
pub(super) struct Following {
    stretches: [Range<usize>; 3],
    /// Sum of the mean squared errors of each stretch's images.
    sums: [Option<Tensor<1>>; 3],
    counts: [usize; 3],
}

impl Following {
    /// For a schedule; nothing where its window is whole at once, or no other attempt would follow.
    pub(super) fn new(config: &SourceConfig) -> Option<Self> {
        if config.slower_growth < 2 || config.window_steps < 2 || config.warmup_iterations == 0 {
            return None;
        }
        let share = |part: f64| (part * config.iterations as f64) as usize;
        // Coarse images have smaller errors.
        let whole = config.end_of_growth().max(config.end_of_coarse_images());
        let before = |end: usize| end.saturating_sub(share(SHARE_OF_MEANS)) + 1..end + 1;
        let (again, judged) = (whole + share(SEEN_AGAIN_AFTER), whole + share(JUDGED_AFTER));
        let warmup = config.warmup_iterations;
        let start = warmup - (PART_OF_WARMUP * warmup as f64) as usize..warmup;
        let stretches = [start, before(again), before(judged)];
        (judged < config.iterations).then_some(Self { stretches, sums: [None, None, None], counts: [0; 3] })
    }

    /// Learns the mean squared error `[1]` of the image of an iteration.
    pub(super) fn observe(&mut self, iteration: usize, mse: &Tensor<1>) {
        let Some(index) = self.stretches.iter().position(|stretch| stretch.contains(&iteration)) else {
            return;
        };
        self.counts[index] += 1;
        self.sums[index] = Some(match self.sums[index].take() {
            Some(sum) => sum + mse.clone(),
            None => mse.clone(),
        });
    }

    /// Whether it is to be judged after some iterations.
    pub(super) fn is_judged_in(&self, iterations: &RangeInclusive<usize>) -> bool {
        iterations.contains(&(self.stretches[2].end - 1))
    }

    /// Whether the images say that what moves is followed; they do where they say nothing.
    pub(super) fn is_followed(&self) -> bool {
        let [start, before, now] = self.means();
        tracing::debug!(start, before, now, "errors of images before and after the window became whole");
        !(now > FAR_ABOVE_START * start && now > MOST_LEFT_IF_FOLLOWED * before)
    }

    /// Mean errors of the stretches; not a number for those without images.
    fn means(&self) -> [f64; 3] {
        let sums = self.on_host();
        std::array::from_fn(|i| f64::from(sums[i]) / self.counts[i] as f64)
    }

    fn on_host(&self) -> [f32; 3] {
        self.sums.each_ref().map(|sum| sum.as_ref().map_or(0.0, |sum| values(sum)[0]))
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        file.insert(SUMS, &[3], &self.on_host());
        file.set_metadata("following.counts", format!("{:?}", self.counts));
    }

    /// Whether a checkpoint was written before it was judged.
    pub(super) fn is_in(&self, file: &TensorFile) -> bool {
        file.names().any(|name| name == SUMS)
    }

    pub(super) fn restore(&mut self, file: &TensorFile, device: &Device) -> Result<(), TensorFileError> {
        let sums = file.values(SUMS)?.1;
        self.counts = file.metadata_json("following.counts")?;
        if sums.len() != self.sums.len() {
            return Err(file.field(SUMS, "three numbers", format!("{} numbers", sums.len())));
        }
        let sum = |i: usize| (self.counts[i] > 0).then(|| Tensor::from_floats([sums[i]], device));
        self.sums = std::array::from_fn(sum);
        Ok(())
    }
}
