//! Why there is no video.

/// Why there is no video.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VideoError {
    /// Sides that the format cannot have.
    #[error("a video of {width} × {height} pixels; each side is {smallest} to {largest}")]
    Size {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// Least pixels of a side.
        smallest: u32,
        /// Most pixels of a side.
        largest: u32,
    },
    /// A rate that the format cannot have.
    #[error("{rate} frames per second; a .{extension} has 1 to {most}")]
    Rate {
        /// Frames per second.
        rate: u32,
        /// Ending of the file's name.
        extension: &'static str,
        /// Most frames per second.
        most: u32,
    },
    /// Frames of different sizes.
    #[error("a frame of {} × {} pixels in a video of {} × {}", found[0], found[1], expected[0], expected[1])]
    FrameSize {
        /// Width and height of the video, pixels.
        expected: [u32; 2],
        /// Width and height of the frame, pixels.
        found: [u32; 2],
    },
    /// No frame was given.
    #[error("a video needs at least one frame")]
    Empty,
    /// The program was built without the AV1 encoder.
    #[error(
        "this build has no encoder for .{extension}; use .gif, `--encoder ffmpeg`, or a build with the \
         feature `av1`"
    )]
    NoAv1 {
        /// Ending of the file's name.
        extension: &'static str,
    },
    /// The AV1 encoder refuses or fails.
    #[error("the AV1 encoder failed: {0}")]
    Av1(String),
    /// The GIF encoder fails.
    #[error("the GIF encoder failed: {0}")]
    Gif(#[from] gif::EncodingError),
    /// A box of the file cannot be written.
    #[error("the file's index cannot be written: {0}")]
    Mp4(#[from] mp4_atom::Error),
    /// The program `ffmpeg` cannot be started.
    #[error("there is no `ffmpeg` to start ({0}); install it, or leave out `--encoder ffmpeg`")]
    NoFfmpeg(std::io::Error),
    /// The program `ffmpeg` ended early.
    #[error("ffmpeg failed: {0}")]
    Ffmpeg(String),
    /// A temporary file or a pipe failed.
    #[error("the encoder's temporary file failed: {0}")]
    Temporary(#[from] std::io::Error),
}
