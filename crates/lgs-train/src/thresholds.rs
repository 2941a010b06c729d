//! Every constant of training that decides something and is no configuration key, with its reason. Those of
//! stages 2 and 3 are in `stages/thresholds.rs`, those of paths in `tracks/thresholds.rs`.

// Checkpoints

/// Checkpoints kept in a folder: if the machine dies while one is written, the one before is whole.
pub(crate) const KEPT_CHECKPOINTS: usize = 2;
/// Steps between lines of `events.jsonl`: a stage has hundreds of steps, its curve dozens of points or more.
pub(crate) const EVENT_INTERVAL: usize = 10;

// Time budgets

/// Part of the time left that the source may take where all stages follow: measured on scenes with several
/// objects, stages 1 and 2 then have a tenth and the Gaussians of the scene the rest.
pub(crate) const SOURCE_SHARE: f64 = 0.72;
/// Part of the time left that stage 1 may take if it goes into further rounds: as long is kept for each of
/// the two choices of laws by images.
pub(crate) const DISTILL_SHARE: f64 = 0.15;
/// Part of the time left that the refinement before stage 2 may take.
pub(crate) const REFINEMENT_SHARE: f64 = 0.3;
/// Part of the time left that the last stage may take: the choice of laws by its Gaussians comes after it.
pub(crate) const LAST_STAGE_SHARE: f64 = 0.93;
/// Part of the budget that a stage of Gaussians has at least, or it is left out: the first steps of Adam are
/// as long as its rates allow, whatever the gradient, and a scene that ends after a dozen of them is worse
/// than before by many decibels.
pub(crate) const LEAST_SHARE: f64 = 0.02;
/// Part of the budget that the last stage has, however late it is: Gaussians that are tuned to a source draw
/// laws chosen by the images worse than that source, by decibels.
pub(crate) const LAST_STAGE_GRACE: f64 = 0.05;
/// Seconds over which steps are timed before a pace is set: a thousandth of a budget of a quarter of an hour,
/// and above the resolution of any clock.
pub(crate) const PACE_SECS: f64 = 1.0;
/// Fewest steps that are timed before a pace is set, so that one slow step is no rule.
pub(crate) const PACE_STEPS: usize = 5;
/// Weight of the newest timed steps against those before, whose weights fall with age: a busy second of the
/// machine changes the pace by a fifth of what it takes.
pub(crate) const NEWEST_WEIGHT: f64 = 0.2;
/// Slowest pace, that of a schedule by itself: four times as many steps as it has bring more Gaussians,
/// which fit the training images better and new views worse (`passing-spheres`: val 33.9 dB after 17 500
/// steps, 30.1 after 85 000).
pub(crate) const SLOWEST_PACE: f64 = 1.0;

// Estimates of time

/// Frames of which steps are timed, spread over the set.
pub(crate) const PROBE_FRAMES: usize = 6;
/// Steps that are timed; their mean is within a tenth of that of many.
pub(crate) const PROBE_STEPS: usize = 4;
/// Part of the time of densification after which the number of Gaussians has come to its budget.
pub(crate) const GROWTH_END: f64 = 0.5;
/// Time of stage 1, in steps of the source with all its Gaussians: between a few hundred for a law in
/// generalised coordinates and three thousand for particles by themselves.
pub(crate) const STEPS_OF_DISTILLATION: f64 = 1500.0;
/// Time of a frame in a step of the fit of the dynamics, in steps of the Gaussians, the choice of laws before
/// it included: it is drawn up to eight times in all, with its changes by every freedom of an object.
pub(crate) const STEPS_PER_FITTED_FRAME: f64 = 4.0;

// Imported tracks

/// Fewest times of tracks from elsewhere: place, velocity and acceleration take three, and two more tell
/// them from noise.
pub(crate) const FEWEST_TIMES: usize = 5;

/// Frames from which on tracks are sampled at their own times: a polynomial of degree 10, the highest that
/// smooths a motion, then has as many samples again to fail at.
pub(crate) const FEWEST_FRAMES: usize = 16;
/// Distance of frames from even times, as a fraction of their spacing: that of rounded decimals.
pub(crate) const EVEN: f32 = 0.01;

// Laws by images

/// Gaussians that tell how a body turns: as many as a support that keeps one rigid has.
pub(crate) const FEWEST_OF_BODY: usize = 4;

