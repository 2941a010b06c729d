//! Video by the system's `ffmpeg`: frames go into its standard input, a temporary file comes back.

use std::io::{Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};

use lgs_core::Image;
use tempfile::TempDir;

use crate::Video;
use crate::error::VideoError;
use crate::spec::{VideoFormat, VideoSpec};

/// A video under way in another process.
pub(crate) struct Ffmpeg {
    spec: VideoSpec,
    process: Child,
    input: Option<ChildStdin>,
    folder: TempDir,
}

impl Ffmpeg {
    pub(crate) fn start(spec: VideoSpec) -> Result<Self, VideoError> {
        let folder = tempfile::tempdir()?;
        let mut process = Command::new("ffmpeg")
            .args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args(["-s", &format!("{}x{}", spec.width, spec.height)])
            .args(["-r", &spec.frames_per_second.to_string(), "-i", "-"])
            .args(codec(spec.format))
            .arg(folder.path().join("video").with_extension(spec.format.extension()))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(VideoError::NoFfmpeg)?;
        let input = process.stdin.take();
        Ok(Self { spec, process, input, folder })
    }

    /// Waits for the end; an error is what ffmpeg said.
    fn end(&mut self) -> Result<(), VideoError> {
        drop(self.input.take());
        let mut said = String::new();
        if let Some(errors) = &mut self.process.stderr {
            errors.read_to_string(&mut said)?;
        }
        let status = self.process.wait()?;
        let last = said.lines().last().unwrap_or("it gave no reason").to_owned();
        if status.success() { Ok(()) } else { Err(VideoError::Ffmpeg(last)) }
    }
}

/// Codec and options of a format. H.264 has even sides: a last row or column may be added.
fn codec(format: VideoFormat) -> &'static [&'static str] {
    match format {
        VideoFormat::Mp4 => &[
            "-vf",
            "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709",
            "-c:v",
            "libx264",
            "-crf",
            "18",
            "-pix_fmt",
            "yuv420p",
            "-colorspace",
            "bt709",
            "-movflags",
            "+faststart",
        ],
        VideoFormat::WebM => &["-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-pix_fmt", "yuv420p"],
        VideoFormat::Gif => &["-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse", "-loop", "0"],
    }
}

impl Video for Ffmpeg {
    fn push(&mut self, frame: &Image) -> Result<(), VideoError> {
        let rgb = self.spec.rgb8(frame)?;
        match self.input.as_mut().map(|input| input.write_all(&rgb)) {
            Some(Ok(())) => Ok(()),
            _ => Err(self.end().err().unwrap_or(VideoError::Ffmpeg("it ended early".to_owned()))),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<u8>, VideoError> {
        self.end()?;
        let file = self.folder.path().join("video").with_extension(self.spec.format.extension());
        Ok(std::fs::read(file)?)
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // A video that is not finished is not wanted.
        drop(self.input.take());
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
