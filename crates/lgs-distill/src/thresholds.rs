//! Every constant that decides something in stage 1 and is no configuration key, with its reason.
//!
//! Fractions of a displacement are of the object's root mean square displacement over the window.

/// Fewest samples of a window. Second differences, folds without a fifth of the samples, and polynomials of
/// degree 2 with something left to validate them need eight.
pub const FEWEST_SAMPLES: usize = 8;
/// Distance of a sample time from the even grid, as a fraction of its spacing: an error of a fiftieth of a
/// step in time is one of a fiftieth of a step's motion.
pub(crate) const SPACING_TOLERANCE: f64 = 0.02;
/// Particles of a sample that stands for an object: a median of 400 scatters by 6 % of the spread.
pub(crate) const SAMPLE_SIZE: usize = 400;

/// Motion that images do not resolve, as a fraction of a pixel.
pub(crate) const UNRESOLVED_FRACTION: f32 = 0.1;

// Denoising

/// Turns of a robust fit; poses and shape no longer change after two or three.
pub(crate) const TURNS: usize = 6;
/// Residual of a particle over the window, in medians over the particles, at which its weight is a quarter;
/// beyond, it falls with the fourth power. Normal noise exceeds three medians in one of ten thousand.
pub(crate) const OUTLIER_MEDIANS: f64 = 3.0;
/// The same for the residual of a particle at one sample. A part that slips for a while is many particles,
/// not one in ten thousand: already the farther half of the particles counts less.
pub(crate) const MOMENTARY_OUTLIER_MEDIANS: f64 = 1.0;
/// A residual is as good as another one, or as noise, up to this factor: fits of a few dozen samples with a
/// different number of unknowns scatter by that much.
pub(crate) const RESIDUAL_SLACK: f64 = 1.5;
/// A residual is as good as another one, too, if it exceeds it by this fraction of the displacement: a source
/// model follows a motion no better.
pub(crate) const RESIDUAL_TOLERANCE: f64 = 0.02;
/// A smoothing degree whose validation score exceeds the best one by this factor is as good: lower degrees
/// have quieter derivatives.
pub(crate) const SCORE_SLACK: f64 = 1.03;
/// Highest degree of a smoothing polynomial: least squares on T even samples is well conditioned up to a
/// degree of about 2√T; this is that of 49 samples.
pub(crate) const HIGHEST_DEGREE: usize = 14;

// Segmentation

/// Standard deviations of the smoothed noise that an edge of the graph may change its length by.
pub(crate) const NOISE_DEVIATIONS: f64 = 3.0;
/// A group of which its own motion leaves more than this fraction of the displacement is no rigid body …
pub(crate) const UNEXPLAINED_FRACTION: f64 = 0.12;
/// … and, if this many of it would not make up all moving particles, no soft body either, but outliers; nor
/// does a change of objects matter that is no larger.
pub(crate) const OUTLIER_SHARE: usize = 20;
/// Groups are merged if a motion of both leaves of each at most this many times its own residual, and
/// [`RESIDUAL_TOLERANCE`]: one motion for two groups has half as many unknowns per particle.
pub(crate) const MERGED_RESIDUAL: f64 = 2.0;
/// Neighbourhoods whose motions are tried for the parts of a group of two bodies: each part holds some of
/// them unless it is a twentieth of the group …
pub(crate) const NEIGHBORHOODS: usize = 20;
/// … and their size, as a part of the group: one that small lies within one body, if it is not at the joint.
pub(crate) const NEIGHBORHOOD_SHARE: usize = 12;
/// Rounds of fits and assignments; what changes after three are single particles at the joint.
pub(crate) const SETTLING_ROUNDS: usize = 4;
/// Rounds in which particles join a deforming body, whose motion changes with each: it grows from a piece of
/// a tenth by a quarter a round.
pub(crate) const JOINING_ROUNDS: usize = 24;
/// Two motions part a group if each leaves of its part at most this fraction of what one motion leaves of
/// all: two have twice the unknowns, and a body cut at random gains a few per cent.
pub(crate) const PARTED_RESIDUAL: f64 = 0.5;
/// Share of the weight of all that moves which has to move as far as what other motions are measured by: each
/// of ten equal bodies has as much, and those that flew off in `passing-spheres` were a thirtieth of all.
/// Where a single body is less than a tenth, what only wobbles beside it is not told from it here, but by
/// images (`unseen_motion`).
pub(crate) const FASTEST_SHARE: f64 = 0.1;
/// Displacements in a feature of k-means, at times spread evenly over the window (method §5.1).
pub(crate) const DISPLACEMENTS: usize = 8;
/// Weight of the first position in a feature (method §5.1).
pub(crate) const POSITION_WEIGHT: f64 = 0.1;

