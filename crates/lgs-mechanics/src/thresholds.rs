//! Numbers that decide something, each with its reason, in one place.

// Noise of tracks.

/// Values of ρ that are tried, `0, 0.05, … 0.95`. Beyond the last, noise and motion cannot be told apart in a
/// window.
pub(crate) const CORRELATIONS: usize = 20;
/// Difference of two values of ρ.
pub(crate) const CORRELATION_STEP: f64 = 0.05;
/// Change of a coordinate by a deviation of an unknown, over all that a fit has left of the coordinate, below
/// which the fit cannot have taken up noise by it.
pub(crate) const NOT_TAKEN_UP: f64 = 0.1;
/// Fewest directions of a coordinate that a fit must have left free, or its residuals tell nothing: the
/// deviation is then known to a third.
pub(crate) const FEWEST_LEFT: usize = 5;
/// Values of `r` that are tried: from motions that are nearly parabolas to ones that need every polynomial.
pub(crate) const DECAYS: [f64; 9] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97];
/// Polynomials whose coefficients are free: position and velocity.
pub(crate) const FREE_COEFFICIENTS: usize = 2;
/// Most polynomials of a path; a track has at least three samples for every two.
pub(crate) const MOST_POLYNOMIALS: usize = 40;
/// Relative noise of a track that has none: `f64` residuals of a track of size 1.
pub(crate) const NO_NOISE: f64 = 1e-12;
/// Values of `s` over the noise that are tried, in powers of four up to `4²⁰ = 10¹²`.
pub(crate) const STRENGTHS: i32 = 20;

// Fits.

/// Fewest times: position and velocity are two, and a law needs more than an acceleration to fail at.
pub(crate) const FEWEST_TIMES: usize = 5;
/// Distance in extents of the path at which centres are tried along its principal axes.
pub(crate) const AROUND: f64 = 0.75;
/// Starts whose places are improved, the best by regression.
pub(crate) const IMPROVED: usize = 6;
/// Share by which what regressions leave must differ for them to count as two.
pub(crate) const APART: f64 = 0.01;
/// Half widths of the bumps as parts of the window. Wide ones are the most certain, narrow ones see the rest.
pub(crate) const HALF_WIDTHS: [f64; 3] = [0.5, 0.25, 0.125];
/// Standard deviation of the prior of a fitted centre about the middle of the path, in extents of the path: a
/// centre far outside of the path acts as a uniform field does, which has fewer unknowns.
pub(crate) const CENTRE_PRIOR: f64 = 1.0;
/// Largest change of a residual by which a step may err, in units of its noise, or of the root mean square of
/// all residuals where a motion is far from the track: a hundredth in χ².
pub(crate) const STEP_ERROR: f64 = 0.1;
/// Error of a step of fourth order over its difference to two half steps.
pub(crate) const ERROR_OF_DIFFERENCE: f64 = 16.0 / 15.0;
/// Root mean square residual, in units of the noise, of a motion that is far from the track whatever its
/// steps are: it gets no steps finer than those of first values. A law that is as far from it even in
/// segments, each with a start of its own, gets no other first values.
pub(crate) const FAR: f64 = 10.0;
/// How often a fit is repeated with steps that its own motion asks for.
pub(crate) const REFINEMENTS: usize = 3;
/// Numbers of segments, one after the other, before the whole track is one.
pub(crate) const SEGMENTS: [usize; 2] = [4, 2];
/// Halvings of the step while first values are sought.
pub(crate) const COARSE: u32 = 4;
/// Halvings of the step, from the interval between samples, after which a motion counts as unresolved: a law
/// that changes within a 64th of the interval cannot be read from the samples.
pub(crate) const FINEST: u32 = 6;
/// Part of an unknown's scale by which central differences move it: the cube root of the precision of `f64`,
/// where truncation and rounding errors are equal.
pub(crate) const DIFFERENCE: f64 = 6e-6;
/// Part of the loss that a step must gain: where χ² is ten thousand, a change by one decides nothing, unless
/// it leads away from a saddle.
pub(crate) const LEAST_GAIN: f64 = 1e-4;
/// Steps after each other that may fail to gain as much.
pub(crate) const SLOW_STEPS: usize = 5;
/// Least values of the damping at which a step counts as having failed.
pub(crate) const LARGEST_DAMPING: f64 = 1e10;
/// Error of the integrator in a forecast, as a fraction of the way, and of tracks in single precision: no
/// track is known better.
pub const FORECAST_ERROR: f64 = 1e-4;
/// Times at which two steps are compared.
pub(crate) const COMPARED_STATES: usize = 8;
/// Halvings of a law's step after which a motion counts as not resolved: two more than a fit tries
/// (`FINEST`), since what is outside the window may change faster than what is read from it.
pub(crate) const MOST_HALVINGS: usize = 8;
/// Parts of a duration that a motion is resolved for, each if it is not for the one before: of three windows,
/// the last lies within the first.
pub(crate) const RESOLVED_PARTS: [f64; 3] = [1.0, 0.5, 0.25];

