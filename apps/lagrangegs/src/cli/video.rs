//! Where `render` puts its frames: a folder of images, or a video.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::ValueEnum;
use lgs_core::Image;
use lgs_data::files::{folder_of, write_atomically};
use lgs_video::{Encoder, Video, VideoFormat, VideoSpec};

use super::failure::{At, BadUsage};
use super::output::prepare_folder;
use super::thresholds::FRAMES_PER_SECOND;

/// Endings of videos that are not written; any other name is a folder's.
const OTHER_VIDEOS: [&str; 7] = ["avi", "mov", "mkv", "m4v", "ogv", "webp", "apng"];

/// Endings of images, which are no names of folders.
const IMAGES: [&str; 5] = ["png", "jpg", "jpeg", "bmp", "tiff"];

/// Flags of a video.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct VideoArgs {
    /// Frames of a video per second [default: 25]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: Option<u32>,
    /// Who encodes a video [default: builtin]
    #[arg(long, value_enum, value_name = "ENCODER")]
    encoder: Option<EncoderName>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EncoderName {
    /// This program: AV1 in .mp4 and .webm, and GIF
    Builtin,
    /// The system's ffmpeg: H.264 in .mp4, VP9 in .webm, and GIF with one palette
    Ffmpeg,
}

/// Where frames go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// One image per frame, a list of them and a contact sheet.
    Folder(PathBuf),
    /// The image of the one frame.
    Picture(PathBuf),
    /// One file.
    Film(Film),
}

/// A video file that is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Film {
    pub(super) path: PathBuf,
    format: VideoFormat,
    encoder: Encoder,
    rate: u32,
}

impl VideoArgs {
    /// Frames per second.
    pub(super) fn rate(&self) -> u32 {
        self.fps.unwrap_or(FRAMES_PER_SECOND)
    }

    /// Whether something is said of a video.
    pub(super) fn is_set(&self) -> bool {
        self.fps.is_some() || self.encoder.is_some()
    }

    /// Refuses a name that a call for so many frames, if that is known, cannot mean.
    pub(super) fn check_name(&self, out: &Path, frames: Option<usize>) -> Result<()> {
        let ending = out.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        if OTHER_VIDEOS.iter().any(|other| ending.eq_ignore_ascii_case(other)) {
            let text = "videos are .mp4, .webm or .gif, and images go into a folder";
            return Err(BadUsage(format!("{text}: {}", out.display())).into());
        }
        let is_one = is_png(out) && frames.is_none_or(|frames| frames == 1);
        if IMAGES.iter().any(|image| ending.eq_ignore_ascii_case(image)) && !is_one && !out.is_dir() {
            let text = "several images go into a folder, and one alone into a .png";
            return Err(BadUsage(format!("{text}: {}", out.display())).into());
        }
        if self.is_set() && VideoFormat::of(out).is_none() {
            let text = "--fps and --encoder are for .mp4, .webm and .gif";
            return Err(BadUsage(format!("{text}: {}", out.display())).into());
        }
        Ok(())
    }

    /// The target that a path means; it can be written to.
    pub(super) fn target(&self, out: &Path, frames: usize) -> Result<Target> {
        self.check_name(out, Some(frames))?;
        if is_png(out) && !out.is_dir() {
            prepare_folder(folder_of(out))?;
            return Ok(Target::Picture(out.to_owned()));
        }
        let Some(format) = VideoFormat::of(out) else {
            prepare_folder(out)?;
            return Ok(Target::Folder(out.to_owned()));
        };
        if out.is_dir() {
            bail!("there is a folder of that name: {}", out.display());
        }
        prepare_folder(folder_of(out))?;
        let encoder = match self.encoder {
            Some(EncoderName::Ffmpeg) => Encoder::Ffmpeg,
            Some(EncoderName::Builtin) | None => Encoder::BuiltIn,
        };
        Ok(Target::Film(Film { path: out.to_owned(), format, encoder, rate: self.rate() }))
    }
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
}

impl Film {
    /// Begins the video with its size; whatever speaks against it is said now.
    pub(super) fn begin(&self, [width, height]: [u32; 2]) -> Result<Box<dyn Video>> {
        let spec = VideoSpec { format: self.format, width, height, frames_per_second: self.rate };
        lgs_video::begin(spec, self.encoder).at(&self.path)
    }

    /// Adds a frame.
    pub(super) fn push(&self, video: &mut dyn Video, frame: &Image) -> Result<()> {
        video.push(frame).at(&self.path)
    }

    /// Writes the file; returns its size in bytes.
    pub(super) fn finish(&self, video: Box<dyn Video>) -> Result<usize> {
        let bytes = video.finish().at(&self.path)?;
        write_atomically(&self.path, |w| w.write_all(&bytes)).at(&self.path)?;
        Ok(bytes.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_decides_between_folder_and_video() {
        let dir = tempfile::tempdir().expect("a folder");
        let plain = VideoArgs { fps: None, encoder: None };
        let target = |name: &str| plain.target(&dir.path().join(name), 2);
        assert!(matches!(target("frames.v2"), Ok(Target::Folder(_))));
        assert!(matches!(target("new/a.mp4"), Ok(Target::Film(film)) if film.rate == FRAMES_PER_SECOND));
        assert!(target("a.mov").is_err() && target("a.png").is_err());
        let one = |name: &str| plain.target(&dir.path().join(name), 1);
        assert!(matches!(one("a.png"), Ok(Target::Picture(_))) && one("a.jpg").is_err());
        std::fs::create_dir(dir.path().join("b.gif")).expect("a folder");
        assert!(target("b.gif").is_err());
        let fast = VideoArgs { fps: Some(50), encoder: None };
        assert!(fast.target(&dir.path().join("frames"), 2).is_err());
    }
}
