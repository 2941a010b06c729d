//! Frames of video files. A video is decoded once, every frame as it is, into a folder of the user's cache:
//! `LAGRANGEGS_CACHE`, or `lagrangegs` in the system's folder of caches. It is known by its path, its length
//! and the time of its last change.
//!
//! H.264 in MP4 and MOV is decoded by `lgs-video`, all else by the system's `ffmpeg`. A program that
//! `LAGRANGEGS_FFMPEG` names decodes every video.

mod built_in;
mod ffmpeg;
#[cfg(test)]
#[cfg(unix)]
mod tests;

use super::error::{DatasetError, Problem};
use crate::files::{self, FileError};
use crate::hash::ContentHash;
use std::path::{Path, PathBuf};

/// Extensions by which videos are known.
pub(super) const EXTENSIONS: [&str; 6] = ["mp4", "mov", "mkv", "avi", "webm", "m4v"];

/// Why a program is needed that the user names.
const NAMED: &str = "`LAGRANGEGS_FFMPEG` says who decodes videos";

/// Who decodes.
enum Decoder {
    /// The built-in decoder, and a program for what that cannot read.
    BuiltInOr(PathBuf),
    /// A program that the user names.
    Named(PathBuf),
}

/// The folder of a video's frames, `000000.png` and so on.
pub(super) fn frames_of(video: &Path) -> Result<PathBuf, DatasetError> {
    let named = std::env::var_os("LAGRANGEGS_FFMPEG").map(|program| Decoder::Named(program.into()));
    let cache = std::env::var_os("LAGRANGEGS_CACHE").map(PathBuf::from);
    let cache = cache.or_else(|| Some(dirs::cache_dir()?.join("lagrangegs")));
    let decoder = named.unwrap_or_else(|| Decoder::BuiltInOr("ffmpeg".into()));
    decoded(video, &cache.unwrap_or_else(std::env::temp_dir).join("videos"), &decoder)
}

/// Decodes a video into a folder of the cache, unless that has been done.
fn decoded(video: &Path, cache: &Path, decoder: &Decoder) -> Result<PathBuf, DatasetError> {
    let unreadable = |reason| FileError::new("read video", video, reason);
    let path = video.canonicalize().map_err(unreadable)?;
    let file = path.metadata().map_err(unreadable)?;
    let mut key = ContentHash::default();
    key.add(format!("{} {} {:?}", path.display(), file.len(), file.modified().ok()).as_bytes());
    if let Decoder::Named(program) = decoder {
        key.add(program.as_os_str().as_encoded_bytes());
    }
    let folder = cache.join(key.short());
    if files::is_free(&folder) {
        files::write_folder(&folder, |folder| decode(&path, folder, decoder))?;
    }
    Ok(folder)
}

fn decode(video: &Path, folder: &Path, decoder: &Decoder) -> Result<(), DatasetError> {
    let program = match decoder {
        Decoder::Named(program) => return ffmpeg::decode(video, folder, program, NAMED),
        Decoder::BuiltInOr(program) => program,
    };
    match built_in::decode(video, folder) {
        Err(DatasetError::Content { problem: Problem::Video(reason), .. }) if reason.is_of_another_kind() => {
            clear(folder)?;
            let why = format!("{reason}; the built-in decoder reads H.264 in MP4 and MOV");
            ffmpeg::decode(video, folder, program, &why)
        }
        outcome => outcome,
    }
}

/// Removes frames that another decoder is to write.
fn clear(folder: &Path) -> Result<(), FileError> {
    let failed = |reason| FileError::new("empty folder", folder, reason);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        entry.and_then(|entry| std::fs::remove_file(entry.path())).map_err(failed)?;
    }
    Ok(())
}
