//! Every constant of training that decides something and is no configuration key, with its reason. Those of
//! stages 2 and 3 are in `stages/thresholds.rs`.

// Checkpoints

/// Checkpoints kept in a folder: if the machine dies while one is written, the one before is whole.
pub(crate) const KEPT_CHECKPOINTS: usize = 2;
/// Steps between lines of `events.jsonl`: a stage has hundreds of steps, its curve dozens of points or more.
pub(crate) const EVENT_INTERVAL: usize = 10;

// Time budgets

/// Part of the time left that the source may take where all stages follow: measured on scenes with several
/// objects, stages 1 and 2 then have a tenth and the Gaussians of the scene the rest.
pub(crate) const SOURCE_SHARE: f64 = 0.72;
/// Part of the time left that the refinement before stage 2 may take.
pub(crate) const REFINEMENT_SHARE: f64 = 0.3;
/// Part of the time left that the last stage may take: the choice of laws by its Gaussians comes after it.
pub(crate) const LAST_STAGE_SHARE: f64 = 0.93;
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
/// Extent of the published synthetic scenes, whose cameras stand 4 units from the centre, world units.
pub(crate) const REFERENCE_EXTENT: f32 = 4.4;
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

// Silhouettes

/// Width that images are reduced to about, pixels: blobs need no detail, and finer texture closes up.
pub(crate) const SILHOUETTE_WIDTH: u32 = 100;
/// Difference of a channel from the camera's median image from which a pixel counts as moving: twenty of 255
/// levels, above the noise of compression.
pub(crate) const SILHOUETTE_DIFFERENCE: f32 = 0.08;
/// Fewest images of a camera whose median shows its surroundings: of six, something may pass in two.
pub(crate) const FEWEST_IMAGES: usize = 6;
/// Gaps of up to twice this many pixels in a silhouette are closed.
pub(crate) const CLOSING_RADIUS: usize = 2;
/// Fewest pixels of a blob: fewer have no radius to speak of.
pub(crate) const FEWEST_PIXELS: usize = 8;

// Voxels that silhouettes agree on

/// Voxels along an edge of the scene's box: each is about two pixels of a silhouette wide.
pub(crate) const VOXELS: usize = 48;
/// Time over which a silhouette counts for a moment, as a fraction of the whole: two steps of [`MOMENTS`] to
/// either side.
pub(crate) const VOTE_REACH: f32 = 0.04;
/// Weight of a silhouette that misses a voxel, over that of one that covers it: a miss excludes the voxel, a
/// cover leaves a whole cone.
pub(crate) const MISS_WEIGHT: f32 = 2.0;
/// Voxels considered per moment: the volume of a ball with a radius of four and a half voxels.
pub(crate) const CANDIDATES: usize = 400;
/// Distance between moments, as a fraction of the box's half side, that costs [`STRIDE_COST`].
pub(crate) const STRIDE: f32 = 0.06;
/// Cost of one stride, as a fraction of all votes; costs grow with the square, so that a jump of a quarter of
/// the half side costs nearly all votes.
pub(crate) const STRIDE_COST: f32 = 0.05;

// Tracks

/// Moments at which a path is first looked for, in steps of a fiftieth of the whole.
pub(crate) const MOMENTS: usize = 51;
/// Degree of a path's polynomials, which resolve a wavelength per π degrees: two and a half oscillations.
pub(crate) const CURVE_DEGREE: usize = 8;
/// Turns of finding the blobs and fitting the path; most of them with the second gate.
pub(crate) const CURVE_TURNS: usize = 20;
/// Distance from the path, in radii of the thing, up to which a blob is taken to be its own: at first, and
/// once the path is near.
pub(crate) const GATES: [f32; 2] = [1.5, 0.7];
/// Turns with the first gate.
pub(crate) const WIDE_TURNS: usize = 5;
/// Distance, in radii, at which a ray's weight has halved: half a pixel for a thing of twenty pixels.
pub(crate) const RAY_SCALE: f32 = 0.05;
/// Ridge of the coefficient of degree n: this times n⁶, per ray. It decides only what no ray determines.
pub(crate) const CURVE_RIDGE: f64 = 1e-9;
/// Most tracks of a scene.
pub(crate) const MAX_TRACKS: usize = 6;
/// Fewest blobs that a path must pass through: more than it has coefficients per coordinate.
pub(crate) const FEWEST_BLOBS: usize = 12;
/// Longest stretch without a blob, as a fraction of the whole, that a path may bridge.
pub(crate) const LONGEST_GAP: f32 = 0.25;
/// Largest median distance of an accepted path from the rays of its blobs, in radii.
pub(crate) const LARGEST_MISS: f32 = 0.1;
/// First guess of a radius, as a fraction of the box's half side.
pub(crate) const FIRST_RADIUS: f32 = 0.2;
/// Radii around a path within which it explains a silhouette: the radius is that of a disc of the same area,
/// and things are not round.
pub(crate) const EXPLAINED_RADII: f32 = 1.3;

// Flights

