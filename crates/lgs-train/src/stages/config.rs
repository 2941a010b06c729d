//! Settings of stages 2 and 3: photometric tuning of the dynamics, refinement of the Gaussians.

use lgs_data::dataset::Frame;
use serde::{Deserialize, Serialize};

use super::spread::spread_over_time;
use super::thresholds::{ROUNDS_OF_FRAMES, SH_REST_DIVISOR};
use crate::cloud_rates::CloudRates;
use crate::source::{position_unit, stretch_factor};

/// What of the initial velocity is tuned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialVelocity {
    /// One twist (linear and angular velocity) per object, added to what distillation found.
    Twist,
    /// Every particle's own velocity, as in the paper.
    Free,
}

/// Stage 2, first part: every object's start and the constants of its law by least squares on the images;
/// networks and Gaussians stay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitDynamicsConfig {
    /// Steps of Gauss–Newton; 0 skips the part (paper).
    pub steps: usize,
    /// Training frames that a step sees, spread evenly over the window; 0 is all.
    pub frames: usize,
}

impl Default for FitDynamicsConfig {
    fn default() -> Self {
        Self { steps: 3, frames: 240 }
    }
}

impl FitDynamicsConfig {
    /// The paper has no such part.
    #[must_use]
    pub fn paper() -> Self {
        Self { steps: 0, ..Self::default() }
    }

    /// The frames that a step sees.
    pub(super) fn observed<'a>(&self, frames: &'a [Frame], step: usize) -> Vec<&'a Frame> {
        let count = if self.frames == 0 { frames.len() } else { self.frames };
        spread_over_time(frames, count, [step % ROUNDS_OF_FRAMES, ROUNDS_OF_FRAMES])
    }
}

/// Stage 2: U, Q and the initial velocity against the images; the Gaussians stay.
///
/// Objects that have been fitted ([`FitDynamicsConfig`]) and follow linear laws alone need none of it: where
/// all do, the stage is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TuneDynamicsConfig {
    /// Optimiser steps (published: 5 000); 0 skips the stage.
    pub iterations: usize,
    /// Training frames per step; they share one rollout.
    pub frames_per_step: usize,
    /// Learning rate of the networks, decayed by a cosine to a hundredth (published: 1e-4).
    pub learning_rate: f64,
    /// Learning rate of the initial velocity as a part of the rms speed (published: 1e-3).
    pub velocity_learning_rate: f64,
    /// Learning rate of every object's pose at t = 0, in radii and radians (paper: 0, the source's poses
    /// stay).
    pub pose_learning_rate: f64,
    /// What of the initial velocity is tuned.
    pub initial_velocity: InitialVelocity,
    /// Truncated backpropagation: gradients reach back this many steps (published: 15); 0 reaches back to t =
    /// 0.
    pub window_steps: usize,
    /// With truncation, every so many steps one goes back to t = 0, so that v0 is tuned by all times
    /// (published: 4).
    pub full_window_every: usize,
    /// Particles per object that carry gradients, drawn anew every step (published: 8 192); 0 takes all. The
    /// others are drawn where the latest full rollout put them.
    pub subset: usize,
    /// Steps between full rollouts (published: 10).
    pub refresh_every: usize,
    /// Weight of 1 − SSIM in the photometric loss.
    pub ssim_weight: f32,
}

impl Default for TuneDynamicsConfig {
    fn default() -> Self {
        Self {
            iterations: 150,
            frames_per_step: 6,
            learning_rate: 2e-4,
            velocity_learning_rate: 2e-3,
            pose_learning_rate: 2e-3,
            initial_velocity: InitialVelocity::Twist,
            window_steps: 0,
            full_window_every: 4,
            subset: 512,
            refresh_every: 10,
            ssim_weight: 0.2,
        }
    }
}

impl TuneDynamicsConfig {
    /// The paper's stage 2, in minutes on two processor cores: every particle's own velocity, truncated
    /// backpropagation, a frame per step.
    #[must_use]
    pub fn networks() -> Self {
        Self {
            iterations: 400,
            frames_per_step: 1,
            learning_rate: 2e-4,
            velocity_learning_rate: 2e-3,
            pose_learning_rate: 0.0,
            initial_velocity: InitialVelocity::Free,
            window_steps: 15,
            ..Self::default()
        }
    }

    /// The same as published.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            iterations: 5_000,
            learning_rate: 1e-4,
            velocity_learning_rate: 1e-3,
            subset: 8_192,
            ..Self::networks()
        }
    }

    /// Checks the counts.
    ///
    /// # Errors
    /// The key and the reason.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        let counts = [
            ("frames_per_step", self.frames_per_step),
            ("full_window_every", self.full_window_every),
            ("refresh_every", self.refresh_every),
        ];
        positive(&counts)
    }
}

