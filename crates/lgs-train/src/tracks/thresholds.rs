//! Every constant of paths from silhouettes that decides something, with its reason.

// Silhouettes

/// Width that images are reduced to about, pixels: blobs need no detail, and finer texture closes up.
pub(super) const SILHOUETTE_WIDTH: u32 = 100;
/// Difference of a channel from the camera's median image from which a pixel counts as moving: twenty of 255
/// levels, above the noise of compression.
pub(super) const SILHOUETTE_DIFFERENCE: f32 = 0.08;
/// Fewest images of a camera whose median shows its surroundings: of six, something may pass in two.
pub(super) const FEWEST_IMAGES: usize = 6;
/// Gaps of up to twice this many pixels in a silhouette are closed.
pub(super) const CLOSING_RADIUS: usize = 2;
/// Fewest pixels of a blob: fewer have no radius to speak of.
pub(super) const FEWEST_PIXELS: usize = 8;

// Voxels that silhouettes agree on

/// Voxels along an edge of the scene's box: each is about two pixels of a silhouette wide.
pub(super) const VOXELS: usize = 48;
/// Time over which a silhouette counts for a moment, as a fraction of the whole: two steps of [`MOMENTS`] to
/// either side.
pub(super) const VOTE_REACH: f32 = 0.04;
/// Weight of a silhouette that misses a voxel, over that of one that covers it: a miss excludes the voxel, a
/// cover leaves a whole cone.
pub(super) const MISS_WEIGHT: f32 = 2.0;
/// Voxels considered per moment: the volume of a ball with a radius of four and a half voxels.
pub(super) const CANDIDATES: usize = 400;
/// Distance between moments, as a fraction of the box's half side, that costs [`STRIDE_COST`].
pub(super) const STRIDE: f32 = 0.06;
/// Cost of one stride, as a fraction of all votes; costs grow with the square, so that a jump of a quarter of
/// the half side costs nearly all votes.
pub(super) const STRIDE_COST: f32 = 0.05;

// Tracks

/// Places that stand for a path of [`CURVE_DEGREE`]: what it strays from straight lines between them is below
/// a thousandth of its extent.
pub(super) const CURVE_PLACES: usize = 1025;
/// Moments at which a path is first looked for, in steps of a fiftieth of the whole.
pub(super) const MOMENTS: usize = 51;
/// Degree of a path's polynomials, which resolve a wavelength per π degrees: two and a half oscillations.
pub(super) const CURVE_DEGREE: usize = 8;
/// Turns of finding the blobs and fitting the path; most of them with the second gate.
pub(super) const CURVE_TURNS: usize = 20;
/// Distance from the path, in radii of the thing, up to which a blob is taken to be its own: at first, and
/// once the path is near.
pub(super) const GATES: [f32; 2] = [1.5, 0.7];
/// Turns with the first gate.
pub(super) const WIDE_TURNS: usize = 5;
/// Distance, in radii, at which a ray's weight has halved: half a pixel for a thing of twenty pixels.
pub(super) const RAY_SCALE: f32 = 0.05;
/// Ridge of the coefficient of degree n: this times n⁶, per ray. It decides only what no ray determines.
pub(super) const CURVE_RIDGE: f64 = 1e-9;
/// Most tracks of a scene.
pub(super) const MAX_TRACKS: usize = 6;
/// Fewest blobs that a path must pass through: the ray of each gives two equations, a path has one
/// coefficient more than [`CURVE_DEGREE`] for each coordinate, and with fewer than twice as many equations as
/// unknowns there is a path through blobs of nothing.
pub(super) const FEWEST_BLOBS: usize = 3 * (CURVE_DEGREE + 1);
/// Longest stretch without a blob, as a fraction of the whole, that a path may bridge.
pub(super) const LONGEST_GAP: f32 = 0.25;
/// Largest median distance of an accepted path from the rays of its blobs, in radii.
pub(super) const LARGEST_MISS: f32 = 0.1;
/// First guess of a radius, as a fraction of the box's half side.
pub(super) const FIRST_RADIUS: f32 = 0.2;
/// Radii around a path within which it explains a silhouette: the radius is that of a disc of the same area,
/// and things are not round.
pub(super) const EXPLAINED_RADII: f32 = 1.3;

// Flights

