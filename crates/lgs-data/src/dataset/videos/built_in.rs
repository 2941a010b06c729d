//! Decoding by `lgs-video`.

use crate::dataset::error::{DatasetError, Problem};
use crate::files::{FileError, write_into_new};
use crate::thresholds::FRAMES_AT_A_TIME;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use lgs_video::read::{Frames, Picture, frames};
use rayon::prelude::*;
use std::fs::File;
use std::io;
use std::path::Path;

/// Writes the frames of a video into a folder.
pub(super) fn decode(video: &Path, folder: &Path) -> Result<(), DatasetError> {
    let wrong = |problem| DatasetError::new(video, problem);
    let file = File::open(video).map_err(|reason| FileError::new("read video", video, reason))?;
    let mut frames = frames(file).map_err(|error| wrong(Problem::Video(error)))?;
    let mut next = || some_of(&mut frames).map_err(|error| wrong(Problem::Video(error)));
    let mut pictures = next()?;
    if pictures.is_empty() {
        return Err(wrong(Problem::Malformed("the video has no frame".into())));
    }
    let mut number = 0;
    while !pictures.is_empty() {
        let (written, further) = rayon::join(|| write_all(&pictures, folder, number), &mut next);
        written?;
        number += pictures.len();
        pictures = further?;
    }
    Ok(())
}

/// The next pictures, none at the end.
fn some_of(frames: &mut Frames<File>) -> Result<Vec<Picture>, lgs_video::read::DecodeError> {
    frames.take(FRAMES_AT_A_TIME).collect()
}

/// Writes pictures of which the first has a number.
fn write_all(pictures: &[Picture], folder: &Path, first: usize) -> Result<(), FileError> {
    pictures.par_iter().enumerate().try_for_each(|(further, picture)| {
        write(picture, &folder.join(format!("{:06}.png", first + further)))
    })
}

fn write(picture: &Picture, path: &Path) -> Result<(), FileError> {
    let (mut bytes, [width, height]) = (Vec::new(), picture.size());
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(&picture.to_rgb8(), width, height, ExtendedColorType::Rgb8)
        .map_err(|error| FileError::new("encode image", path, io::Error::other(error)))?;
    write_into_new(path, &bytes)
}
