//! Every constant of the command line that decides something and is no flag, with its reason.

// Cameras of an orbit

/// Field of view where no camera is known, radians.
pub(crate) const DEFAULT_FOV_X: f32 = 0.8;
/// Image width where no camera is known, pixels.
pub(crate) const DEFAULT_WIDTH: u32 = 400;
/// Distance where no camera is known, over the rms radius of the scene: the radius then covers a third of the
/// field of view.
pub(crate) const DEFAULT_DISTANCE: f32 = 6.0;
/// Factor between the distance of an orbit and that of the known cameras: what moves should stay in view.
pub(crate) const ORBIT_ROOM: f32 = 1.2;
/// Determinant, per camera cubed, below which viewing axes count as parallel and have no common point.
pub(crate) const PARALLEL_AXES: f64 = 1e-6;

// Videos

/// Frames of a video per second, where nothing else is asked for.
pub(crate) const FRAMES_PER_SECOND: u32 = 25;
/// Most keyframes of a camera path: a camera every second for an hour, and twice that.
pub(crate) const MAX_KEYFRAMES: usize = 10_000;
/// Widest and highest picture of a camera path, pixels, as of `--size`.
pub(crate) const LARGEST_SIDE: u32 = 8192;
/// Largest deviation of a keyframe's rotation from an orthonormal matrix: numbers with four digits pass.
pub(crate) const ROTATION_TOLERANCE: f32 = 1e-3;
/// Largest deviation between the entries of two poses of one camera: a file of decimal numbers lies between.
pub(crate) const SAME_POSE: f32 = 1e-4;

// Times

/// Most times of one call: frames of an hour at 24 per second.
pub(crate) const MAX_TIMES: usize = 100_000;
/// Part of a step by which the end of a range may be missed, so that `0:0.3:0.1` has its last time.
pub(crate) const END_TOLERANCE: f64 = 1e-6;
/// Distance beyond a scene's limits that a time may have, for the rounding of single precision.
pub(crate) const LIMIT_TOLERANCE: f32 = 1e-4;

// Work

/// Seconds of training above which it is said how it takes less: longer than somebody waits beside it.
pub(crate) const LONG_SECS: f64 = 3600.0;
/// Clouds in memory together when frames are drawn or written: enough for every core of a small machine.
pub(crate) const CLOUDS_AT_ONCE: usize = 8;
/// Seconds of a stage after which its own speed corrects the estimate: steps at the start are no rule.
pub(crate) const SETTLING_SECS: f64 = 5.0;
/// Shortest over longest time of a training above which both are one: steps are timed no better.
pub(crate) const ALIKE: f64 = 0.8;
/// Seconds between log lines of a task where no progress bar is seen.
pub(crate) const LOG_INTERVAL_SECS: u64 = 10;
