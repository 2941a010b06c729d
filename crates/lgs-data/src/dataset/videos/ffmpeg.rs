//! Decoding by a program of the system: `ffmpeg`, or one that takes its arguments.

use crate::dataset::error::{DatasetError, Problem};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Ways to ask for every frame as it is: of newer and of older programs.
const EVERY_FRAME: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// Writes the frames of a video into a folder. `why` says why a program is needed.
pub(super) fn decode(video: &Path, folder: &Path, program: &Path, why: &str) -> Result<(), DatasetError> {
    let wrong = |reason: String| Err(DatasetError::new(video, Problem::Malformed(reason)));
    let mut said = String::new();
    for every_frame in EVERY_FRAME {
        match run(video, folder, program, every_frame) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let what = program.display();
                return wrong(format!(
                    "{why}, and the program `{what}` is not there: install ffmpeg, or write the video's \
                        frames as images into a folder of its name"
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