// Shared support

/// Particles lighter than this fraction of the mean weight (outliers, faint ones) are no members.
pub(crate) const LIGHTEST: f64 = 0.3;
/// Angle per window below which a turn says nothing about its centre, rad: the centre follows from the shift
/// by division with the angle, and is three times as noisy as the points.
pub(crate) const LEAST_TURN: f64 = 0.3;
/// Products of inertia of a balanced support, as a fraction of its mean square extent.
pub(crate) const BALANCED: f64 = 1e-3;
/// Particles considered in exchanges, and the finest exchanges that pairs are made of: a million pairs take a
/// few milliseconds.
pub(crate) const CONSIDERED: usize = 1000;

// Laws

/// Ridge of accelerations' least squares, as a fraction of a column's square.
pub(crate) const ACCELERATION_RIDGE: f64 = 1e-4;
/// Exponent over the window by which a potential may push apart: over three windows it is a factor of three.
pub(crate) const MOST_GROWTH: f64 = 0.35;
/// Rate of a law times the spacing of the samples: Eq. 5 is stable up to 2, and a quarter of that still
/// resolves the motion.
pub(crate) const MOST_RATE: f64 = 0.5;
/// Forecast error, as a fraction of the displacement, above which a law does not explain a motion …
pub(crate) const UNEXPLAINED_FORECAST: f64 = 0.01;
/// … and above which it does not even describe it.
pub(crate) const UNDESCRIBED_FORECAST: f64 = 0.1;
/// Reach of a rollout to three windows that stays where the object was, in units of the reach in one.
pub const MOST_REACH: f64 = 1.5;
/// Rounding of 32-bit parameters of a law, as a fraction of its scales: anything smaller is no term.
pub(crate) const PARAMETER_ROUNDING: f64 = 1e-4;

/// Least standard deviation of a pose, as a fraction of what images do not resolve at one place (a tenth of a
/// pixel): a pose is the mean over a body, of which some dozen places are independent.
pub(crate) const KNOWN_FRACTION: f64 = 0.2;

// Laws in generalised coordinates