// Choice, bands and verdicts.

/// First values of a candidate from which shooting starts.
pub(crate) const SHOTS: usize = 3;
/// Squares that a regression leaves, over the least that one of any law leaves, up to which the law may be
/// the right one: accelerations of a smooth path have errors that a law of more terms follows.
pub(crate) const PROMISING_LEFT: f64 = 4.0;
/// The same for a law that leaves less than any simpler one: a smooth path of a fast motion has errors that a
/// dozen constants more follow to a tenth.
pub(crate) const NEARLY_PROMISING_LEFT: f64 = 30.0;
/// Most of such laws that are fitted, the simplest: the right one and those that hold it as a special case.
pub(crate) const PROMISING: usize = 8;
/// Surcharge of a gyroscopic term, in halves of an unknown: a circling point can be held by a spring (four
/// unknowns) or by a gyroscopic force (three), and the spring comes first.
pub(crate) const GYROSCOPIC: usize = 3;
/// Surcharge of a term that dissipates, in halves of an unknown: of two laws with as many unknowns, the
/// conservative one is the simpler …
pub(crate) const DISSIPATES: usize = 1;
/// … and of one that may add energy: what slows down evenly is more often braked than driven backward.
pub(crate) const DRIVES: usize = 2;
/// Error over what was promised beyond which a forecast fails: three standard deviations.
pub const FAILS: f64 = 3.0;
/// Times of a window at which bands are compared with the tolerance.
pub(crate) const COMPARED_TIMES: usize = 20;
/// Draws of all candidates together: the 90 % radius is then known to about 3 %.
pub(crate) const DRAWS: usize = 96;
/// Draws beyond the bounds of a parameter after which the nearest allowed values are taken: with half of the
/// posterior inside for each of three parameters, one in 5000 is left.
pub(crate) const REDRAWS: usize = 64;
/// Divisors of a law's step with which a motion is followed where longer steps find no way: at the kink of
/// dry friction a step has to be short against the time in which it stops a body.
pub(crate) const FINER_STEPS: [f64; 3] = [1.0, 4.0, 16.0];
/// First guess of the speed of wind, in lengths of a path over its time: half of what moves a body that far.
pub(crate) const STARTING_WIND: f64 = 0.5;
/// Deviation of the prior of a slope of self-excitation, in inverse windows and extents of the path: that of
/// a saturation of 50, which limits a cycle within a fiftieth of the window, about a centre an extent away.
pub(crate) const SLOPE_SPREAD: f64 = 100.0;
/// Points of a body that stand for its particles in the band of an edited motion: the shares of points inside
/// of a radius are then known to some per cent.
pub(crate) const EDITED_POINTS: usize = 24;
/// Radius of the 90 % band, as a fraction of the path in a window, up to which a forecast is trusted.
pub const TRUSTED_FRACTION: f64 = 0.04;
/// Windows from the first sample on to which the forecast of a law that explains a motion is trusted.
pub(crate) const EXPLAINED_WINDOWS: f64 = 1.5;

// Terms and coordinates.

