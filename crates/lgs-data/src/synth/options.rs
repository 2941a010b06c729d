//! Options of synthetic datasets and tracks.

use super::error::SynthError;

/// Sides of an image that can be asked for, pixels.
const SIZES: std::ops::RangeInclusive<u32> = 8..=2048;
/// Training views that can be asked for.
const VIEWS: std::ops::RangeInclusive<usize> = 1..=200;

/// Rates of training images beyond 60 that can be asked for: for sets that show each time from few views.
const FINER_RATES: [u32; 2] = [120, 240];

/// Options of a synthetic dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SynthOptions {
    /// Width and height of the images, pixels, 8 to 2048. Default 160.
    pub size: u32,
    /// Training views, 1 to 200; three held-out ones are added. Default 12.
    pub views: usize,
    /// Draws the scene's constants, turns the cameras, shifts the textures and picks the ground-truth points.
    /// The seven first scenes keep their usual constants for seed 0. Default 0.
    pub seed: u64,
    /// Training images per unit of time and view, a divisor of 60, or 120 or 240. Default 60.
    pub train_fps: u32,
    /// Training views that show each time, drawn anew for each, at least 1: as where one camera moves, or a
    /// few record by turns. Default `None`: all of them.
    pub images_per_time: Option<usize>,
    /// What lights the bodies. Default: [`Lamp::Riding`].
    pub lamp: Lamp,
}

/// What lights the bodies of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lamp {
    /// A soft lamp on every body, which rides along: colours are those of the surface at all times.
    #[default]
    Riding,
    /// A sun that stands still: surfaces change as they turn, and bodies cast shadows.
    Sun,
}

impl Default for SynthOptions {
    fn default() -> Self {
        Self { size: 160, views: 12, seed: 0, train_fps: 60, images_per_time: None, lamp: Lamp::Riding }
    }
}

/// Options of true tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackOptions {
    /// Standard deviation of the noise of every coordinate, world units, finite and not negative. It is
    /// independent between points and correlated from frame to frame (0.75). Default 0.
    pub noise: f64,
    /// Draws the scene's constants, the points and the noise. Default 0.
    pub seed: u64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self { noise: 0.0, seed: 0 }
    }
}

/// Refuses options that are out of range.
pub(super) fn check(options: &SynthOptions) -> Result<(), SynthError> {
    let wrong = |option, expected, found| Err(SynthError::Option { option, expected, found });
    if !SIZES.contains(&options.size) {
        return wrong("size", "8 to 2048 pixels", u64::from(options.size));
    }
    if !VIEWS.contains(&options.views) {
        return wrong("views", "1 to 200", options.views as u64);
    }
    if options.train_fps == 0 || (60 % options.train_fps != 0 && !FINER_RATES.contains(&options.train_fps)) {
        return wrong("train_fps", "a divisor of 60, or 120 or 240", u64::from(options.train_fps));
    }
    if let Some(0) = options.images_per_time {
        return wrong("images_per_time", "1 or more", 0);
    }
    Ok(())
}