/// χ² for each sample above which the poses do not have a joint at all: its laws need no fit. Tracks of
/// images are off at the ends of a window by more than their noise.
pub(crate) const MOST_KINEMATIC: f64 = 10.0;
/// Singular values, as a fraction of the largest, below which a direction is not determined: that of a point
/// along a fixed axis, of which rounding and noise leave less.
pub(crate) const UNDETERMINED_DIRECTION: f64 = 1e-4;
/// Radius of a rolling body, in root mean square distances of its particles from their centre, beyond which
/// it does not touch what it would roll on: those of a ring are one radius away, those of a ball three
/// quarters, and a rim may weigh less than its hub.
pub(crate) const FARTHEST_CONTACT: f64 = 5.0;
/// The same, below which a body does not roll but has a place that its source lets drift, or slides as it
/// turns: the axle of a yo-yo, the thinnest thing that anything rolls on, has a tenth of its rim's radius.
pub(crate) const NEAREST_CONTACT: f64 = 0.1;
/// Cosine of the angle between the axes of two bodies up to which they may turn about one: poses with errors
/// of a few degrees tell an axis to some ten degrees from a turn of half a radian.
pub(crate) const PARALLEL_AXES: f64 = 0.95;
/// Coefficients of the paths, polynomials in time, by which a centre of mass is told from other points of a
/// turning body: a straight line and a parabola.
pub(crate) const CENTER_COEFFICIENTS: [usize; 2] = [2, 3];
/// Distance of the centre of the particles from a hinge's axis, in radii of the body, below which the body
/// counts as balanced and weight has no torque: the centre of what is seen is that of the mass to about as
/// much.
pub(crate) const LEAST_ARM: f64 = 0.1;
/// The smallest moment of inertia, as a fraction of the trace of the second moments: that of a needle thirty
/// times as long as it is thick.
pub(crate) const LEAST_MOMENT: f64 = 1e-3;
/// Windows over which the forecast of a law is judged, backward and forward.
pub(crate) const JUDGED_WINDOWS: [f64; 2] = [-1.0, 3.0];
/// Times in a window at which bands are computed.
pub(crate) const TIMES_IN_WINDOW: usize = 16;
/// Points of a body that stand for its particles in a band: the shares of points inside of a radius are then
/// known to some per cent.
pub(crate) const BAND_POINTS: usize = 48;
/// Laws that are kept to judge edited forecasts by: the radius that holds 90 % of their motions is known to a
/// tenth, and a rival with a tenth of the weight is among them three times.
pub(crate) const DRAWN_LAWS: usize = 32;
/// Draws by which the error of a blocked forecast is expected: known to a tenth, which decides at three
/// deviations.
pub(crate) const FORECAST_DRAWS: usize = 48;
/// Shares of the window at either end whose law is sought where none explains all of it, the shortest first:
/// what is let go late shows too little to forecast more than its own length.
pub(crate) const PART_SHARES: [f64; 3] = [1.0 / 3.0, 0.5, 0.75];
/// Length before such a part, in its own, over which a law of the beginning has to be trusted: that which a
/// law has to be trusted beyond a window's end to explain it.
pub(crate) const BACKWARD: f64 = 0.5;
/// Fewest samples of such a part: each third, which the other two forecast, has five.
pub(crate) const FEWEST_OF_PART: usize = 15;
/// Weight below which a rival is not told of.
pub(crate) const LEAST_WEIGHT: f64 = 0.01;
/// Most modes: a law of more amplitudes has more unknowns than a window of a few dozen samples determines.
pub(crate) const MOST_MODES: usize = 4;
/// Most laws of the centre of a body that deforms in flight, the likeliest, that each law of its deformation
/// is put together with.
pub(crate) const MOST_CENTERS: usize = 3;
/// Directions of the shape thinner than this part of it have no strain of their own.
pub(crate) const FLAT_SHAPE: f64 = 1e-3;
/// Error of a law over the window, in units of what a source may err smoothly, beyond which no law describes
/// the motion within such errors either: a law that does leaves at most √6 of them (χ² of 2 in each of three
/// coordinates), and one fitted for these errors is hardly twice as close as one fitted for smaller ones.
pub(crate) const BEYOND_SMOOTH: f64 = 5.0;
/// Deviation of the cosine between two normal modes in the inner product of a body's particles: how far its
/// mass may be spread otherwise than they are, as for moments of inertia.
pub(crate) const OBLIQUE_SPREAD: f64 = 0.3;
/// Linearisations of the fit of a law with its geometry, which begins at the least squares of both by
/// themselves.
pub(crate) const GEOMETRY_STEPS: usize = 12;
/// Most laws of one motion that are fitted with their geometry, the likeliest: four centres of mass with six
/// laws of a flight.
pub(crate) const MOST_GEOMETRIES: usize = 24;
/// Deviation of a constant of the inertia, over that of its prior, below which poses tell of it: they have
/// then taken away a fifth of its variance.
pub(crate) const TOLD: f64 = 0.9;
/// Part of an unknown's deviation by which it is found how the unknown moves the poses.
pub(crate) const PROBED_DEVIATIONS: f64 = 0.1;
/// Changes of the unknowns of a law by which it is found whether they stay in its window.
pub(crate) const PROBED_CHANGES: usize = 32;
/// Mean probability of these, over what they have to first order, below which unknowns are bound together
/// along a curve: a draw in ten tries.
pub(crate) const LIKELY_CHANGES: f64 = 0.1;
/// Typical changes in that fit, in standard deviations of what is changed.
pub(crate) const SCALE_DEVIATIONS: f64 = 10.0;
/// Score behind the best, in units of χ², beyond which a law is left out: it is `e⁻¹⁵` times as likely.
pub(crate) const NO_RIVAL: f64 = 30.0;
/// Rounds in which configurations of a joint and the shape in it are fitted to poses in turn: the first has
/// them to within their noise.
pub(crate) const NEAREST_ROUNDS: usize = 2;
/// Rounds of the fit of an axis; the residual is a few degrees at most, and the fit is quadratic.
pub(crate) const AXIS_ROUNDS: usize = 4;

