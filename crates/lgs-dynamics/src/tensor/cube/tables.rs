//! The tables of numbers by which kernels find a system's arrays.
//!
//! All arrays of an evaluation lie in one buffer, the tape, particle by particle within each; all weights in
//! another, as they are and transposed. A table holds the places of arrays, then every product and every sum
//! over particles, so that a launch names no more than one or two of them.

/// Numbers of a product in the table.
pub(super) const PRODUCT: usize = 12;
/// The numbers of a product, by their place in it: what becomes of the sums,
pub(super) const END: usize = 0;
/// numbers that are summed over,
pub(super) const INNER: usize = 1;
/// and sums of a particle;
pub(super) const COLUMNS: usize = 2;
/// where the factors begin on the tape, and how far one particle's are from the next one's;
pub(super) const FACTORS: usize = 3;
pub(super) const STRIDE: usize = 4;
/// where the weights begin, and how far those of one summand are from the next one's;
pub(super) const WEIGHTS: usize = 5;
pub(super) const WEIGHTS_STRIDE: usize = 6;
/// where the biases begin, or [`NONE`];
pub(super) const BIASES: usize = 7;
/// and where on the tape the arguments of the activation are, and up to two results.
pub(super) const ARGUMENTS: usize = 8;
pub(super) const FIRST: usize = 9;
pub(super) const SECOND: usize = 10;
/// The weights of the output that a last layer's chain begins with.
pub(super) const HEAD: usize = 11;

/// No place.
pub(super) const NONE: u32 = u32::MAX;

/// Ends of a product, with φ the activation at the arguments z: the sums themselves;
pub(super) const PLAIN: u32 = 0;
/// z ← sums, first ← φ(z);
pub(super) const HIDDEN: u32 = 1;
/// z ← sums, first ← φ′(z) w, second ← φ″(z) w for the weights w of the output;
pub(super) const TOP: u32 = 2;
/// first ← φ′(z) sums, second ← φ″(z) sums;
pub(super) const CHAIN: u32 = 3;
/// first ← φ′(z) sums, second ← second · sums;
pub(super) const UP: u32 = 4;
/// first ← first + φ′(z) sums;
pub(super) const DOWN: u32 = 5;
/// first ← φ′(z) sums.
pub(super) const BACK: u32 = 6;

/// Numbers of a sum over particles in the table: a gradient `Σ left₁ ⊗ right₁ + left₂ ⊗ right₂`.
pub(super) const OUTER: usize = 13;
/// The numbers of such a sum, by their place in it: rows
pub(super) const OUTPUTS: usize = 0;
/// and columns;
pub(super) const INPUTS: usize = 1;
/// of the first term the arrays on the tape, the right one [`ONES`] for a column of ones, and how far one
/// particle's right factors are from the next one's;
pub(super) const LEFT: usize = 2;
pub(super) const RIGHT: usize = 3;
pub(super) const RIGHT_STRIDE: usize = 4;
/// the same of the second term, whose left array is [`NONE`] where there is none, so many numbers further;
pub(super) const TERM: usize = 3;
/// how far one particle's left factors are from the next one's;
pub(super) const LEFT_STRIDE: usize = 8;
/// where the sums go, how far apart by row and by column;
pub(super) const TO: usize = 9;
pub(super) const TO_ROW: usize = 10;
pub(super) const TO_COLUMN: usize = 11;
/// and the tiles of the sums before.
pub(super) const BEGIN: usize = 12;
/// In place of an array, ones.
pub(super) const ONES: u32 = NONE;

/// Places of arrays on the tape, by their place in the table: normalised positions and velocities,
pub(super) const STATES: usize = 0;
/// the gradient of the network of the potential, its cotangent, and that of the position through it;
pub(super) const GRADIENT: usize = 1;
pub(super) const V_GRADIENT: usize = 2;
pub(super) const V_POTENTIAL: usize = 3;
/// outputs of the force's network, their cotangents, and those of its inputs;
pub(super) const FORCE: usize = 4;
pub(super) const V_FORCE: usize = 5;
pub(super) const V_INPUTS: usize = 6;
/// normalised positions and velocities once more, for the force's network;
pub(super) const FORCE_STATES: usize = 7;
/// where the linear and quadratic coefficients are among the weights.
pub(super) const QUADRATIC: usize = 8;
/// Numbers of the table before the products.
pub(super) const PLACES: usize = 9;

/// Numbers of a particle's normalised position and velocity.
pub(super) const STATE_INPUTS: usize = 6;
/// Room for the outputs of the force's network.
pub(super) const FORCE_OUTPUTS: usize = 4;
/// Sums `[3, 3]` from which the quadratic coefficients' gradient is made.
pub(super) const SECOND_MOMENTS: usize = 9;
