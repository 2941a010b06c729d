//! Values that change with the iteration: learning rates, the active degree of colour, the time window
//! (method §3.4).

use super::config::SourceConfig;
use super::config_groups::WarmupFrames;
use crate::cloud_rates::CloudRates;
use lgs_core::optim::log_linear;

/// The part of a schedule of some steps that is done.
fn part(iteration: usize, steps: usize) -> f64 {
    iteration as f64 / steps.max(1) as f64
}

/// A schedule's length: its own, or that of the training where it says 0.
fn over(steps: usize, iterations: usize) -> usize {
    if steps == 0 { iterations } else { steps }
}

impl SourceConfig {
    /// Learning rate of positions at an iteration (counted from 1).
    #[must_use]
    pub fn position_rate(&self, iteration: usize) -> f64 {
        let rates = &self.learning_rates;
        let done = part(iteration, over(rates.position_steps, self.iterations));
        log_linear(done, [rates.position_start, rates.position_end])
    }

    /// Learning rate of the deformation network at an iteration.
    #[must_use]
    pub fn deformation_rate(&self, iteration: usize) -> f64 {
        let rates = &self.learning_rates;
        let active = (iteration + 1).saturating_sub(self.warmup_iterations);
        let ramp = (active as f64 / rates.deformation_ramp.max(1) as f64).min(1.0);
        let done = part(iteration, over(rates.deformation_steps, self.iterations));
        ramp * log_linear(done, [rates.deformation_start, rates.deformation_end])
    }

    /// Learning rates of the Gaussians' attributes at an iteration.
    pub(crate) fn cloud_rates(&self, iteration: usize) -> CloudRates {
        let rates = &self.learning_rates;
        let share = if self.is_growing(iteration) { rates.while_growing } else { 1.0 };
        CloudRates {
            means: share * self.position_rate(iteration),
            rotations: share * rates.rotation,
            log_scales: share * rates.scale,
            raw_opacities: share * rates.opacity,
            sh_constant: share * rates.sh,
            sh_rest: share * rates.sh_rest,
            features: self.deformation_rate(iteration),
            shading: self.shading_rate(iteration),
        }
    }

    /// Learning rate of the logarithms of brightness at an iteration.
    fn shading_rate(&self, iteration: usize) -> f64 {
        let shading = &self.shading;
        let steps = self.iterations.saturating_sub(shading.after);
        let done = part(iteration.saturating_sub(shading.after), steps);
        log_linear(done, [shading.rate_start, shading.rate_end])
    }

    /// Degree of spherical harmonics in use at an iteration: 0, and one more every `sh_interval`.
    #[must_use]
    pub fn active_degree(&self, iteration: usize) -> usize {
        (iteration / self.sh_interval.max(1)).min(self.sh_degree)
    }

    /// Times that the images' width is halved at an iteration.
    #[must_use]
    pub fn level(&self, iteration: usize) -> usize {
        let coarse = f64::from(self.coarse_share) * self.iterations as f64;
        let passed = iteration as f64 * self.coarse_levels as f64 / coarse.max(1.0);
        self.coarse_levels.saturating_sub(passed as usize)
    }

    /// Whether Gaussians are still static at an iteration.
    #[must_use]
    pub fn is_warmup(&self, iteration: usize) -> bool {
        iteration < self.warmup_iterations
    }

    /// Whether the warm-up sees all times at an iteration, and its first window later.
    #[must_use]
    pub fn sees_all_times(&self, iteration: usize) -> bool {
        self.warmup_frames == WarmupFrames::AllThenFirst && 2 * iteration < self.warmup_iterations
    }

    /// Whether the time window is growing at an iteration: after the warm-up, before it is whole.
    #[must_use]
    pub fn is_growing(&self, iteration: usize) -> bool {
        !self.is_warmup(iteration) && iteration < self.end_of_growth()
    }

    /// Iterations over which the time window grows.
    fn growth(&self) -> usize {
        self.window_interval.saturating_mul(self.window_steps.saturating_sub(1))
    }

    /// The first iteration whose time window is whole.
    pub(super) fn end_of_growth(&self) -> usize {
        self.warmup_iterations.saturating_add(self.growth())
    }

    /// The first iteration whose images have their full size.
    pub(super) fn end_of_coarse_images(&self) -> usize {
        (f64::from(self.coarse_share) * self.iterations as f64).ceil() as usize
            * usize::from(self.coarse_levels > 0)
    }

