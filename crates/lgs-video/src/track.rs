//! An encoded track, as containers take it.

#[cfg(feature = "av1")]
use crate::spec::VideoSpec;

/// The bytes of one shown frame.
pub(crate) struct Sample {
    pub(crate) data: Vec<u8>,
    /// Whether it is coded by itself.
    pub(crate) is_key: bool,
}

#[cfg(feature = "av1")]
/// A track of AV1 frames in the order in which they are shown.
pub(crate) struct Track {
    pub(crate) spec: VideoSpec,
    pub(crate) samples: Vec<Sample>,
    /// The four bytes of an AV1CodecConfigurationRecord (AV1 in ISOBMFF, section 2.3.3).
    pub(crate) configuration: [u8; 4],
}
