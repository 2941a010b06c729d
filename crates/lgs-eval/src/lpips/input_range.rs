//! The range of values that an LPIPS network is given.

/// The values that the network is given for an image in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputRange {
    /// Values in [−1, 1], as the network expects.
    Symmetric,
    /// The values in [0, 1] as they are, as the public evaluation scripts of FreeGave and DefGS do.
    Unnormalised,
}