/// Stage 3, or the refinement before stage 2: the Gaussians against the images; the dynamics stay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TuneGaussiansConfig {
    /// The iterations, and the rate of the means, are multiplied by this (paper: 1); 0: by the images' width
    /// over 160 pixels, between 1 and 3, as the source's iterations are. A step sees all pixels of an image,
    /// and where a batch is larger, steps may be longer by its root: measured for the means alone.
    pub stretch: f32,
    /// Optimiser steps (published: 10 000); 0 skips the stage.
    pub iterations: usize,
    /// World units that the rate of the means is in (paper: 1); 0: as in `source.learning_rates`.
    pub position_unit: f64,
    /// Learning rate of the means (published: 8e-6, the last rate of the source). All rates fall by a cosine
    /// to a hundredth.
    pub means_learning_rate: f64,
    /// Learning rate of the log-scales.
    pub scales_learning_rate: f64,
    /// Learning rate of the rotations.
    pub rotations_learning_rate: f64,
    /// Learning rate of the opacities.
    pub opacities_learning_rate: f64,
    /// Learning rate of the colours' constant part; the rest gets a twentieth.
    pub colors_learning_rate: f64,
    /// The motion is rolled anew from the changed means every so many steps (published: 100).
    pub refresh_every: usize,
    /// Weight of 1 − SSIM in the photometric loss.
    pub ssim_weight: f32,
    /// Weight of the mean squared change of the raw opacities since the stage began (paper: 0).
    pub opacity_prior: f32,
}

impl Default for TuneGaussiansConfig {
    fn default() -> Self {
        Self {
            stretch: 0.0,
            iterations: 2000,
            position_unit: 1.0,
            means_learning_rate: 1e-4,
            scales_learning_rate: 5e-3,
            rotations_learning_rate: 1e-3,
            opacities_learning_rate: 3e-2,
            colors_learning_rate: 2.5e-3,
            refresh_every: 100,
            ssim_weight: 0.2,
            opacity_prior: 1e-4,
        }
    }
}

impl TuneGaussiansConfig {
    /// As published.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            stretch: 1.0,
            iterations: 10_000,
            means_learning_rate: 8e-6,
            scales_learning_rate: 5e-4,
            rotations_learning_rate: 1e-4,
            opacities_learning_rate: 5e-3,
            opacity_prior: 0.0,
            ..Self::default()
        }
    }

    /// The same with no step.
    #[must_use]
    pub fn left_out(self) -> Self {
        Self { iterations: 0, ..self }
    }

    /// Learning rates of the Gaussians' attributes before their decay.
    pub(crate) fn cloud_rates(&self) -> CloudRates {
        CloudRates {
            means: self.means_learning_rate,
            rotations: self.rotations_learning_rate,
            log_scales: self.scales_learning_rate,
            raw_opacities: self.opacities_learning_rate,
            sh_constant: self.colors_learning_rate,
            features: 0.0,
            shading: 0.0,
            sh_rest: self.colors_learning_rate / SH_REST_DIVISOR,
        }
    }

    /// The configuration for images of a width and cameras at a distance from what they look at, with the
    /// iterations multiplied out.
    #[must_use]
    pub fn resolved(&self, width: u32, viewing_distance: f32) -> Self {
        let factor = stretch_factor(self.stretch, width);
        let unit = position_unit(self.position_unit, viewing_distance);
        let iterations = (self.iterations as f64 * factor).round() as usize;
        Self {
            stretch: 1.0,
            iterations,
            position_unit: 1.0,
            means_learning_rate: self.means_learning_rate * factor * unit,
            ..self.clone()
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// The key and the reason.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        let not_negative = [
            ("stretch", f64::from(self.stretch)),
            ("position_unit", self.position_unit),
            ("opacity_prior", f64::from(self.opacity_prior)),
        ];
        if let Some((key, value)) = not_negative.into_iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite())) {
            return Err((key, format!("{} is negative or not finite", value as f32)));
        }
        positive(&[("refresh_every", self.refresh_every)])
    }
}

fn positive(counts: &[(&'static str, usize)]) -> Result<(), (&'static str, String)> {
    counts
        .iter()
        .find(|(_, count)| *count == 0)
        .map_or(Ok(()), |(key, _)| Err((*key, "0 is below 1".to_owned())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refinement_is_as_long_as_images_are_wide_unless_told_otherwise() {
        let quick = TuneGaussiansConfig::default();
        let at = |config: &TuneGaussiansConfig, width| config.resolved(width, 4.4).iterations;
        assert_eq!(quick.resolved(160, 9.0).means_learning_rate, quick.means_learning_rate);
        assert!(
            (quick.resolved(400, 9.0).means_learning_rate - 2.5 * quick.means_learning_rate).abs() < 1e-9
        );
        assert_eq!([100, 160, 400, 4000].map(|width| at(&quick, width)), [2000, 2000, 5000, 6000]);
        let given = TuneGaussiansConfig { stretch: 2.0, ..quick };
        assert_eq!(at(&given, 400), 4000);
        assert_eq!(at(&TuneGaussiansConfig::paper(), 800), 10_000);
        assert_eq!(given.resolved(400, 1.0).resolved(400, 1.0).iterations, 4000, "once");
    }
}
