//! What is asked of a video.

use std::path::Path;

use lgs_core::Image;

use crate::error::VideoError;
use crate::thresholds::{LARGEST_SIDE, MOST_FRAMES_PER_SECOND, MOST_GIF_FRAMES_PER_SECOND, SMALLEST_SIDE};

/// A kind of video file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VideoFormat {
    /// MPEG-4.
    Mp4,
    /// WebM, a Matroska file for browsers.
    WebM,
    /// An animated GIF: 256 colours per frame, played for ever.
    Gif,
}

impl VideoFormat {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Mp4, Self::WebM, Self::Gif];

    /// The ending of its files' names.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Mp4 => "mp4",
            Self::WebM => "webm",
            Self::Gif => "gif",
        }
    }

    /// The format that the ending of a name asks for.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.extension() == ending)
    }
}

/// Format, size and rate of a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VideoSpec {
    /// Kind of file.
    pub format: VideoFormat,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Frames shown in a second.
    pub frames_per_second: u32,
}

impl VideoSpec {
    pub(crate) fn check(&self) -> Result<(), VideoError> {
        let smallest = if self.format == VideoFormat::Gif { 1 } else { SMALLEST_SIDE };
        let sides = smallest..=LARGEST_SIDE;
        if !sides.contains(&self.width) || !sides.contains(&self.height) {
            let [width, height] = [self.width, self.height];
            return Err(VideoError::Size { width, height, smallest, largest: LARGEST_SIDE });
        }
        let most = match self.format {
            VideoFormat::Gif => MOST_GIF_FRAMES_PER_SECOND,
            VideoFormat::Mp4 | VideoFormat::WebM => MOST_FRAMES_PER_SECOND,
        };
        if !(1..=most).contains(&self.frames_per_second) {
            let extension = self.format.extension();
            return Err(VideoError::Rate { rate: self.frames_per_second, extension, most });
        }
        Ok(())
    }

    /// The bytes of a frame, if it has the video's size.
    pub(crate) fn rgb8(&self, frame: &Image) -> Result<Vec<u8>, VideoError> {
        if [frame.width, frame.height] != [self.width, self.height] {
            let expected = [self.width, self.height];
            return Err(VideoError::FrameSize { expected, found: [frame.width, frame.height] });
        }
        Ok(frame.to_rgb8())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_their_ending() {
        let of = |name: &str| VideoFormat::of(Path::new(name));
        assert_eq!(of("a/b.MP4"), Some(VideoFormat::Mp4));
        assert_eq!(of("b.webm"), Some(VideoFormat::WebM));
        assert_eq!((of("b"), of("b.png"), of("mp4")), (None, None, None));
    }
}
