//! Frames of video files. A system's `ffmpeg` decodes a video once, into a folder of the user's cache.

use super::error::{DatasetError, Problem};
use std::path::{Path, PathBuf};

/// Extensions by which videos are known.
pub(super) const EXTENSIONS: [&str; 6] = ["mp4", "mov", "mkv", "avi", "webm", "m4v"];

/// The folder of a video's frames.
pub(super) fn frames_of(video: &Path) -> Result<PathBuf, DatasetError> {
    let reason = "videos are not decoded yet; write their frames into a folder of the video's name";
    Err(DatasetError::new(video, Problem::Malformed(reason.to_owned())))
}
