//! Every constant of stages 2 and 3 that decides something and is no configuration key, with its reason.

// Schedules of stages 2 and 3

/// Steps after which the fit of the dynamics sees the same frames again.
pub(super) const ROUNDS_OF_FRAMES: usize = 3;
/// The direction-dependent part of colours learns slower than the constant one by this (method §3.4).
pub(super) const SH_REST_DIVISOR: f64 = 20.0;
/// Weight of 1 − SSIM in the loss that is reported; what is fitted is the squared error.
pub(super) const SSIM_WEIGHT: f32 = 0.2;

// Displacements of bodies beside their Gaussians

/// Degree of the polynomials in time by which bodies are displaced: that to which a source's tracks are
/// smoothed at most in a window of some fifty times.
pub(super) const DISPLACEMENT_DEGREE: usize = 10;
/// Learning rate of their coefficients, in radii of the body and radians: a step moves what is forty pixels
/// wide by a fiftieth of a pixel, and the two thousand steps of a refinement can turn it by a radian.
pub(super) const DISPLACEMENT_RATE: f64 = 1e-3;

// Displacements by images

/// Step of the differences by a body's displacement, in radii and radians.
pub(super) const DISPLACEMENT_PROBE: f64 = 0.005;
/// Errors of neighbouring pixels, and of one view at neighbouring times, are correlated: so many count as one
/// independent value.
pub(super) const CORRELATED_VALUES: f64 = 100.0;
/// Rounds of observation, at least: the second is about poses that the first has put right to a tenth of a
/// pixel, if they were off by no more than one.
pub(super) const FEWEST_ROUNDS: usize = 2;
/// Rounds at most, for poses that are off by several pixels; each takes back a part of that.
pub(super) const MOST_ROUNDS: usize = 8;
/// Rounds go on while each lowers the squared error of the images by this part.
pub(super) const PROGRESS: f64 = 0.02;
/// Squared error of the images of a time, over that of the time before, above which its poses are tried from
/// those of that time. Where views differ so much by themselves, trying costs time alone: what does not draw
/// the images better is not taken.
pub(super) const LOST_POSES: f64 = 2.0;
/// Standard deviation of the weak prior on a displacement, in radii and radians: what no image shows, such as
/// the rotation of a plain ball, stays as the motion had it.
pub(super) const DISPLACEMENT_DEVIATION: f64 = 0.05;
/// Part of the information of its median time that a time has at least, or its pose is left out of the choice
/// of laws: properly weighed it would count for less than a tenth of another one.
pub(super) const LEAST_SHOWN: f64 = 0.1;

// Laws by images, Gauss–Newton

/// Particles of an object that are rolled to find the derivatives of its pose.
pub(super) const ROLLED_PARTICLES: usize = 256;
/// Standard deviation of the trajectories that stage 1 has followed, at one time, in pixels.
pub(super) const TRAJECTORY_DEVIATION: f64 = 0.1;
/// Fractions of a step that are tried until the images come out better.
pub(super) const STEP_FRACTIONS: [f64; 3] = [1.0, 0.5, 0.25];
/// Standard deviation of the weak prior on a change of an unknown, in the unknown's unit.
pub(super) const PRIOR_DEVIATION: f64 = 0.3;
/// Unit of a parameter in its standard deviations after stage 1, so that the weak prior of the fit (method
/// §6) leaves it ten times the freedom that the tracks do, whose noise is correlated and known roughly. A
/// parameter with a prior of its own, such as a moment of inertia, has no more freedom than that leaves it.
pub(super) const UNIT_IN_DEVIATIONS: f64 = 30.0;
/// Unit of a parameter without a known deviation, as a part of its value.
pub(super) const UNIT_IN_VALUES: f64 = 0.3;
/// Least unit of a parameter that is fitted: rounding must not make it zero.
pub(super) const LEAST_UNIT: f64 = 1e-150;
/// Step of the central differences by an unknown, in its unit.
pub(super) const UNKNOWN_PROBE: f64 = 0.01;
/// Least radius of a body, as a fraction of the length of its motion.
pub(super) const LEAST_RADIUS: f32 = 0.01;

// Bands that views widen

/// Most groups that views are taken in: more tell a deviation no better than to a fifth.
pub(super) const MOST_GROUPS: usize = 12;
/// Fewest views whose disagreement says anything: two have one difference, and no scale to judge it by.
pub(super) const FEWEST_VIEWS: usize = 3;
/// Draws from the distribution of the forecasts: the radius of nine tenths is then known to a tenth.
pub(super) const DRAWS_OF_FORECASTS: usize = 128;
/// Particles that stand for all of a body: shares of them inside of a radius are known to some per cent.
pub(super) const PARTICLES_OF_BAND: usize = 48;
/// Part of a change by which its derivatives are found: small for the motion, and far above single precision.
pub(super) const FORECAST_PROBE: f64 = 0.02;

// Objects that images show to move

/// Training frames that are compared, spread evenly over the window.
pub(super) const OBSERVED_FRAMES: usize = 24;
/// Parts of these, one after the other, in one of which a motion has to show: a law needs about a quarter of
/// a window to be told from others, and six frames see what single ones may miss.
pub(super) const PARTS_OF_FRAMES: usize = 4;
/// An object counts as observed to move if its rest raises the error by at least this fraction of the largest
/// rise of any object, and is in doubt if it shows by less than that. It counts as observed to move by itself
/// if the motion of another one raises the error by at least this fraction of what its rest does.
pub(super) const OBSERVED_FRACTION: f64 = 0.1;
/// Steps by which Gaussians are tuned to images with an object in motion and at rest: colours change by most
/// of their range in as many.
pub(super) const RETUNING_STEPS: usize = 400;
/// Nearest Gaussians of a Gaussian, those that move, among which one of another object tells that the two
/// objects touch: about as many as surround it on a surface.
pub(super) const TOUCHING_NEIGHBORS: usize = 8;

// Bodies in place of tracks

/// Part of what the images show of an object's motion that poses of a body may leave unexplained, where its
/// tracks explain it: what tuning the Gaussians to the body gives back.
pub(super) const MOST_UNEXPLAINED_BY_BODY: f64 = 0.05;
/// Part of what images gain by the poses or laws of single objects, over the motion before, that a likelier
/// law of two of them may give back: its start is fitted to the images afterwards, and the Gaussians are
/// tuned.
pub(super) const MOST_GIVEN_BACK: f64 = 0.05;
/// What a body that deforms leaves of its tracks, over what a rigid one leaves, below which it deforms.
pub(super) const MOST_LEFT_IF_DEFORMING: f64 = 0.5;

// Hits

/// Distance of two bodies up to which they may touch, in sums of the root mean square distances of their
/// Gaussians from their middles: these lie below the surface, by a third of the radius at the most.
pub(super) const TOUCHES: f64 = 2.0;
/// Times that are one hit differ by at most so many intervals between images.
pub(super) const SAME_HIT: f64 = 2.0;
/// Cosine between the changes of velocity of two bodies up to which they may have struck each other: their
/// impulses are opposite, laws from images tell that to a degree or two (measured for four hits), and what
/// carries a body may take a part of its own. Half-way to the right angle, beyond which nothing is opposite.
pub(super) const OPPOSITE: f64 = -0.7;
/// Rounds in which hits of one body tell of those of others: of three in a row, the first comes last.
pub(super) const ROUNDS_OF_HITS: usize = 3;
