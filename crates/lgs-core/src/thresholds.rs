//! Constants that decide something in this crate, each with its reason.

/// Least determinant of a symmetric 3×3 matrix over the cube of its scale. For the curvature of a fitted
/// rotation it is about (s₂ + s₃)/s₁ of the signed singular values, where coordinates in single precision
/// leave about 1e-7 of noise.
pub const LEAST_DETERMINANT: f64 = 1e-6;

/// Least pivot of a positive definite matrix, whatever its scale: squares of lengths that single precision
/// still holds.
pub const LEAST_PIVOT: f64 = 1e-30;

/// How strongly a degenerate fit is drawn to the identity, over its norm: rotations that the points leave
/// open are not made, and those that they show lose less than single precision shows of a length.
pub(crate) const DEGENERATE_PULL: f64 = 1e-5;

/// Mean squared error below which images count as equal, 100 dB: one value of 150,000 is off by a step of
/// 255.
pub(crate) const LEAST_MSE: f64 = 1e-10;

/// Ridge of an affine fit towards another map, as a fraction of the source's variance: a direction thinner
/// than a thousandth of the whole says nothing.
pub(crate) const AFFINE_RIDGE: f64 = 1e-6;

// Motions of cameras

/// Places across an image at which the displacement of a camera is sampled; it is nearly linear in them.
pub(crate) const DISPLACEMENT_SAMPLES: u32 = 5;
/// Distance from the middle of the scene of the points by which motions of cameras are compared, as a part of
/// the cameras' distance: half-way to the edge of the image of a lens of fifty degrees.
pub(crate) const GAUGE_RADIUS: f64 = 0.25;
/// Part of a motion of the world that is left beside those before it and counts as one more: far above the
/// rounding of sums over a thousand cameras, far below what lies apart.
pub(crate) const LEAST_DIRECTION: f64 = 1e-6;

/// Directions at which harmonics are compared with rotated ones: sixteen would tell the coefficients up to
/// degree 3; twice as many, evenly spread, do so without loss of digits.
pub(crate) const DIRECTIONS_OF_HARMONICS: usize = 32;