/// Width that images are reduced to about where flights are looked for, pixels: gaps between a thing and the
/// hands that let it go are narrower than blobs.
pub(crate) const FLIGHT_WIDTH: u32 = 160;
/// Gaps of up to twice this many pixels in a silhouette are closed: those of noise, not those that set a
/// thing apart.
pub(crate) const FLIGHT_CLOSING_RADIUS: usize = 1;
/// Distance of a place from the ray of a blob up to which the blob may be that of a ball there, in radii: the
/// ray passes through its middle half.
pub(crate) const AGREEING_RADII: f32 = 0.5;
/// Ratio between radii up to which they may be those of one thing: between areas it is two, which half a pixel
/// at the edge makes of a blob of 30 pixels.
pub(crate) const SIZE_RATIO: f32 = 1.4;
/// Fewest cameras whose blobs agree on a thing: any two rays that pass each other would do for two.
pub(crate) const FEWEST_VIEWS: usize = 3;
/// Share of the views of a place that show something there that moves.
pub(crate) const COVERING_VIEWS: f32 = 0.9;
/// Sine of the angle between rays below which their meeting tells nothing of a depth: ten degrees, at which
/// an error across the rays becomes six times as large along them.
pub(crate) const LEAST_SINE: f32 = 0.17;
/// Most blobs of a view and most views of a moment that are compared: what there is of both beyond that costs
/// the square of its number.
pub(crate) const MOST_BLOBS_OF_VIEW: usize = 12;
/// See [`MOST_BLOBS_OF_VIEW`].
pub(crate) const MOST_VIEWS_OF_MOMENT: usize = 32;
/// Fewest moments of a flight: two fix an even motion, and three others that come as it says are no chance.
pub(crate) const FEWEST_OF_FLIGHT: usize = 5;
/// Median step between the moments of a flight, in radii, from which a thing has to be led: at half a radius
/// it still covers most of where it was, and images draw its Gaussians after it.
pub(crate) const FLIGHT_STEP: f32 = 0.5;
/// Longest step from a moment to the next, in radii, that is tried.
pub(crate) const LONGEST_STEP: f32 = 8.0;
/// Deviation from an even motion over three moments, in radii, up to which a thing is the same: what bends its
/// path faster is sampled too coarsely to be told from another thing.
pub(crate) const SWERVE: f32 = 0.5;

// Colours of things in flight

/// Levels of each channel by which colours are told apart: 32 of 255, about three times the noise between
/// cameras.
pub(crate) const COLOR_LEVELS: usize = 8;
/// Radius, in that of the thing, within which pixels are its own: the edge is mixed.
pub(crate) const INNER_RADII: f32 = 0.8;
/// Radius, in that of the thing, beyond which they are not.
pub(crate) const OUTER_RADII: f32 = 1.3;
/// Least score in flight by which a thing can be followed: its colours have to be likelier on it than around
/// it by half of what is possible.
pub(crate) const LEAST_CONTRAST_OF_COLORS: f32 = 0.5;
/// Part of the score in flight down to which a thing is followed: half of it may be hidden.
pub(crate) const LEFT_OF_SCORE: f32 = 0.5;
/// Finest step of the search for it, in radii: a tenth of a pixel of a thing of six pixels.
pub(crate) const FINEST_SEARCH: f32 = 0.02;

// Spin of a tracked ball

/// Radius of the ball in reduced images, pixels: a pixel is a degree and a half of its surface.
pub(crate) const TEXTURE_RADIUS: f32 = 40.0;
/// Fewest pixels of the ball in an image that counts: an eighth of its disc at half that radius.
pub(crate) const FEWEST_TEXTURED: usize = 150;
/// Half of the window whose mean contrasts are taken against, in radii: wider than a texture's patches,
/// narrower than its shading.
pub(crate) const CONTRAST_RADII: f32 = 0.45;
/// Noise of an image, added to the spread within a window: five of 255 levels.
pub(crate) const CONTRAST_NOISE: f32 = 0.02;
/// Least mean square of the contrasts of an image: the spread of its pixels is that of the noise.
pub(crate) const LEAST_CONTRAST: f32 = 0.25;
/// Most images that are compared.
pub(crate) const MOST_VIEWS: usize = 300;
/// Least cosine between a surface and the view of it: rays that graze are off by many pixels.
pub(crate) const LEAST_FACING: f32 = 0.35;
/// Points of the surface that are compared, about eleven degrees apart.
pub(crate) const SURFACE_POINTS: usize = 250;
/// Pairs of images per image that the first search compares.
pub(crate) const PAIRS_PER_VIEW: usize = 4;
/// Most pairs compared: more cost time and say the same.
pub(crate) const MOST_PAIRS: usize = 600;
/// Largest turn between the first pairs, radians: half of what one image shows is still in the other.
pub(crate) const SPIN_RANGE: f32 = 1.0;
/// Step of the search, as the turn between the first pairs, radians: half of a texture's patch of seven
/// degrees.
pub(crate) const SPIN_STEP: f32 = 0.06;
/// Smallest step of the refinement.
pub(crate) const SPIN_FINEST: f32 = 0.004;
/// Gain of agreement by a round of the refinement from which its steps stay as they are.
pub(crate) const LEAST_GAIN: f32 = 1e-3;
/// Spins of the grid that are refined.
pub(crate) const SPIN_CANDIDATES: usize = 6;
/// Growth of the time between pairs from turn to turn: the error that one leaves is small in the next.
pub(crate) const SPIN_WIDENING: f32 = 1.6;
/// Least agreement of all pairs: half of the texture's variance is common.
pub(crate) const LEAST_AGREEMENT: f32 = 0.5;
/// Largest correction of path and radius, in radii: silhouettes that others cut are off by a quarter.
pub(crate) const LARGEST_CORRECTION: f32 = 0.5;
/// Other spins, [`SPIN_RANGE`] away by the mean time between images, that tell what agreement is chance.
pub(crate) const OTHER_SPINS: usize = 100;
/// Standard deviations of these above their mean that are no chance.
pub(crate) const CHANCE_DEVIATIONS: f32 = 6.0;
