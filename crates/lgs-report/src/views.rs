//! The material of figures of images: a camera, frames of it spread over time, and images of the right size.

use std::collections::BTreeMap;

use image::imageops::FilterType;
use image::{ImageBuffer, Rgb};
use lgs_core::{Camera, GaussianCloud, Image};
use lgs_data::dataset::{Dataset, Frame};

/// The frames, in order of time, of the camera that sees the longest span; the first of equals.
#[must_use]
pub fn longest_view(dataset: &Dataset) -> Vec<&Frame> {
    let mut views: BTreeMap<usize, Vec<&Frame>> = BTreeMap::new();
    for frame in dataset.splits.values().flatten() {
        views.entry(frame.camera_id).or_default().push(frame);
    }
    for frames in views.values_mut() {
        frames.sort_by(|a, b| a.time.total_cmp(&b.time));
    }
    let span = |frames: &[&Frame]| frames.last().map_or(0.0, |last| last.time - frames[0].time);
    // `max_by` alone would take the last of equals.
    views.into_values().rev().max_by(|a, b| span(a).total_cmp(&span(b))).unwrap_or_default()
}

/// Frames in order of time to show a scene by: those of [`longest_view`] or, where no camera stays for a
/// second image, those of all cameras of the held-out views, each to be seen through its own.
pub(crate) fn views_over_time(dataset: &Dataset) -> Vec<&Frame> {
    let of_one = longest_view(dataset);
    if of_one.len() > 1 {
        return of_one;
    }
    let held_out = ["val", "test", "train"].map(|split| dataset.split(split));
    let mut frames: Vec<&Frame> =
        held_out.into_iter().find(|frames| !frames.is_empty()).unwrap_or_default().iter().collect();
    frames.sort_by(|a, b| a.time.total_cmp(&b.time));
    frames
}

/// At most `count` of the frames (sorted by time), those nearest to evenly spaced times; of frames of one
/// time, evenly spaced ones.
#[must_use]
pub fn spread_in_time<'a>(frames: &[&'a Frame], count: usize) -> Vec<&'a Frame> {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Vec::new() };
    if first.time == last.time {
        let n = frames.len().min(count);
        return (0..n).map(|i| frames[i * frames.len() / n]).collect();
    }
    let wanted =
        |i: usize| first.time + (last.time - first.time) * i as f32 / count.saturating_sub(1).max(1) as f32;
    let nearest = |time: f32| {
        (0..frames.len())
            .min_by(|&a, &b| (frames[a].time - time).abs().total_cmp(&(frames[b].time - time).abs()))
    };
    let mut indices: Vec<usize> = (0..count).filter_map(|i| nearest(wanted(i))).collect();
    indices.dedup();
    indices.into_iter().map(|i| frames[i]).collect()
}

/// A camera whose images are `width` pixels wide.
pub(crate) fn of_width(camera: &Camera, width: u32) -> Camera {
    let height = (f64::from(width) * f64::from(camera.height) / f64::from(camera.width.max(1)))
        .round()
        .max(1.0) as u32;
    camera.resized(width, height)
}

/// A cloud as a camera sees it.
pub(crate) fn drawn(cloud: &GaussianCloud, camera: &Camera, background: [f32; 3]) -> Image {
    lgs_eval::render(cloud, camera, background).image
}

/// An image at another size.
pub(crate) fn resized(image: &Image, width: u32, height: u32) -> Image {
    if (image.width, image.height) == (width, height) {
        return image.clone();
    }
    let Some(buffer) = ImageBuffer::<Rgb<f32>, Vec<f32>>::from_raw(
        image.width,
        image.height,
        image.pixels.as_flattened().to_vec(),
    ) else {
        return Image::filled(width, height, [1.0; 3]);
    };
    let small = image::imageops::resize(&buffer, width, height, FilterType::Triangle);
    Image { width, height, pixels: small.pixels().map(|p| p.0).collect() }
}
