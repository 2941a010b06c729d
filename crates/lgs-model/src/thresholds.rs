//! Constants that decide something and are no settings, with their reasons.

/// One in so many Gaussians contributes to the agreement of velocity field and deformation: the mean over a
/// quarter of thousands of Gaussians stands for all, at a quarter of the cost.
pub(crate) const AGREEMENT_STRIDE: usize = 4;

// Edited motions (method §5.4)

/// Windows of time over which the step of an edited motion is chosen: as far as forecasts are asked for.
pub(crate) const RESOLVED_WINDOWS: f64 = 3.0;

// Shadows (method §5.10)

/// Least height of a lamp above what casts a shadow, in its height above the plane: what comes near the lamp
/// has no shadow on the plane.
pub(crate) const BELOW_LAMP: f64 = 0.05;
/// Units of time by which the end of the window, which is of single precision, is met.
pub(crate) const END_OF_WINDOW: f64 = 1e-6;

// Control nodes (method §3.6)

/// Opacity from which a Gaussian of the warm-up is taken for a part of the scene: half-transparent ones are
/// often floaters, and farthest points would find them first.
pub(crate) const NODE_OPACITY: f32 = 0.5;
/// Features of white less those of black, in radii: colours that differ by half of that weigh 0.6, so that
/// shades of a surface mix and things of different colours hardly do.
pub(crate) const COLOUR_REACH: f32 = 2.0;
/// Length that counts as much as a unit of features in the choice of the first nodes, in half extents of the
/// scene: a tenth of its range, the first radius of SC-GS.
pub(crate) const FIRST_RADIUS: f32 = 0.2;
/// Radius of the first nodes, in distances within which every Gaussian has a node: its own node weighs 0.4 at
/// that distance.
pub(crate) const RADIUS_OF_COVER: f32 = 0.7;
/// Radius of a node that takes over a part of another one's Gaussians, in radii of that one: half the volume.
pub(crate) const SHARED_RADIUS: f32 = 0.8;
/// Change of its logit: a new node begins with little weight, so that nothing jumps.
pub(crate) const SHARED_LOGIT: f32 = -2.0;
/// Sum of weights over Gaussians below which nothing follows a node: less than one Gaussian.
pub(crate) const IDLE_LOAD: f32 = 0.5;
/// Discord of a node that asks for another one, in means over moving nodes.
pub(crate) const UNEVEN: f32 = 2.0;
/// Most nodes added at a time: the next ones are chosen knowing what these have changed.
pub(crate) const MOST_ADDED: usize = 8;
/// Largest displacement of a node that rests, in half extents of the scene: a pixel or two of an image 160
/// pixels wide.
pub(crate) const RESTING: f32 = 0.02;
/// Times at which a node's displacement is looked at, evenly over the window.
pub(crate) const MOTION_SAMPLES: usize = 6;
/// Least distance of two nodes that is divided by, world units.
pub(crate) const LEAST_SPACING: f32 = 1e-4;
/// Time between the three poses that give an acceleration: a fortieth of the recording, within which motion
/// is a parabola.
pub(crate) const ACCELERATION_STEP: f32 = 0.025;
/// The acceleration is looked at in one of so many iterations, with as much more weight: it takes three
/// evaluations of the network.
pub(crate) const ACCELERATION_STRIDE: usize = 4;

// Recorded motions

/// Part of a recording's length after its end over which a law that takes no notice of it is brought to where
/// the recording ends: some images of a video, short beside what is forecast.
pub(crate) const HANDOVER: f64 = 0.1;
/// Part of a recording at either end that gives the velocity at which a free body goes on: as short.
pub(crate) const END_OF_RECORDING: f64 = 0.1;

// Light that stands still (method §5.11)

/// Least irradiance of a surface, over the mean of all: a polynomial of second degree is below zero where a
/// sun alone lights nothing.
pub(crate) const LEAST_IRRADIANCE: f64 = 0.05;