/// Width that images are reduced to about where flights are looked for, pixels: gaps between a thing and the
/// hands that let it go are narrower than blobs.
pub(super) const FLIGHT_WIDTH: u32 = 160;
/// Gaps of up to twice this many pixels in a silhouette are closed: those of noise, not those that set a
/// thing apart.
pub(super) const FLIGHT_CLOSING_RADIUS: usize = 1;
/// Distance of a place from the ray of a blob up to which the blob may be that of a ball there, in radii: the
/// ray passes through its middle half.
pub(super) const AGREEING_RADII: f32 = 0.5;
/// Ratio between radii up to which they may be those of one thing: between areas it is two, which half a
/// pixel at the edge makes of a blob of 30 pixels.
pub(super) const SIZE_RATIO: f32 = 1.4;
/// Fewest cameras whose blobs agree on a thing: any two rays that pass each other would do for two.
pub(super) const FEWEST_VIEWS: usize = 3;
/// Share of the views of a place that show something there that moves.
pub(super) const COVERING_VIEWS: f32 = 0.9;
/// Sine of the angle between rays below which their meeting tells nothing of a depth: ten degrees, at which
/// an error across the rays becomes six times as large along them.
pub(super) const LEAST_SINE: f32 = 0.17;
/// Most blobs of a view and most views of a moment that are compared: what there is of both beyond that costs
/// the square of its number.
pub(super) const MOST_BLOBS_OF_VIEW: usize = 12;
/// See [`MOST_BLOBS_OF_VIEW`].
pub(super) const MOST_VIEWS_OF_MOMENT: usize = 32;
/// Fewest moments of a flight: two fix an even motion, and three others that come as it says are no chance.
pub(super) const FEWEST_OF_FLIGHT: usize = 5;
/// Median step between the moments of a flight, in radii, from which a thing has to be led: at half a radius
/// it still covers most of where it was, and images draw its Gaussians after it.
pub(super) const FLIGHT_STEP: f32 = 0.5;
/// Longest step from a moment to the next, in radii, that is tried.
pub(super) const LONGEST_STEP: f32 = 8.0;
/// Deviation from an even motion over three moments, in radii, up to which a thing is the same: what bends
/// its path faster is sampled too coarsely to be told from another thing.
pub(super) const SWERVE: f32 = 0.5;

// Colours of things in flight

/// Levels of each channel by which colours are told apart: 32 of 255, about three times the noise between
/// cameras.
pub(super) const COLOR_LEVELS: usize = 8;
/// Radius, in that of the thing, within which pixels are its own: the edge is mixed.
pub(super) const INNER_RADII: f32 = 0.8;
/// Radius, in that of the thing, beyond which they are not.
pub(super) const OUTER_RADII: f32 = 1.3;
/// Least score in flight by which a thing can be followed: its colours have to be likelier on it than around
/// it by half of what is possible.
pub(super) const LEAST_CONTRAST_OF_COLORS: f32 = 0.5;
/// Part of the score in flight down to which a thing is followed: half of it may be hidden.
pub(super) const LEFT_OF_SCORE: f32 = 0.5;
/// Finest step of the search for it, in radii: a tenth of a pixel of a thing of six pixels.
pub(super) const FINEST_SEARCH: f32 = 0.02;

// Spin of a tracked ball

/// Radius of the ball in reduced images, pixels: a pixel is a degree and a half of its surface.
pub(super) const TEXTURE_RADIUS: f32 = 40.0;
/// Fewest images of the ball: a spin has three constants, and each image shows a part of the surface alone.
pub(super) const FEWEST_IMAGES_OF_BALL: usize = 12;
/// Fewest pixels of the ball in an image that counts: an eighth of its disc at half that radius.
pub(super) const FEWEST_TEXTURED: usize = 150;
/// Half of the window whose mean contrasts are taken against, in radii: wider than a texture's patches,
/// narrower than its shading.
pub(super) const CONTRAST_RADII: f32 = 0.45;
/// Noise of an image, added to the spread within a window: five of 255 levels.
pub(super) const CONTRAST_NOISE: f32 = 0.02;
/// Least mean square of the contrasts of an image: the spread of its pixels is that of the noise.
pub(super) const LEAST_CONTRAST: f32 = 0.25;
/// Most images that are compared.
pub(super) const MOST_VIEWS: usize = 300;
/// Least cosine between a surface and the view of it: rays that graze are off by many pixels.
pub(super) const LEAST_FACING: f32 = 0.35;
/// Points of the surface that are compared, about eleven degrees apart.
pub(super) const SURFACE_POINTS: usize = 250;
/// Pairs of images per image that the first search compares.
pub(super) const PAIRS_PER_VIEW: usize = 4;
/// Most pairs compared: more cost time and say the same.
pub(super) const MOST_PAIRS: usize = 600;
/// Largest turn between the first pairs, radians: half of what one image shows is still in the other.
pub(super) const SPIN_RANGE: f32 = 1.0;
/// Step of the search, as the turn between the first pairs, radians: half of a texture's patch of seven
/// degrees.
pub(super) const SPIN_STEP: f32 = 0.06;
/// Smallest step of the refinement.
pub(super) const SPIN_FINEST: f32 = 0.004;
/// Gain of agreement by a round of the refinement from which its steps stay as they are.
pub(super) const LEAST_GAIN: f32 = 1e-3;
/// Spins of the grid that are refined.
pub(super) const SPIN_CANDIDATES: usize = 6;
/// Growth of the time between pairs from turn to turn: the error that one leaves is small in the next.
pub(super) const SPIN_WIDENING: f32 = 1.6;
/// Least agreement of all pairs: half of the texture's variance is common.
pub(super) const LEAST_AGREEMENT: f32 = 0.5;
/// Largest correction of path and radius, in radii: silhouettes that others cut are off by a quarter.
pub(super) const LARGEST_CORRECTION: f32 = 0.5;
/// Other spins, [`SPIN_RANGE`] away by the mean time between images, that tell what agreement is chance.
pub(super) const OTHER_SPINS: usize = 100;
/// Standard deviations of these above their mean that are no chance.
pub(super) const CHANCE_DEVIATIONS: f32 = 6.0;