/// Decibels by which the last choice of laws may change the images without the Gaussians being tuned to it:
/// where they and the motion agree it is a hundredth, where they hold each other back a quarter and more.
pub(crate) const UNSETTLED: f64 = 0.1;
/// Rounds at most in which Gaussians are tuned to a motion that has changed: each takes back about half of
/// what motion and Gaussians have held each other to, four leave a sixteenth.
pub(crate) const MOST_RETUNINGS: usize = 4;

// Laws held to their source

/// Decibels by which a law may draw its object worse in the window than the source does: the one figure of
/// the contract.
pub(crate) const MOST_BELOW_SOURCE: f64 = 0.5;
/// Training frames that are compared, spread evenly over the window: several at each part of it, at the cost
/// of as many steps of stage 3.
pub(crate) const HELD_FRAMES: usize = 48;

// Adam and the first Gaussians, as 3D Gaussian splatting has them (method §3.4)

/// Summand under Adam's division by the root of the second moment: so small that steps do not depend on the
/// scale of the loss.
pub(crate) const ADAM_EPSILON: f32 = 1e-15;
/// Decay of Adam's first and of its second moments.
#[cfg(feature = "gpu")]
pub(crate) const ADAM_BETAS: [f32; 2] = [0.9, 0.999];
/// Opacity of a fresh Gaussian.
pub(crate) const FIRST_OPACITY: f32 = 0.1;
/// Smallest mean squared neighbour distance that a fresh Gaussian's size is taken from, square world units.
pub(crate) const MIN_SQUARED_DISTANCE: f32 = 1e-7;
/// Most voxels along an edge of the box of points that are thinned out: finer ones tell points apart that are
/// nearer than a thousandth of a pixel.
pub(crate) const MOST_CELLS: i64 = 1 << 20;
/// Opacity that a reset lowers to.
pub(crate) const RESET_OPACITY: f32 = 0.01;
/// Factor between the scale of a Gaussian and that of the two that it is split into: 0.8 · 2.
pub(crate) const SPLIT_SHRINK: f32 = 1.6;
/// Fewest Gaussians that pruning leaves, so that a scene never becomes empty.
pub(crate) const FEWEST_GAUSSIANS: usize = 16;

// Densification as Markov chain Monte Carlo (method §3.4)

/// Opacity at which the noise of positions has fallen to a half, and how steeply it falls, as published: it
/// explores with what is nearly invisible and leaves what is seen in place.
pub(crate) const NOISE_OPACITY: f32 = 0.005;
/// Factor of the opacity in the logistic function of the noise (published).
pub(crate) const NOISE_STEEPNESS: f32 = 100.0;
/// Opacity above which noise is left out: e^−14.5 of the whole, below the rounding of positions.
pub(crate) const QUIET_OPACITY: f32 = 0.15;
/// Distance of a shared opacity from 0 and 1 that keeps its logit finite.
pub(crate) const OPACITY_MARGIN: f32 = 1e-6;

// Anti-aliasing (method §3.4)

/// Variance of the 3D smoothing filter, square pixels of the view that resolves a Gaussian best (published).
pub(crate) const SMOOTHING_VARIANCE: f32 = 0.2;
/// Part of an image's size beyond its edges at which a Gaussian still counts as seen (published).
pub(crate) const SAMPLING_MARGIN: f32 = 0.15;

// Gaussians proposed for what the model lacks (method §3.4)

