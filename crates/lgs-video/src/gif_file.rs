//! Animated GIF: 256 colours chosen for each frame, played for ever.

use gif::{Frame, Repeat};
use lgs_core::Image;

use crate::Video;
use crate::error::VideoError;
use crate::spec::VideoSpec;
use crate::thresholds::GIF_SPEED;

/// A GIF under way.
pub(crate) struct GifFile {
    spec: VideoSpec,
    encoder: gif::Encoder<Vec<u8>>,
    frames: u32,
}

impl GifFile {
    pub(crate) fn start(spec: VideoSpec) -> Result<Self, VideoError> {
        let mut encoder = gif::Encoder::new(Vec::new(), spec.width as u16, spec.height as u16, &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(Self { spec, encoder, frames: 0 })
    }

    /// Hundredths of a second for which the next frame is shown; sums stay within half of one of the rate.
    fn delay(&self) -> u16 {
        let begin =
            |frame: u32| (200 * frame + self.spec.frames_per_second) / (2 * self.spec.frames_per_second);
        (begin(self.frames + 1) - begin(self.frames)) as u16
    }
}

impl Video for GifFile {
    fn push(&mut self, frame: &Image) -> Result<(), VideoError> {
        let rgb = self.spec.rgb8(frame)?;
        let [width, height] = [self.spec.width as u16, self.spec.height as u16];
        let mut taken = Frame::from_rgb_speed(width, height, &rgb, GIF_SPEED);
        taken.delay = self.delay();
        self.encoder.write_frame(&taken)?;
        self.frames += 1;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<u8>, VideoError> {
        if self.frames == 0 {
            return Err(VideoError::Empty);
        }
        Ok(self.encoder.into_inner()?)
    }
}
