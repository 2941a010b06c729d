//! First points inside of what the images of all times agree on.
//!
//! Where the camera is elsewhere at every image, the earliest one alone carves a cone. A point is then kept
//! if nearly all images whose view it lies in show something there: what stands still is in all of them, and
//! what moves is found later.

use super::set::{Dataset, Frame};
use super::store::Picture;
use crate::ply::Points;
use crate::thresholds::{BACKGROUND_TOLERANCE, CARVING_TRIES, HULL_SHARE, HULL_VIEWS};
use lgs_core::stream;
use rand::RngExt;
use std::sync::Arc;

impl Dataset {
    /// At most `count` points in [`Self::scene_box`] that nearly all training images show as something else
    /// than background, coloured by their mean; the same for the same seed.
    ///
    /// Fewer come back only if silhouettes share next to no volume of the box.
    #[must_use]
    pub fn hull_points(&self, count: usize, seed: u64) -> Points {
        let (cube, frames) = (self.scene_box(), self.split("train"));
        let n = frames.len().min(HULL_VIEWS);
        let spread = (0..n).map(|i| &frames[i * frames.len() / n]);
        let views: Vec<(&Frame, Arc<Picture>)> = spread.map(|frame| (frame, frame.picture())).collect();
        let mut rng = stream(seed, "points of the hull", 0);
        let mut points = Points::default();
        for _ in 0..count * CARVING_TRIES {
            if points.positions.len() == count {
                break;
            }
            let point = cube.center.map(|c| c + rng.random_range(-1.0f32..1.0) * cube.half_side);
            if let Some(color) = agreed_color(&views, point, self.background) {
                points.positions.push(point);
                points.colors.push(color);
            }
        }
        points
    }
}

/// The mean colour of a point in the views that show something there; nothing if too many of those that it
/// lies in show background.
fn agreed_color(views: &[(&Frame, Arc<Picture>)], point: [f32; 3], background: [f32; 3]) -> Option<[f32; 3]> {
    let most_missed = (1.0 - HULL_SHARE) * views.len() as f32;
    let (mut sum, mut seen, mut missed) = ([0.0; 3], 0_usize, 0_usize);
    for (frame, picture) in views {
        match shown_at(frame, picture, point, background) {
            None => {}
            Some(Shown::Background) => {
                missed += 1;
                if missed as f32 > most_missed {
                    return None;
                }
            }
            Some(Shown::Something(color)) => {
                seen += 1;
                (0..3).for_each(|c| sum[c] += color[c]);
            }
        }
    }
    let is_agreed = seen > 0 && seen as f32 >= HULL_SHARE * (seen + missed) as f32;
    is_agreed.then(|| sum.map(|v| v / seen as f32))
}

/// What an image shows where a point would be.
pub(super) enum Shown {
    Background,
    /// Something else, of this colour.
    Something([f32; 3]),
}

/// What a frame shows at a point; nothing outside of the view, and where a mask leaves the pixel out.
pub(super) fn shown_at(
    frame: &Frame,
    picture: &Picture,
    point: [f32; 3],
    background: [f32; 3],
) -> Option<Shown> {
    let camera = &frame.camera;
    let ([x, y], depth) = camera.pixel_from_world(point);
    if depth <= 0.0 || x < 0.0 || y < 0.0 || x >= camera.width as f32 || y >= camera.height as f32 {
        return None;
    }
    let at = y as usize * camera.width as usize + x as usize;
    if picture.mask.as_ref().is_some_and(|mask| mask[at] == 0) {
        return None;
    }
    let pixel = &picture.rgba[4 * at..4 * at + 4];
    let alpha = f32::from(pixel[3]) / 255.0;
    let color: [f32; 3] =
        std::array::from_fn(|c| f32::from(pixel[c]) / 255.0 * alpha + background[c] * (1.0 - alpha));
    let differs = color.iter().zip(background).any(|(c, b)| (c - b).abs() > BACKGROUND_TOLERANCE);
    let is_something = alpha >= 0.5 && (frame.has_alpha() || differs);
    Some(if is_something { Shown::Something(color) } else { Shown::Background })
}