/// Blocks in a row of an image: a thing of a twentieth of the width fills one and its neighbours.
pub(crate) const BLOCKS_PER_WIDTH: usize = 40;
/// Mean difference of a channel over a block and its neighbours from which something is lacking: a thing that
/// hides a tenth of full contrast, several times what training leaves after its first hundreds of steps.
pub(crate) const LACKING: f32 = 0.1;
/// Images that a round looks at before it takes the one that lacks most.
pub(crate) const LOOKS: usize = 3;
/// Other images that places are compared in: as many as see something at about a time in sets with one image
/// of each moment.
pub(crate) const COMPANIONS: usize = 6;
/// Depths tried along a ray through the scene's box: about as fine as the blocks.
pub(crate) const DEPTHS: usize = 96;
/// Part of the warm-up, its last, whose images tell how well the start is shown.
pub(crate) const PART_OF_WARMUP: f64 = 0.125;
/// Part of a schedule over whose iterations errors of images are averaged: 160 of the shortest, some images
/// of every camera and of every stretch of time.
pub(crate) const SHARE_OF_MEANS: f64 = 0.04;
/// Part of a schedule after which the images are seen again, once the window is whole: what is followed has
/// recovered from the last step of the window by then.
pub(crate) const SEEN_AGAIN_AFTER: f64 = 0.1;
/// Part of a schedule after which the motion is judged, counted likewise, long enough after that for
/// what is followed to have become better by a quarter at least.
pub(crate) const JUDGED_AFTER: f64 = 0.25;
/// Error of the images, over that of the start, from which a motion may not be followed, and …
pub(crate) const FAR_ABOVE_START: f64 = 4.0;
/// … part of it that is still there when it is judged. In 17 trainings that followed what moves, an error of
/// four times that of the start or more fell to 0.25 to 0.74; in the one that did not, it stayed
/// (docs/experiments.md).
pub(crate) const MOST_LEFT_IF_FOLLOWED: f64 = 0.85;
/// Part of a schedule, its last, whose images tell what is not followed: some dozens of every part of the
/// window in the shortest.
pub(crate) const SHARE_OF_END: f64 = 0.1;
/// Parts of the window whose images' errors are compared.
pub(crate) const PARTS_OF_WINDOW: usize = 10;
/// Images of each time from which errors of different times are compared.
pub(crate) const COMPARED_IMAGES_PER_TIME: f32 = 3.0;
/// Error of the images of a part of the window, over the median of the parts, from which what moves in that
/// part may not be followed: 3.2 and 3.3 in two trainings that lost something, 2.0 and 2.3 in two that did
/// not (docs/experiments.md). A false alarm costs the time of another attempt; the better one is kept.
pub(crate) const FAR_ABOVE_OTHERS: f64 = 2.75;
/// Pace of a schedule under a budget from which there is no time for another attempt: it has a schedule half
/// as long again and half of the time left, and would go on at two to three times this pace.
pub(crate) const HASTY_PACE: f64 = 1.25;
/// Mean squared change of brightness between neighbouring times over its variance, above which it is no
/// light. Values without order in time have two; after a trial of 500 iterations it was 0.16 to 0.23 for
/// three bodies that turn under a sun, and 0.47 to 1.14 in four scenes without one.
pub(crate) const SMOOTH_BRIGHTNESS: f64 = 0.3;
/// Largest difference of a channel between the colours of one thing in two images: shading turns with the
/// view, and a block holds some background.
pub(crate) const AGREEING_COLOR: f32 = 0.25;
/// Fewest other images that have to lack the colour at a place, beside two thirds of those that see it: with
/// one, any two rays agree somewhere.
pub(crate) const AGREEING_IMAGES: usize = 2;
/// Turns of the fixed-point iteration for a canonical position; a motion that changes distances by a half at
/// most gains a digit in three.
pub(crate) const INVERSION_TURNS: usize = 8;
/// Largest distance of a proposal from where it was to be, in its standard deviations.
pub(crate) const MISPLACED: f32 = 1.0;
/// Standard deviation of a proposal over the width of its block at its depth: neighbours overlap.
pub(crate) const PROPOSED_SCALE: f32 = 0.5;

// Schedule of source training

/// Image width that the iterations of the quick preset are for, pixels: that of the scenes that it was
/// measured on.
pub(crate) const REFERENCE_WIDTH: f32 = 160.0;
/// Largest factor by which larger images multiply iterations: it bounds the time that training takes.
pub(crate) const MAX_STRETCH: f32 = 3.0;
/// Distance of the cameras of the published synthetic scenes from their centre, world units.
pub(crate) const REFERENCE_DISTANCE: f32 = 4.0;
/// Least width of images of a coarse level, pixels: on fewer, silhouettes are all that is left.
pub(crate) const COARSEST_WIDTH: u32 = 100;
/// Part of the largest number of Gaussians that random first points may be: with a full budget from the start
/// those in wrong places keep others from where they are needed, which cost two decibels on a set with one
/// image per time.
pub(crate) const FIRST_SHARE: f64 = 0.75;
/// Fewest Gaussians of a budget by pixels: those of the quick preset.
pub(crate) const FEWEST_BUDGETED: usize = 4000;
/// Most Gaussians of a budget by pixels: a step of twice as many takes half a second on two cores.
pub(crate) const MOST_BUDGETED: usize = 40_000;
/// Viewpoints that the end of the static warm-up sees of a camera that jumps: about as many as a capture with
/// still cameras has. Other numbers were tried without the images of all times before them alone
/// (docs/experiments.md).
pub(crate) const FIRST_VIEWPOINTS: usize = 10;
/// Least spread of the places of the warm-up's viewpoints over that of all: in random order it is near one,
/// on half a circle it is reached after 79 degrees.
pub(crate) const FIRST_SPREAD: f64 = 0.5;
/// Front of the growing time window from which frames are drawn more often, as a fraction of the whole: a
/// step and a half of the quick preset's thirty.
pub(crate) const WINDOW_FRONT: f32 = 0.05;
/// Length of each end of the whole window whose frames are repeated, as a fraction of the window.
pub(crate) const WINDOW_EDGE: f32 = 0.1;

