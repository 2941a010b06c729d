//! Every constant that decides something when a scene is measured, with its reason. The definition of LPIPS
//! stands in [`crate::lpips`].

// Images

/// Accumulated opacity above which a pixel is foreground: half, so that the edge of a silhouette lies where
/// a pixel is half covered (method §7).
pub(crate) const OPACITY_THRESHOLD: f32 = 0.5;
/// Difference of a channel above which a pixel differs from the background colour: 10 of 255 levels, above
/// the noise of compression and resampling.
pub(crate) const CONTENT_THRESHOLD: f32 = 10.0 / 255.0;
/// Least part of a small pixel that a large one must cover to take part in its mean: above the rounding of
/// doubles, far below a level of 255.
pub(crate) const LEAST_OVERLAP: f64 = 1e-9;
/// Times whose clouds are in memory together while a split is scored.
pub(crate) const TIMES_AT_ONCE: usize = 4;
/// Frames whose images are in memory together while a split is scored.
pub(crate) const FRAMES_AT_ONCE: usize = 32;

// Extent

/// Largest image width at which foreground pixels are counted: silhouettes need no more.
pub(crate) const EXTENT_WIDTH: u32 = 200;
/// Most cameras that foreground pixels are counted through, evenly chosen.
pub(crate) const EXTENT_VIEWS: usize = 12;
/// Number of times in (0, 3 τ_max] at which foreground pixels are counted.
pub(crate) const EXTENT_TIMES: usize = 30;
/// Fraction of foreground pixels from which a view counts as covered: a room leaves only cracks.
pub(crate) const COVERED: f64 = 0.95;
/// Displacement from t = 0 from which a Gaussian of a source model counts as dynamic, world units: more than
/// a source jitters, less than any visible motion.
pub(crate) const DYNAMIC_DISPLACEMENT: f32 = 0.01;
/// Number of times in the captured window at which displacements of a source model are measured.
pub(crate) const DISPLACEMENT_TIMES: usize = 15;

// Times and steps

/// Rounding of times that is allowed for, units of time.
pub(crate) const TIME_TOLERANCE: f32 = 1e-4;
/// Fraction of a step that may be missing from the last whole one: the rounding of `time / dt`.
pub(crate) const STEP_TOLERANCE: f64 = 1e-3;
/// One in so many states of a rollout is measured where sums or extrema over states are taken.
pub(crate) const STATE_STRIDE: usize = 5;

// Falls

/// Fraction of the observed drop whose duration is measured, well away from the start's rounding and from
/// the end.
pub(crate) const DROP_FRACTION: f64 = 0.7;
/// Least vertical part of the mean acceleration, over its length, of a motion that counts as falling.
pub(crate) const DOWNWARD: f64 = 0.8;
/// Least drop over path length of a motion that counts as falling.
pub(crate) const MOSTLY_DOWN: f64 = 0.8;
/// Largest vertical speed at the start over that at the window's end of a fall that starts at rest.
pub(crate) const NEARLY_AT_REST: f64 = 0.25;
/// Steps of a fall that are computed before the drop is compared: a strong pull is over soon.
pub(crate) const FALL_STEPS: usize = 25;

// True forces

/// Ridge of the regression of accelerations over positions, as a fraction of the mean variance: it decides
/// only along directions in which nothing moves.
pub(crate) const CURVATURE_RIDGE: f64 = 1e-9;
/// Fraction of a vector's length that must be left beside the earlier ones for a direction of its own.
pub(crate) const INDEPENDENT: f64 = 1e-6;

// Bodies of the truth

/// Part of a body's size by which a rotation may miss its points where the body is rigid: rounding of single
/// precision, many times over.
pub(crate) const RIGID: f64 = 1e-4;
/// Part of what a rotation leaves of the points that a linear map may leave where the body is stretched.
pub(crate) const AFFINE: f64 = 0.1;
/// Part of an object's true points that have another one within the distance that counts as the gap between
/// them: all but a few at the edges.
pub(crate) const NEARLY_ALL: f64 = 0.95;