/// Half width of the region in which a fitted centre is sought, in extents of the path: a centre further away
/// acts like a uniform field.
pub(crate) const PLACE_REACH: f64 = 8.0;
/// Tolerance on the length of a quaternion in a state, and of a normal: that of numbers kept in single
/// precision.
pub(crate) const UNIT_TOLERANCE: f64 = 1e-5;
/// Bound of the logarithm of a moment over its prior: a factor of five.
pub(crate) const MOST_LOG_FACTOR: f64 = 1.6;
/// Deviation of what is not known of the distribution of a body's mass: logarithms of ratios of moments,
/// couplings and tilts of axes, the direction to the centre. A body that is twice as dense in one half, or
/// hollow, differs by up to as much from what its surface shows.
pub(crate) const INERTIA_SPREAD: f64 = 0.3;
/// Bound of an entry of the inverse inertia beside its diagonal, over the root of the two on it: three
/// entries of less than a half keep the matrix positive definite whatever their signs.
pub(crate) const MOST_COUPLING: f64 = 0.49;
/// Rest lengths from which a fit starts, in extents of the path.
pub(crate) const STARTING_LENGTHS: [f64; 3] = [0.25, 0.5, 1.0];
/// Creeping speed, in extents of the path per window: a thousandth of the mean speed.
pub(crate) const CREEPING: f64 = 1e-3;
/// Exponents from which a fit starts.
pub(crate) const STARTING_EXPONENTS: [f64; 3] = [-2.0, -1.0, 2.0];
/// Bound of the exponent on both sides.
pub(crate) const LARGEST_EXPONENT: f64 = 4.0;
/// Distance of the starting centres from the middle of the path, in its extents: inside, and well outside.
pub(crate) const STARTING_DISTANCE: f64 = 0.6;
/// Part of the largest eigenvalue that the smallest ones get, so that the triangular root exists.
pub(crate) const SMALLEST_EIGENVALUE: f64 = 1e-6;

// Integration.

/// Newton steps of the implicit kick; linear forces need one, smooth ones four.
pub(crate) const KICK_STEPS: usize = 50;
/// Part of what the equation of the kick left before, above which a step of Newton's method is halved: where
/// it converges it leaves far less, and about a kink it may go back and forth.
pub(crate) const LEAST_DECREASE: f64 = 0.75;
/// Part of what was left before, up to which derivatives serve for the next step as well: with them, each
/// step leaves a tenth at most, and Newton's own convergence is not needed.
pub(crate) const FAST_DECREASE: f64 = 0.1;
/// Relative change at which the velocity counts as solved: a few units of rounding.
pub(crate) const SOLVED_STEP: f64 = 4.0 * f64::EPSILON;
/// Newton steps of the midpoint rule; smooth accelerations need four.
pub(crate) const MIDPOINT_STEPS: usize = 30;
/// Part of a step below which a time counts as on the grid.
pub(crate) const ON_GRID: f64 = 1e-6;

// Contact.

