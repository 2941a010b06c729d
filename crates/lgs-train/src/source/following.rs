//! Whether a motion follows what moves. A network learns to move something by small steps of its window. What
//! turns or flies too fast for the pace at which the window grows is blurred instead, and stays so: the error
//! of the images is then far above that of the start, and does not fall. So is what begins to move late,
//! where Gaussians took up what the network had no time for: the error of some times is then far above that
//! of others at the end. Training begins anew in either case.

use std::ops::{Range, RangeInclusive};

use burn::tensor::{Device, Tensor};
use lgs_data::dataset::Dataset;
use lgs_model::{TensorFile, TensorFileError};

use super::config::SourceConfig;
use crate::adam::values;
use crate::data_summary::DataSummary;
use crate::thresholds::{
    COMPARED_IMAGES_PER_TIME, FAR_ABOVE_OTHERS, FAR_ABOVE_START, JUDGED_AFTER, MOST_LEFT_IF_FOLLOWED,
    PART_OF_WARMUP, PARTS_OF_WINDOW, SEEN_AGAIN_AFTER, SHARE_OF_END, SHARE_OF_MEANS,
};

/// Name of the sums in a checkpoint.
const SUMS: &str = "following.sums";
/// Stretches of the training whose images are compared.
const STRETCHES: usize = 4;
/// Means that are taken: of the images of each stretch, and of each part of the window.
const MEANS: usize = STRETCHES + PARTS_OF_WINDOW;

/// What the images say of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Finding {
    /// It follows what moves, as far as they tell.
    Followed,
    /// What moves is too fast for the pace at which the window grew.
    TooFast,
    /// What moves is not followed in some part of the window.
    Lost,
}

/// Errors of the images of four stretches of a training: the end of the warm-up, some iterations after the
/// window has become whole, as many some time later, and the end. Those of the end, also by the parts of the
/// window that images are of.
pub(super) struct Following {
    stretches: [Range<usize>; STRETCHES],
    /// First and last time of the images, where those of different times can be compared.
    window: Option<[f32; 2]>,
    /// Sum of the mean squared errors of the images of each stretch, then of each part of the window.
    sums: [Option<Tensor<1>>; MEANS],
    counts: [usize; MEANS],
}

impl Following {
    /// For a schedule and images of a span of time; nothing where the schedule's window is whole at once, or
    /// no other attempt would follow.
    pub(super) fn new(config: &SourceConfig, dataset: &Dataset, span: (f32, f32)) -> Option<Self> {
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
        let end = config.iterations - share(SHARE_OF_END)..config.iterations + 1;
        let stretches = [start, before(again), before(judged), end];
        let window = compares_times(dataset).then_some(span.into());
        let (sums, counts) = (std::array::from_fn(|_| None), [0; MEANS]);
        (judged < config.iterations).then_some(Self { stretches, window, sums, counts })
    }

    /// Learns the mean squared error `[1]` of the image of an iteration, which is of some time.
    pub(super) fn observe(&mut self, (iteration, time): (usize, f32), mse: &Tensor<1>) {
        let is_in = |&i: &usize| self.stretches[i].contains(&iteration);
        let stretches: Vec<usize> = (0..STRETCHES).filter(is_in).collect();
        let window = self.window.filter(|_| self.stretches[STRETCHES - 1].contains(&iteration));
        let part = window.map(|[first, last]| {
            let at = (time - first) / (last - first) * PARTS_OF_WINDOW as f32;
            STRETCHES + (at as usize).min(PARTS_OF_WINDOW - 1)
        });
        for index in stretches.into_iter().chain(part) {
            self.counts[index] += 1;
            self.sums[index] = Some(match self.sums[index].take() {
                Some(sum) => sum + mse.clone(),
                None => mse.clone(),
            });
        }
    }

    /// What the images say of the motion after some iterations; where they say nothing, that it follows.
    pub(super) fn finding(&self, passed: &RangeInclusive<usize>) -> Finding {
        let is_pace_judged = passed.contains(&(self.stretches[2].end - 1));
        if !is_pace_judged && !self.is_over_in(passed) {
            return Finding::Followed;
        }
        let means = self.means();
        if is_pace_judged {
            let [start, before, now] = [means[0], means[1], means[2]];
            tracing::debug!(start, before, now, "errors of images before and after the window became whole");
            if now > FAR_ABOVE_START * start && now > MOST_LEFT_IF_FOLLOWED * before {
                return Finding::TooFast;
            }
        }
        if self.is_over_in(passed) {
            let above_others = largest_over_median(&means[STRETCHES..]);
            tracing::debug!(above_others, "error of a part of the window over that of the others");
            if above_others > FAR_ABOVE_OTHERS {
                return Finding::Lost;
            }
        }
        Finding::Followed
    }

    /// Whether the training is over after some iterations.
    pub(super) fn is_over_in(&self, passed: &RangeInclusive<usize>) -> bool {
        passed.contains(&(self.stretches[STRETCHES - 1].end - 1))
    }

    /// Mean error of the images at the end.
    pub(super) fn error(&self) -> f64 {
        self.means()[STRETCHES - 1]
    }

    /// Mean errors; not a number where there are no images.
    fn means(&self) -> [f64; MEANS] {
        let sums = self.on_host();
        std::array::from_fn(|i| f64::from(sums[i]) / self.counts[i] as f64)
    }

    fn on_host(&self) -> [f32; MEANS] {
        self.sums.each_ref().map(|sum| sum.as_ref().map_or(0.0, |sum| values(sum)[0]))
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        file.insert(SUMS, &[MEANS], &self.on_host());
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
            return Err(file.field(SUMS, "a number for each mean", format!("{} numbers", sums.len())));
        }
        let sum = |i: usize| (self.counts[i] > 0).then(|| Tensor::from_floats([sums[i]], device));
        self.sums = std::array::from_fn(sum);
        Ok(())
    }
}

/// Whether several cameras see each time: what others see of other times has other errors.
fn compares_times(dataset: &Dataset) -> bool {
    let enough = |data: DataSummary| data.images as f32 >= COMPARED_IMAGES_PER_TIME * data.times as f32;
    DataSummary::of(dataset).is_some_and(enough)
}

/// The largest of some errors over their median, where they are known; 0 where none is.
fn largest_over_median(errors: &[f64]) -> f64 {
    let mut known: Vec<f64> = errors.iter().copied().filter(|error| error.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    known.last().map_or(0.0, |largest| largest / known[known.len() / 2])
}
