//! First points inside of what the images of all times agree on.
//!
//! Where the camera is elsewhere at every image, the earliest one alone carves a cone. A point is then kept
//! if nearly all images whose view it lies in show something there: what stands still is in all of them, and
//! what moves is found later.

use super::set::{Dataset, Frame};
use crate::ply::Points;
use crate::thresholds::{BACKGROUND_TOLERANCE, CARVING_TRIES, HULL_SHARE, HULL_VIEWS};
use lgs_core::stream;
use rand::RngExt;

impl Dataset {
    /// At most `count` points in [`Self::scene_box`] that nearly all training images show as something else
    /// than background, coloured by their mean; the same for the same seed.
    ///
    /// Fewer come back only if silhouettes share next to no volume of the box.
    #[must_use]
    pub fn hull_points(&self, count: usize, seed: u64) -> Points {
        let (cube, frames) = (self.scene_box(), self.split("train"));
        let n = frames.len().min(HULL_VIEWS);
        let views: Vec<(&Frame, bool)> =
            (0..n).map(|i| &frames[i * frames.len() / n]).map(|frame| (frame, frame.has_alpha())).collect();
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

/// The mean colour of a point in the views (with whether they have transparent pixels) that show something
/// there; nothing if too many of those that it lies in show background.
fn agreed_color(views: &[(&Frame, bool)], point: [f32; 3], background: [f32; 3]) -> Option<[f32; 3]> {
    let most_missed = (1.0 - HULL_SHARE) * views.len() as f32;
    let (mut sum, mut seen, mut missed) = ([0.0; 3], 0_usize, 0_usize);
    for &(frame, transparency) in views {
        let Some((color, alpha)) = pixel_at(frame, point, background) else { continue };
        let differs = color.iter().zip(background).any(|(c, b)| (c - b).abs() > BACKGROUND_TOLERANCE);
        if alpha < 0.5 || (!transparency && !differs) {
            missed += 1;
            if missed as f32 > most_missed {
                return None;
            }
            continue;
        }
        seen += 1;
        (0..3).for_each(|c| sum[c] += color[c]);
    }
    let is_agreed = seen > 0 && seen as f32 >= HULL_SHARE * (seen + missed) as f32;
    is_agreed.then(|| sum.map(|v| v / seen as f32))
}

/// Colour over the background and opacity of the pixel that a point lies in; nothing outside of the view.
fn pixel_at(frame: &Frame, point: [f32; 3], background: [f32; 3]) -> Option<([f32; 3], f32)> {
    let camera = &frame.camera;
    let ([x, y], depth) = camera.pixel_from_world(point);
    if depth <= 0.0 || x < 0.0 || y < 0.0 || x >= camera.width as f32 || y >= camera.height as f32 {
        return None;
    }
    let at = 4 * (y as usize * camera.width as usize + x as usize);
    let pixel = &frame.rgba[at..at + 4];
    let alpha = f32::from(pixel[3]) / 255.0;
    let color = std::array::from_fn(|c| f32::from(pixel[c]) / 255.0 * alpha + background[c] * (1.0 - alpha));
    Some((color, alpha))
}