/// χ² per independent sample below which the law of flights needs no other first values and no samples left
/// out: it explains them.
pub(crate) const GOOD: f64 = 1.2;
/// Samples on either side of an impact from which its velocities are read.
pub(crate) const IMPACT_SIDE: usize = 5;
/// Fewest samples of a side of so many: a parabola leaves one of them over.
pub(crate) const FEWEST_OF_SIDE: usize = 4;
/// Sides in a path at least: five of 46 samples. Over longer ones a motion bends that no parabola follows.
pub(crate) const SIDES_OF_WINDOW: usize = 9;
/// Jump of the velocity over its own noise that is an impact: of normal noise, fewer than one in 10⁸ is.
pub(crate) const IMPACT_JUMP: f64 = 6.0;
/// Change of velocity, over the largest one of a law, up to which an impact is none: a body that comes to
/// rest on a plane meets it again.
pub(crate) const NO_IMPACT: f64 = 0.01;
/// Change of velocity at an impact over the largest one of the track: with a restitution of 0.6, three
/// impacts in a row are above it.
pub(crate) const LEAST_OF_LARGEST: f64 = 0.25;
/// Median length of a vector of three normal numbers.
pub(crate) const MEDIAN_OF_THREE: f64 = 1.538;
/// Directions in which the farthest point is sought.
pub(crate) const DIRECTIONS: usize = 512;
/// Ratio of the second to the largest moment of points under which they lie along a line: the square of what
/// single precision leaves of a length.
pub(crate) const ALONG_A_LINE: f64 = 1e-12;
/// Contact points that carry a body on a plane, at most: three hold it, and a fourth lets it stand on a face.
pub(crate) const MOST_CARRYING: usize = 4;
/// Sweeps over the contact points; four corners of a resting cube need about thirty.
pub(crate) const SWEEPS: usize = 200;
/// Change of the impulses, relative to their sum, at which they count as found.
pub(crate) const SOLVED_IMPULSE: f64 = 1e-12;
/// Rounding of the velocity of a contact point, relative to it: some operations of double precision.
pub(crate) const ROUNDING_OF_VELOCITY: f64 = 16.0 * f64::EPSILON;
/// Parts of a step near the plane: a point that closes slowly is held to an eighth of what it moves in a
/// step.
pub(crate) const CONTACT_PARTS: usize = 8;
/// Impacts within one part after which all contacts count as closed.
pub(crate) const MOST_IMPACTS: usize = 8;
/// Halvings in the search for the time of an impact: to a millionth of a millionth of a part.
pub(crate) const HALVINGS: usize = 40;
/// Height up to which points touch in an impact, over the extent of the body.
pub(crate) const TOUCHING: f64 = 1e-6;
/// Part of a depth below the plane that a resting contact gives back in each part of a step.
pub(crate) const LIFT: f64 = 0.1;
/// Time between the impulses of two bodies up to which they may be one hit, in intervals between samples: an
/// impulse is found between the samples before and after it, and tracks smear it over one more.
pub(crate) const SAME_HIT: f64 = 2.0;
/// Standard deviation of what is given exactly, in radians and extents of the body: far below any noise.
pub(crate) const EXACT: f64 = 1e-6;
/// Share of a body's particles that belong to it: of the others, those may float apart.
pub(crate) const MOSTLY: f64 = 0.95;
/// Spread of the distances of a body's particles from their middle, or of its reach over all directions,
/// relative, up to which it is a sphere: points of a sphere 15° apart leave 1 % of the reach, corners of an
/// icosahedron 6 %, points of a cube's surface 13 % of the distance.
pub(crate) const ROUND: f64 = 0.04;
/// Fewest particles that tell a sphere from a body with corners, all of which may lie equally far from its
/// middle.
pub(crate) const FEWEST_OF_SPHERE: usize = 30;
/// Length, in mean reaches of a body, by which a point must reach farther than others to count as a corner of
/// its own: no better is a shape known.
pub(crate) const FINEST_CORNER: f64 = 0.01;
/// Restitution of a contact that was never seen: dull solids lie between 0 and twice it.
pub(crate) const EXPECTED_RESTITUTION: f64 = 0.3;
/// Friction of a contact that was never seen: the middle of dry solids, 0.2 to 0.6.
pub(crate) const EXPECTED_FRICTION: f64 = 0.3;
/// Planes that are sought among points at rest, a floor and some walls; as many again are, of other surfaces.
pub(crate) const MOST_PLANES: usize = 6;
/// Angle between planes of points at rest, radians, above which they are those of two surfaces.
pub(crate) const OTHER_SURFACE: f64 = 0.5;
/// Fewest points of a plane: with three that any plane goes through, some more that chance does not explain.
pub(crate) const FEWEST_OF_PLANE: usize = 10;
/// Roughness over the tolerance within which points were sought, up to which they cluster about a plane: half
/// of that of points which fill it evenly, 1/√3.
pub(crate) const SHARP: f64 = 0.29;
/// Triples of points that are tried: of a plane that holds a fifth of the points, 400 miss all with a
/// probability of 4 %, and those of a quarter with 0.2 %.
pub(crate) const PLANE_DRAWS: usize = 400;
/// Refinements of a plane by the points near it.
pub(crate) const PLANE_ROUNDS: usize = 4;
/// Largest friction: nothing slides on a slope of 60°.
pub(crate) const MOST_FRICTION: f64 = 1.75;
