//! Which training frame an iteration sees: all frames of the current time window once per round (its ends
//! more often, if so configured), in a random order (method §3.4). While the window grows, single frames may
//! be drawn instead, a share of them from its front: what has just come into the window is then followed at
//! every step, however many frames the window already holds.
//!
//! A round's order is drawn from a stream of its number and a single frame from one of its iteration, so
//! three integers restore it.

use lgs_core::stream;
use lgs_data::dataset::Frame;
use lgs_model::{TensorFile, TensorFileError};
use rand::RngExt;
use rand::seq::SliceRandom;

use super::config::SourceConfig;
use super::config_groups::WarmupFrames;
use super::first_window::end_of_first_window;
use crate::thresholds::{WINDOW_EDGE, WINDOW_FRONT};

/// A position in the sequence of rounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Round {
    /// Number of rounds begun; 0 before the first.
    number: u64,
    /// Number of frames of the round that have been used.
    used: usize,
    /// Iteration at which it began, which fixed its time window.
    began: usize,
}

/// The order in which training sees the frames.
pub(super) struct FrameOrder {
    /// Time of every training frame.
    times: Vec<f32>,
    /// End of the window of the warm-up's last frames.
    first_end: f32,
    seed: u64,
    round: Round,
    frames: Vec<usize>,
}

impl FrameOrder {
    pub(super) fn new(frames: &[Frame], config: &SourceConfig, seed: u64) -> Self {
        let times: Vec<f32> = frames.iter().map(|f| f.time).collect();
        let first_end = match config.warmup_frames {
            WarmupFrames::First | WarmupFrames::AllThenFirst => {
                end_of_first_window(frames, config.warmup_cameras)
            }
            _ => times.iter().copied().fold(f32::MIN, f32::max),
        };
        Self { times, first_end, seed, round: Round::default(), frames: Vec::new() }
    }

    /// First and last time of the training frames.
    pub(super) fn span(&self) -> (f32, f32) {
        self.times.iter().fold((f32::MAX, f32::MIN), |(low, high), &t| (low.min(t), high.max(t)))
    }

    /// The last time whose frames are used at an iteration.
    pub(super) fn last_time(&self, iteration: usize, config: &SourceConfig) -> f32 {
        let (first, last) = self.span();
        if config.sees_all_times(iteration) {
            last
        } else if config.is_warmup(iteration) {
            self.first_end
        } else {
            config.window_end(iteration, first, last).max(self.first_end)
        }
    }

    /// Adds the position to a checkpoint.
    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        let Round { number, used, began } = self.round;
        for (key, value) in [("round", number), ("used", used as u64), ("began", began as u64)] {
            file.set_metadata(key, value.to_string());
        }
    }

    /// Takes up the order at the position that a checkpoint has recorded.
    ///
    /// # Errors
    /// If it is absent or no position.
    pub(super) fn restore(
        &mut self,
        file: &TensorFile,
        config: &SourceConfig,
    ) -> Result<(), TensorFileError> {
        self.round = Round {
            number: file.metadata_json("round")?,
            used: file.metadata_json("used")?,
            began: file.metadata_json("began")?,
        };
        self.frames = if self.round.number == 0 { Vec::new() } else { self.drawn(config) };
        Ok(())
    }

    /// The frame of an iteration of the schedule and the number of the step, both counted from 1, which must
    /// be asked for in order.
    pub(super) fn next(&mut self, (iteration, step): (usize, usize), config: &SourceConfig) -> usize {
        if config.front_share > 0.0 && config.is_growing(iteration) {
            return self.single((iteration, step), config);
        }
        let phase = |i: usize| (config.is_warmup(i), config.sees_all_times(i), config.is_growing(i));
        if self.round.used >= self.frames.len() || phase(self.round.began) != phase(iteration) {
            self.round = Round { number: self.round.number + 1, used: 0, began: iteration };
            self.frames = self.drawn(config);
        }
        self.round.used += 1;
        self.frames[self.round.used - 1]
    }

    /// A frame of the growing window: of its front with the configured probability, else any.
    fn single(&self, (iteration, step): (usize, usize), config: &SourceConfig) -> usize {
        let (first, last) = self.span();
        let end = self.last_time(iteration, config);
        let mut random = stream(self.seed, "frame of the growing window", step as u64);
        let start = if random.random_range(0.0..1.0) < config.front_share {
            end - WINDOW_FRONT * (last - first)
        } else {
            first
        };
        let candidates: Vec<usize> =
            (0..self.times.len()).filter(|&i| (start..=end).contains(&self.times[i])).collect();
        let candidates = if candidates.is_empty() {
            (0..self.times.len()).filter(|&i| self.times[i] <= end).collect()
        } else {
            candidates
        };
        candidates[random.random_range(0..candidates.len())]
    }

    fn drawn(&self, config: &SourceConfig) -> Vec<usize> {
        let (first, last) = self.span();
        let growing = !config.is_warmup(self.round.began) && config.window_steps > 1;
        let end = self.last_time(self.round.began, config);
        let edge = WINDOW_EDGE * (last - first);
        let is_edge = |t: f32| t > end - edge || t < first + edge;
        let repeats =
            |i: usize| if growing && is_edge(self.times[i]) { config.edge_repeats.max(1) } else { 1 };
        let inside = (0..self.times.len()).filter(|&i| self.times[i] <= end);
        let mut frames: Vec<usize> = inside.flat_map(|i| std::iter::repeat_n(i, repeats(i))).collect();
        frames.shuffle(&mut stream(self.seed, "frame order", self.round.number));
        frames
    }
}
