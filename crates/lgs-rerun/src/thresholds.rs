//! Numbers of recordings that are choices, in one place.

/// Pictures of a stage of training, besides that of its first step: enough to see it converge, and few
/// beside the hundreds of steps, each of which draws an image as well.
pub(crate) const PICTURES_PER_STAGE: usize = 16;
/// Paths of an object, drawn by as many of its Gaussians: a bundle that shows how it turns.
pub(crate) const PATHS_PER_OBJECT: usize = 8;
/// Numbers of a curve that are written at once: each chunk of a recording has about a kilobyte of its own, a
/// number sixteen bytes. What a killed process loses of a curve is in `events.jsonl`.
#[cfg(feature = "rerun")]
pub(crate) const NUMBERS_AT_ONCE: usize = 256;
/// Nanoseconds on the timeline `time` for a unit of the scene's time.
#[cfg(feature = "rerun")]
pub(crate) const NANOSECONDS_PER_UNIT: f64 = 1e9;
/// Width of the points and lines over Gaussians, points of the screen.
#[cfg(feature = "rerun")]
pub(crate) const MARK_POINTS: f32 = 5.0;
/// Width of paths, points of the screen.
#[cfg(feature = "rerun")]
pub(crate) const PATH_POINTS: f32 = 1.0;
