//! Every constant that decides what a report shows, with its reason. Sizes and colours of drawings stand
//! beside their code and in `style`.

// Paths of particles

/// Most objects whose paths are drawn, largest first: more have colours that are not told apart.
pub(crate) const DRAWN_OBJECTS: usize = 6;
/// Number of particles over all objects, about: more paths cover each other.
pub(crate) const DRAWN_PARTICLES: usize = 36;
/// Fewest and most particles of an object: its corners, and not a bundle.
pub(crate) const PARTICLES_PER_OBJECT: [usize; 2] = [6, 18];
/// One in so many states of the motion is drawn: steps are far below a pixel.
pub(crate) const DRAWN_STRIDE: usize = 3;
/// Fraction of a step that may be missing from the last whole one: the rounding of `time / dt`.
pub(crate) const STEP_TOLERANCE: f64 = 1e-3;
/// Times at which the source model, whose positions come from a large network, is evaluated.
pub(crate) const SOURCE_TIMES: usize = 61;
/// Times at which the truth is evaluated.
pub(crate) const TRUTH_TIMES: usize = 101;

// The plane of a motion

/// Weight of an object's shape against its motion: it decides only where the motion alone leaves the plane
/// open, as for a straight fall.
pub(crate) const SHAPE_WEIGHT: f64 = 1e-3;
/// Vertical part of a plane from which its upward direction is that of the world's z.
pub(crate) const UPRIGHT: f64 = 0.5;
/// Component below which a direction is written without it.
pub(crate) const SMALL_COMPONENT: f64 = 0.1;

// Potentials and curves

/// Most objects whose potentials are drawn.
pub(crate) const POTENTIAL_PANELS: usize = 4;
/// Points of the grid on which a potential is evaluated, each way.
pub(crate) const POTENTIAL_GRID: usize = 97;
/// Distance of the arrows of a force, shown pixels.
pub(crate) const ARROW_SPACING: f64 = 40.0;
/// Pieces of a drawn power law, which is straight only where both axes are logarithmic.
pub(crate) const CURVE_PIECES: usize = 60;
/// Means that the bold line of a stage of training joins.
pub(crate) const MEANS_PER_STAGE: usize = 25;
/// Least width of a stage of training, as a fraction of all steps, so that short ones stay readable.
pub(crate) const NARROWEST_STAGE: f64 = 0.22;

// Images

/// Most columns of images before, in and after the captured window.
pub(crate) const EXTRAPOLATION_COLUMNS: usize = 9;
/// Columns of images of the reversed motion, t = 0 among them.
pub(crate) const REVERSAL_COLUMNS: usize = 6;
/// Number of velocity arrows over all objects, about.
pub(crate) const VELOCITY_ARROWS: usize = 12;
/// Length of a fast particle's arrow, as a fraction of the image's width.
pub(crate) const LONG_ARROW: f64 = 0.16;
/// Fraction of the arrows that are no longer than that: a few near the camera may be.
pub(crate) const NOT_LONGER: f64 = 0.8;
/// Time over which a displacement in the image stands for the velocity.
pub(crate) const SHORT_TIME: f64 = 1e-2;
/// Width of a frame from which the letters of a contact sheet are large, pixels.
pub(crate) const LARGE_FRAME: u32 = 160;
/// Most runs of a suite whose images are on its page: with more it becomes too large to open.
pub(crate) const RUNS_WITH_STRIPS: usize = 16;

// Marks

/// Side of the mark of a frame beyond trust, as a fraction of the frame's width: seen at a glance, and clear
/// of what is filmed.
pub(crate) const MARK_FRACTION: f32 = 0.06;
/// Least side of that mark, pixels.
pub(crate) const LEAST_MARK: usize = 4;

// Cameras

/// Most cameras of a split that are drawn: pyramids of more cover each other.
pub(crate) const DRAWN_CAMERAS: usize = 80;
/// Most points of a set that are drawn.
pub(crate) const DRAWN_POINTS: usize = 2000;
/// Length of a camera's pyramid as a part of the rig's radius.
pub(crate) const PYRAMID: f32 = 0.15;