    /// The schedule of another attempt, with a window that grows more slowly and everything after its growth
    /// as long as before.
    pub(super) fn growing_slower(&self) -> Self {
        let more = self.growth() * self.slower_growth.saturating_sub(1);
        let mut slower = self.clone();
        slower.window_interval *= self.slower_growth;
        slower.slower_growth = 0;
        // The same number of coarse images.
        slower.coarse_share *= self.iterations as f32 / (self.iterations + more) as f32;
        let (rates, densify) = (&mut slower.learning_rates, &mut slower.densify);
        let of_nodes = slower.nodes.as_mut().map(|nodes| &mut nodes.chosen_before);
        let counts = [
            &mut slower.iterations,
            &mut slower.static_regulariser_after,
            &mut slower.shading.after,
            &mut rates.position_steps,
            &mut rates.deformation_steps,
            &mut densify.before,
        ];
        for count in counts.into_iter().chain(of_nodes).filter(|count| **count >= self.end_of_growth()) {
            *count += more;
        }
        slower
    }

    /// Weight of the guidance by silhouettes at an iteration: whole while the time window grows, then falling
    /// to 0 at the end.
    #[must_use]
    pub fn guide_weight(&self, iteration: usize) -> f32 {
        let grown = self.end_of_growth().min(self.iterations);
        let left = self.iterations.saturating_sub(iteration) as f32 / (self.iterations - grown).max(1) as f32;
        self.guide.weight * left.min(1.0)
    }

    /// The last time whose frames are used at an iteration after the warm-up, given the captured window's
    /// first and last.
    #[must_use]
    pub fn window_end(&self, iteration: usize, first: f32, last: f32) -> f32 {
        let grown = iteration.saturating_sub(self.warmup_iterations) / self.window_interval.max(1) + 1;
        let steps = self.window_steps.max(1);
        if grown >= steps { last } else { first + (last - first) * grown as f32 / steps as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_follow_the_published_schedule() {
        let paper = SourceConfig::paper();
        assert!((paper.position_rate(0) - 8e-4).abs() < 1e-12);
        assert!((paper.position_rate(15_000) - (8e-4_f64 * 8e-6).sqrt()).abs() < 1e-12);
        assert!((paper.position_rate(30_000) - 8e-6).abs() < 1e-14);
        assert!((paper.position_rate(40_000) - 8e-6).abs() < 1e-14);
        assert!((paper.deformation_rate(40_000) - 1.6e-6).abs() < 1e-14);
        let quick = SourceConfig { iterations: 700, ..SourceConfig::quick() };
        let long = SourceConfig { iterations: 1_000_000, ..SourceConfig::quick() };
        let ramped =
            long.deformation_rate(long.warmup_iterations + 9) / long.learning_rates.deformation_start;
        assert!((ramped - 0.1).abs() < 0.01, "{ramped}");
        assert!((quick.position_rate(700) - quick.learning_rates.position_end).abs() < 1e-12);
    }

    #[test]
    fn images_grow_to_their_full_size() {
        let config =
            SourceConfig { coarse_levels: 2, coarse_share: 0.5, iterations: 100, ..SourceConfig::paper() };
        assert_eq!([1, 24, 25, 49, 50, 100].map(|i| config.level(i)), [2, 2, 1, 1, 0, 0]);
        assert_eq!(SourceConfig::paper().level(1), 0);
    }

    #[test]
    fn another_attempt_grows_slower_and_is_as_long_after_that() {
        let first = SourceConfig::nodes_quick();
        let slower = first.growing_slower();
        assert_eq!(slower.end_of_growth() - slower.warmup_iterations, 4 * 29 * 20);
        let after = |config: &SourceConfig| {
            let nodes = config.nodes.as_ref().map_or(0, |nodes| nodes.chosen_before);
            let counts = [config.iterations, config.densify.before, config.shading.after, nodes];
            counts.map(|count| count - config.end_of_growth())
        };
        assert_eq!(after(&slower), after(&first));
        assert_eq!((slower.densify.after, slower.slower_growth), (first.densify.after, 0));
    }

    #[test]
    fn degree_warm_up_and_window_switch_where_they_should() {
        let mut config = SourceConfig::paper();
        assert_eq!([999, 1000, 2999, 3000, 40_000].map(|i| config.active_degree(i)), [0, 1, 2, 3, 3]);
        assert!(config.is_warmup(2999) && !config.is_warmup(3000));
        assert_eq!(config.window_end(3000, 0.0, 0.75), 0.75);
        (config.window_steps, config.window_interval) = (8, 1000);
        assert_eq!(config.window_end(3000, 0.0, 0.8), 0.1);
        assert_eq!(config.window_end(5999, 0.0, 0.8), 0.3);
        assert_eq!(config.window_end(10_000, 0.0, 0.8), 0.8);
    }
}
