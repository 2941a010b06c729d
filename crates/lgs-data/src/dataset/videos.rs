//! Frames of video files. The system's `ffmpeg` decodes a video once, every frame as it is, into a folder of
//! the user's cache: `LAGRANGEGS_CACHE`, or `lagrangegs` in the system's folder of caches. A video is known
//! by its path, its length and the time of its last change. `LAGRANGEGS_FFMPEG` names another program.

use super::error::{DatasetError, Problem};
use crate::files::{self, FileError};
use crate::hash::ContentHash;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Extensions by which videos are known.
pub(super) const EXTENSIONS: [&str; 6] = ["mp4", "mov", "mkv", "avi", "webm", "m4v"];

/// Ways to ask for every frame as it is: of newer and of older programs.
const EVERY_FRAME: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// The folder of a video's frames, `000000.png` and so on.
pub(super) fn frames_of(video: &Path) -> Result<PathBuf, DatasetError> {
    let program = std::env::var_os("LAGRANGEGS_FFMPEG").map_or_else(|| "ffmpeg".into(), PathBuf::from);
    let cache = std::env::var_os("LAGRANGEGS_CACHE").map(PathBuf::from);
    let cache = cache.or_else(|| Some(dirs::cache_dir()?.join("lagrangegs")));
    decoded(video, &cache.unwrap_or_else(std::env::temp_dir).join("videos"), &program)
}

/// Decodes a video into a folder of the cache, unless that has been done.
fn decoded(video: &Path, cache: &Path, program: &Path) -> Result<PathBuf, DatasetError> {
    let unreadable = |reason| FileError::new("read video", video, reason);
    let path = video.canonicalize().map_err(unreadable)?;
    let file = path.metadata().map_err(unreadable)?;
    let mut key = ContentHash::default();
    key.add(format!("{} {} {:?}", path.display(), file.len(), file.modified().ok()).as_bytes());
    let folder = cache.join(key.short());
    if files::is_free(&folder) {
        files::write_folder(&folder, |folder| decode(&path, folder, program))?;
    }
    Ok(folder)
}

fn decode(video: &Path, folder: &Path, program: &Path) -> Result<(), DatasetError> {
    let wrong = |reason: String| Err(DatasetError::new(video, Problem::Malformed(reason)));
    let mut said = String::new();
    for every_frame in EVERY_FRAME {
        match run(video, folder, program, every_frame) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let what = program.display();
                return wrong(format!(
                    "a video needs the program `{what}`, which is not there: install ffmpeg, or write the \
                        video's frames as images into a folder of its name"
                ));
            }
            Err(error) => return wrong(format!("`{}` does not start: {error}", program.display())),
            Ok(done) if done.status.success() => {
                let mut entries = std::fs::read_dir(folder).into_iter().flatten();
                return if entries.next().is_some() {
                    Ok(())
                } else {
                    wrong("the video has no frame".into())
                };
            }
            Ok(done) => said = String::from_utf8_lossy(&done.stderr).trim().to_owned(),
        }
    }
    let last = said.lines().last().unwrap_or("no reason given");
    wrong(format!("`{}` can't decode the video: {last}", program.display()))
}

fn run(video: &Path, folder: &Path, program: &Path, every_frame: [&str; 2]) -> std::io::Result<Output> {
    Command::new(program)
        .args(["-nostdin", "-loglevel", "error", "-i"])
        .arg(video)
        .args(every_frame)
        .args(["-start_number", "0"])
        .arg(folder.join("%06d.png"))
        .stdin(Stdio::null())
        .output()
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    /// A program that does as a script says.
    fn program(folder: &Path, script: &str) -> PathBuf {
        let path = folder.join("fake-ffmpeg");
        std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    #[test]
    fn a_video_is_decoded_once() {
        let dir = tempfile::tempdir().unwrap();
        let video = dir.path().join("cam00.mp4");
        std::fs::write(&video, "pictures").unwrap();
        // An older program, which knows only one of the two ways; the last argument is the pattern.
        let script = r#"case "$*" in *-fps_mode*) echo "Unrecognized option 'fps_mode'" >&2; exit 1;; esac
            for last; do :; done; folder=$(dirname "$last")
            cp "$5" "$folder/000000.png"; cp "$5" "$folder/000001.png""#;
        let fake = program(dir.path(), script);
        let folder = decoded(&video, &dir.path().join("cache"), &fake).unwrap();
        assert_eq!(std::fs::read(folder.join("000001.png")).unwrap(), b"pictures");
        let again = decoded(&video, &dir.path().join("cache"), Path::new("no-such-program")).unwrap();
        assert_eq!(again, folder);
    }

    #[test]
    fn without_a_program_or_frames_the_reason_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let (video, cache) = (dir.path().join("cam00.mp4"), dir.path().join("cache"));
        std::fs::write(&video, "x").unwrap();
        let message = |program: &Path| {
            let message = decoded(&video, &cache, program).unwrap_err().to_string();
            assert!(message.ends_with("cam00.mp4"), "{message}");
            message
        };
        assert!(message(Path::new("no-such-program")).contains("install ffmpeg"));
        assert!(
            message(&program(dir.path(), "echo 'moov atom not found' >&2; exit 1")).contains("moov atom")
        );
        assert!(message(&program(dir.path(), "exit 0")).contains("no frame"));
        assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 0, "nothing half-written");
    }
}
