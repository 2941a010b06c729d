//! Frames as video files: AV1 in MP4 and WebM and GIF by encoders that are part of the program, or whatever a
//! system's ffmpeg makes of them. And video files as frames: H.264 in MP4 and MOV ([`read`]).
//!
//! ```
//! use lgs_core::Image;
//! use lgs_video::{Encoder, VideoFormat, VideoSpec};
//! let spec = VideoSpec { format: VideoFormat::Gif, width: 32, height: 24, frames_per_second: 25 };
//! let mut video = lgs_video::begin(spec, Encoder::BuiltIn)?;
//! for step in 0..3 {
//!     video.push(&Image::filled(32, 24, [0.2 * step as f32; 3]))?;
//! }
//! assert!(video.finish()?.starts_with(b"GIF89a"));
//! # Ok::<(), lgs_video::VideoError>(())
//! ```
//!
//! Nothing is written to disk here (ffmpeg's temporary file apart): a finished video is bytes. The same
//! frames give the same bytes for any number of threads. The feature `av1` brings the AV1 encoder.

#[cfg(feature = "av1")]
mod av1;
#[cfg(feature = "av1")]
mod color;
mod error;
mod ffmpeg;
mod gif_file;
mod mp4;
pub mod read;
mod spec;
pub mod testing;
mod thresholds;
mod track;
#[cfg(feature = "av1")]
mod webm;

use lgs_core::Image;

pub use error::VideoError;
pub use spec::{VideoFormat, VideoSpec};

/// Who encodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoder {
    /// The encoders of this crate: AV1 in MP4 and WebM, and GIF.
    #[default]
    BuiltIn,
    /// The program `ffmpeg` of the system: H.264 in MP4, VP9 in WebM, and GIF with one palette.
    Ffmpeg,
}

/// A video under way.
pub trait Video {
    /// Adds a frame of the video's size.
    ///
    /// # Errors
    /// If the frame has another size, or the encoder fails.
    fn push(&mut self, frame: &Image) -> Result<(), VideoError>;

    /// The file.
    ///
    /// # Errors
    /// If the encoder fails.
    fn finish(self: Box<Self>) -> Result<Vec<u8>, VideoError>;
}

/// Begins a video.
///
/// # Errors
/// If the format cannot have this size or rate, or the encoder is not there.
pub fn begin(spec: VideoSpec, encoder: Encoder) -> Result<Box<dyn Video>, VideoError> {
    spec.check()?;
    Ok(match (encoder, spec.format) {
        (Encoder::Ffmpeg, _) => Box::new(ffmpeg::Ffmpeg::start(spec)?),
        (Encoder::BuiltIn, VideoFormat::Gif) => Box::new(gif_file::GifFile::start(spec)?),
        #[cfg(feature = "av1")]
        (Encoder::BuiltIn, _) => Box::new(av1::Av1::start(spec)?),
        #[cfg(not(feature = "av1"))]
        (Encoder::BuiltIn, _) => return Err(VideoError::NoAv1 { extension: spec.format.extension() }),
    })
}
