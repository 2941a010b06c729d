//! Silhouettes of moving things in the images of cameras that stand still: pixels that differ from the
//! camera's median image, and the blobs that they form.

use std::collections::BTreeMap;

use super::thresholds::{FEWEST_IMAGES, FEWEST_PIXELS, SILHOUETTE_DIFFERENCE};
use lgs_core::{Camera, Image};
use lgs_data::dataset::Frame;
use rayon::prelude::*;

/// How silhouettes are taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taking {
    /// Width that images are reduced to about, pixels.
    pub(super) width: u32,
    /// Gaps of up to twice this many pixels are closed.
    pub(super) closing: usize,
}

impl Taking {
    /// Factor by which an image of a width is reduced.
    pub(super) fn factor(self, width: u32) -> u32 {
        (width / self.width).max(1)
    }
}

/// The moving pixels of an image.
pub(super) struct Silhouette {
    /// The camera of the reduced image.
    pub(super) camera: Camera,
    pub(super) time: f32,
    /// Whether a pixel shows something that moves, `[h, w]`.
    pub(super) inside: Vec<bool>,
    /// The blobs that lie wholly in the image.
    pub(super) blobs: Vec<Blob>,
}

/// A connected silhouette as a cone of view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blob {
    /// Unit direction of its centroid, world axes.
    pub(super) direction: [f32; 3],
    /// Radius of the disc of the same area, as a part of the distance.
    pub(super) angular_radius: f32,
}

/// The silhouettes of all frames of cameras with enough images.
pub(super) fn silhouettes(frames: &[Frame], background: [f32; 3], taking: Taking) -> Vec<Silhouette> {
    let mut by_camera: BTreeMap<usize, Vec<&Frame>> = BTreeMap::new();
    frames.iter().for_each(|frame| by_camera.entry(frame.camera_id).or_default().push(frame));
    let cameras: Vec<Vec<&Frame>> =
        by_camera.into_values().filter(|frames| frames.len() >= FEWEST_IMAGES).collect();
    cameras.par_iter().flat_map_iter(|frames| of_camera(frames, background, taking)).collect()
}

fn of_camera(frames: &[&Frame], background: [f32; 3], taking: Taking) -> Vec<Silhouette> {
    let factor = taking.factor(frames[0].camera.width);
    let images: Vec<Image> =
        frames.iter().map(|frame| frame.composited(background).reduced(factor)).collect();
    let still = median(&images);
    frames.iter().zip(&images).map(|(frame, image)| silhouette(frame, image, (&still, taking))).collect()
}

fn silhouette(frame: &Frame, image: &Image, (still, taking): (&[[f32; 3]], Taking)) -> Silhouette {
    let differs =
        |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > SILHOUETTE_DIFFERENCE);
    let (width, height) = (image.width as usize, image.height as usize);
    let mask = image.pixels.iter().zip(still).map(differs).collect();
    let inside = closed(mask, taking.closing, [width, height]);
    let camera = frame.camera.reduced(taking.factor(frame.camera.width));
    let blobs = blobs(&inside, &camera);
    Silhouette { camera, time: frame.time, inside, blobs }
}

/// The median image, channel by channel.
fn median(images: &[Image]) -> Vec<[f32; 3]> {
    let mut values = vec![0.0_f32; images.len()];
    let mut channel = |pixel: usize, c: usize| {
        values.iter_mut().zip(images).for_each(|(v, image)| *v = image.pixels[pixel][c]);
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f32::total_cmp).1
    };
    (0..images[0].pixels.len()).map(|pixel| std::array::from_fn(|c| channel(pixel, c))).collect()
}

/// Closes small gaps: the mask is grown by `radius` pixels and shrunk by as many. Beyond the image everything
/// is taken to be as its border.
fn closed(mask: Vec<bool>, radius: usize, [width, height]: [usize; 2]) -> Vec<bool> {
    let spread = |mask: Vec<bool>, value: bool| -> Vec<bool> {
        let at = |i: usize| {
            let (x, y) = (i % width, i / width);
            mask[i] == value
                || (x > 0 && mask[i - 1] == value)
                || (x + 1 < width && mask[i + 1] == value)
                || (y > 0 && mask[i - width] == value)
                || (y + 1 < height && mask[i + width] == value)
        };
        (0..mask.len()).map(|i| if at(i) { value } else { !value }).collect()
    };
    let grown = (0..radius).fold(mask, |mask, _| spread(mask, true));
    (0..radius).fold(grown, |mask, _| spread(mask, false))
}

/// The connected parts that do not touch the border.
fn blobs(inside: &[bool], camera: &Camera) -> Vec<Blob> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut left = inside.to_vec();
    let mut found = Vec::new();
    for seed in 0..left.len() {
        let pixels = taken(&mut left, seed, width);
        let at_border =
            |&i: &usize| i % width == 0 || i % width == width - 1 || i < width || i >= width * (height - 1);
        if pixels.len() < FEWEST_PIXELS || pixels.iter().any(at_border) {
            continue;
        }
        let part = 1.0 / pixels.len() as f32;
        let x = 0.5 + part * pixels.iter().map(|i| (i % width) as f32).sum::<f32>();
        let y = 0.5 + part * pixels.iter().map(|i| (i / width) as f32).sum::<f32>();
        // Pixels that are covered in part count as whole ones.
        let radius = (pixels.len() as f32 / std::f32::consts::PI).sqrt() - 0.5;
        found.push(Blob {
            direction: camera.ray_direction_in_world([x, y]),
            angular_radius: radius / (camera.fx * camera.fy).sqrt(),
        });
    }
    found
}

/// Takes the connected pixels around `seed` out of the mask.
fn taken(left: &mut [bool], seed: usize, width: usize) -> Vec<usize> {
    let (mut pixels, mut open) = (Vec::new(), vec![seed]);
    while let Some(i) = open.pop() {
        if !std::mem::replace(&mut left[i], false) {
            continue;
        }
        pixels.push(i);
        let x = i % width;
        open.extend((x > 0).then(|| i - 1).into_iter().chain((x + 1 < width).then_some(i + 1)));
        open.extend(i.checked_sub(width).into_iter().chain((i + width < left.len()).then_some(i + width)));
    }
    pixels
}
