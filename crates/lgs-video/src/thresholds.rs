//! Numbers of encoders and decoder that are choices, in one place.

/// Least pixels of a side of AV1 video: what the encoder takes.
pub(crate) const SMALLEST_SIDE: u32 = 16;
/// Most pixels of a side.
pub(crate) const LARGEST_SIDE: u32 = 8192;
/// Most frames per second: the fastest screens.
pub(crate) const MOST_FRAMES_PER_SECOND: u32 = 240;
/// Most frames per second of a GIF: browsers show a frame for two hundredths of a second at the least.
pub(crate) const MOST_GIF_FRAMES_PER_SECOND: u32 = 50;
/// Units of an MP4's clock per frame.
pub(crate) const TICKS_PER_FRAME: u32 = 1000;
/// Care in choosing the colours of a GIF's frames, 1 (most) to 30.
pub(crate) const GIF_SPEED: i32 = 10;

// Videos as input

/// Most bytes of an index that is read into memory: a frame takes some twenty of them, so that this is more
/// than a hundred hours.
pub(crate) const LARGEST_INDEX: u64 = 1 << 28;
/// Most frames of a video: the same hundred hours at 60 frames per second, in some 400 MB.
pub(crate) const MOST_FRAMES: usize = 24_000_000;
/// Most macroblocks of a frame, those of level 6.2 (H.264, table A-1): 35 million pixels.
pub(crate) const MOST_MACROBLOCKS: u32 = 139_264;
/// Most frames that others refer to (H.264, A.3.1).
pub(crate) const MOST_REFERENCES: u32 = 16;
/// Lines from which on a video that does not say its matrix has that of BT.709: high definition.
pub(crate) const HD_LINES: u32 = 720;

#[cfg(feature = "av1")]
pub(crate) use av1::*;

/// Numbers of AV1 and its files.
#[cfg(feature = "av1")]
mod av1 {
    /// Speed of the AV1 encoder, 0 to 10: slower ones make files of plain scenes a quarter smaller and take
    /// twice as long.
    pub(crate) const AV1_SPEED: u8 = 10;
    /// Quantizer of the AV1 encoder, 0 to 255: artefacts show only when looked for.
    pub(crate) const AV1_QUANTIZER: usize = 60;
    /// Seconds between frames that are coded by themselves: players jump to these.
    pub(crate) const KEY_FRAME_SECONDS: u32 = 2;
    /// Tiles that are encoded at the same time; a part of the file's form, so that threads change no byte.
    pub(crate) const TILES: usize = 4;
}