// Priors of the motion

/// Least canonical distance of neighbours that is divided by, world units: far below any spacing.
pub(crate) const MIN_REST_LENGTH: f32 = 1e-6;
/// Least deformed distance that is divided by, world units: below the rounding of coordinates near 1.
pub(crate) const MIN_LENGTH: f32 = 1e-9;
/// Displacement beyond which the static regulariser takes a Gaussian to move, as a fraction of the scene's
/// extent: two to three pixels of an image 160 pixels wide.
pub(crate) const STATIC_SCALE: f32 = 0.01;
/// Displacement below which the static regulariser fades, as a fraction of the scene's extent, so that it
/// does not change signs around rest: far below a hundredth of such a pixel.
pub(crate) const AT_REST: f32 = 1e-5;
/// Fraction of the points asked for that carving must find; with fewer, silhouettes say too little and the
/// whole box is filled.
pub(crate) const LEAST_CARVED_FRACTION: f32 = 0.25;
/// Fraction of the first Gaussians that fill the balls at the starts of the tracks, most of them: images show
/// the surroundings at all times, but the pose of a moving thing once or twice.
pub(crate) const TRACKED_FRACTION: f32 = 0.6;
/// Radius of the ball around a track's start whose Gaussians follow it, in radii of the track: its own, and a
/// tenth for Gaussians that reach beyond it.
pub(crate) const GUIDED_RADII: f32 = 1.1;

/// Fewest first Gaussians of a thing in flight: the corners of a cube.
pub(crate) const FEWEST_OF_THING: usize = 8;
/// Gaussians for every pixel of its surface where there is no budget: the one that presets take.
pub(crate) const SHARE_OF_PIXELS: f32 = 0.25;

// Shadows (method §5.10)

/// Times at which motions are compared, evenly over the window: those of a common capture.
pub(crate) const SAMPLES_OF_SHADOW: usize = 33;
/// Thickness of what is flat, all places that it comes to included, and of a layer of points at rest, in the
/// extent of what moves (root mean square): a sphere has 0.6, a cube as much.
pub(crate) const FLAT: f64 = 0.25;
/// Distance from the middle of an object, in its median, beyond which Gaussians are not what shows where it
/// is: a ball's or a disc's are all nearer than 1.5.
pub(crate) const STRAY: f64 = 2.0;
/// Distance from a path within which points at rest may be of the surface that carries it, in the extent of
/// what moves on it: a disc, and as much around it.
pub(crate) const BY_PATH: f64 = 3.0;
/// Error of a shadow's path, in what the path strays from its mean: that of tracks of trained Gaussians.
pub(crate) const SHADOW_ERROR: f64 = 0.05;
/// How much nearer a shadow has to be to a path than the even motion nearest to it: what moves evenly is any
/// body's shadow in some light.
pub(crate) const SHADOW_GAIN: f64 = 3.0;
/// Weight of a shadow's middle being where the middle of its caster is cast: it decides the slope of the
/// light only where heights do not.
pub(crate) const SHADOW_CENTER: f64 = 0.01;
/// Height of the lowest lamp that is tried, in that of the highest place of the caster.
pub(crate) const LOWEST_LAMP: f64 = 1.1;
/// Lamps that are tried, evenly in one over their height.
pub(crate) const LAMPS: usize = 64;
/// Error of a lamp, in that of the best sun, at which it is taken: less light explains less by chance.
pub(crate) const LAMP_GAIN: f64 = 0.5;

// Light that stands still (method §5.11)

/// Directions in which a sun is sought, some ten degrees apart, and how many times as many near the best one.
pub(crate) const SUNS: usize = 400;
pub(crate) const SUNS_NEAR: usize = 30;
/// Weight of a coefficient of light from everywhere being zero, in that of all brightnesses: it decides those
/// that no surface shows.
pub(crate) const LIGHT_RIDGE: f64 = 1e-4;