// Contact

/// χ² for each independent value of rotations about their mean up to which a body does not turn.
pub(crate) const STILL: f64 = 2.0;
/// Distance from a path, in extents of the body, up to which points at rest can be what it collides with.
pub(crate) const NEAR_PATH: f64 = 3.0;
/// Roughness of a plane of points at rest, and distance at which a body keeps clear of it, in extents of the
/// body: Gaussians lie within their surface by a part of their own size.
pub(crate) const NEAR: f64 = 0.03;
/// Mean distance between the lowest point of a body and a plane that carries it, in extents of the body: a
/// source's points of a floor fill a layer below its surface, a third of a ball's diameter thick.
pub(crate) const ON_PLANE: f64 = 0.3;
/// Distance of points at rest, in extents of the body, up to which a place between them belongs to their
/// plane.
pub(crate) const WITHIN_REACH: f64 = 1.5;
/// Most further planes that a motion is expected to meet: those of a room.
pub(crate) const MOST_WALLS_AHEAD: usize = 5;
/// Times over three windows at which a body is compared with planes that it may go through: between two of
/// them it moves by less than its extent, or too fast for a tenth of the window to show it.
pub(crate) const EXPECTED_TIMES: usize = 240;
/// Error after an impact, as a fraction of the path in the window, up to which a law with a contact describes
/// a motion: impacts amplify small errors, but not to half of the way.
pub(crate) const MOST_AFTER_IMPACT: f64 = 0.1;

// Descents of laws (Levenberg–Marquardt)

/// Iterations; a descent stops by itself long before.
pub(crate) const ITERATIONS: usize = 40;
/// Relative improvement at which a descent stops: a part of the cost that no forecast shows.
pub(crate) const CONVERGED: f64 = 1e-9;
/// First damping, as a fraction of the diagonal; a failed step raises it tenfold, a good one lowers it as
/// much.
pub(crate) const FIRST_DAMPING: f64 = 1e-4;
/// Steps that may fail in a row: the last is ten million times as damped as the first.
pub(crate) const TRIALS: usize = 8;
/// Step of a forward difference, as a fraction of the unknown: some times the root of the machine precision …
pub(crate) const DIFFERENCE: f64 = 1e-6;
/// … and of an unknown that is smaller than this, as a fraction of this.
pub(crate) const SMALLEST_UNKNOWN: f64 = 1e-2;

// Networks

/// Networks have to forecast better than the law alone by this factor, or to describe the window better by it
/// and stay near for three windows: a motion whose turning point lies in the held-out part cannot be
/// forecast, and is still described.
pub(crate) const NETWORK_GAIN: f64 = 0.5;
/// Factor of the rollout steps that networks under the rigid constraint get, as they have no matching before.
pub(crate) const CONSTRAINED_STEPS: usize = 8;

// Scene

/// Errors inside of the window, in units of what the source cannot resolve (a tenth of a pixel), that no
/// image shows: half a pixel.
pub(crate) const UNRESOLVED_ERRORS: f64 = 5.0;

/// An object whose system leaves more than this fraction of its displacement is not described by it, nor is
/// one whose law forecasts parts of the window that badly.
pub(crate) const UNDESCRIBED_FRACTION: f64 = 0.5;
/// An object whose system misses the end of the window, forecast from its beginning, by more than this
/// fraction of its displacement …
pub(crate) const POOR_FORECAST_FRACTION: f64 = 0.07;
/// … is a part of others that the source follows badly, if their motions leave less than this fraction of the
/// residual at rest.
pub(crate) const LEFT_BY_OTHERS_FRACTION: f64 = 0.6;

// The paper's networks

/// First samples that a particle's starting velocity is read from: a parabola leaves three of them over.
pub(crate) const VELOCITY_SAMPLES: usize = 6;
