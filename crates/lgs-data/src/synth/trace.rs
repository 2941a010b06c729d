//! Images of a stage: four rays a pixel, sixteen where they disagree; alpha is the share of rays that meet
//! something.
//!
//! Rays per pixel form a regular grid of 2×2 or 4×4. A pixel is refined where its four rays meet different
//! parts or colours that differ by more than a threshold. What stands still is traced once per camera and
//! kept with its distances.

use super::body::{Hit, Meeting, Snapshot, Stage, meet_fixed};
use super::shape::Ray;
use super::sun;
use super::view::View;
use crate::thresholds::SMOOTH_PIXEL;
use glam::DVec3;

const COARSE: usize = 2;
const FINE: usize = 4;

/// One camera's view of the fixed parts.
pub(super) struct Backdrop {
    /// The four rays of every pixel.
    coarse: Vec<[Option<Hit>; COARSE * COARSE]>,
    /// Every pixel without moving bodies.
    pixels: Vec<[u8; 4]>,
}

impl Backdrop {
    pub(super) fn new(stage: &Stage, view: &View) -> Self {
        let trace = |ray: &Ray| meet_fixed(stage, ray).map(|meeting| meeting.hit());
        let mut backdrop = Self { coarse: Vec::new(), pixels: Vec::new() };
        for pixel in pixels_of(view) {
            let coarse = grid::<{ COARSE * COARSE }>(view, pixel, COARSE).map(|ray| trace(&ray));
            let refined = || grid::<{ FINE * FINE }>(view, pixel, FINE).map(|ray| trace(&ray));
            backdrop.pixels.push(if is_edge(&coarse) { average(&refined()) } else { average(&coarse) });
            backdrop.coarse.push(coarse);
        }
        backdrop
    }
}

/// The image of a view at a time: RGBA bytes, straight alpha, row by row.
pub(super) fn image(stage: &Stage, view: &View, backdrop: &Backdrop, t: f64) -> Vec<u8> {
    let snapshot = Snapshot::new(stage, t);
    let trace = |ray: &Ray| nearer(snapshot.meet(ray), meet_fixed(stage, ray)).map(|meeting| meeting.hit());
    let mut bytes = Vec::with_capacity(4 * view.size * view.size);
    for (index, pixel) in pixels_of(view).enumerate() {
        if !snapshot.is_near(&view.ray(pixel.0 as f64 + 0.5, pixel.1 as f64 + 0.5), 1.0 / view.focal) {
            bytes.extend(backdrop.pixels[index]);
            continue;
        }
        let rays = grid::<{ COARSE * COARSE }>(view, pixel, COARSE);
        let moving = rays.map(|ray| snapshot.meet(&ray));
        if moving.iter().all(Option::is_none) {
            bytes.extend(backdrop.pixels[index]);
            continue;
        }
        let coarse: [Option<Hit>; COARSE * COARSE] =
            std::array::from_fn(|i| over(moving[i], backdrop.coarse[index][i]));
        let refined = || grid::<{ FINE * FINE }>(view, pixel, FINE).map(|ray| trace(&ray));
        bytes.extend(if is_edge(&coarse) { average(&refined()) } else { average(&coarse) });
    }
    bytes
}

/// The same under the sun, all of whose pixels may change with what moves.
pub(super) fn sunlit_image(stage: &Stage, view: &View, t: f64) -> Vec<u8> {
    let snapshot = Snapshot::new(stage, t);
    let trace = |ray: &Ray| {
        let meeting = nearer(snapshot.meet(ray), meet_fixed(stage, ray))?;
        Some(sun::lit(stage, &snapshot, ray, &meeting))
    };
    let pixel = |pixel| {
        let coarse = grid::<{ COARSE * COARSE }>(view, pixel, COARSE).map(|ray| trace(&ray));
        let refined = || grid::<{ FINE * FINE }>(view, pixel, FINE).map(|ray| trace(&ray));
        if is_edge(&coarse) { average(&refined()) } else { average(&coarse) }
    };
    pixels_of(view).flat_map(pixel).collect()
}

fn pixels_of(view: &View) -> impl Iterator<Item = (usize, usize)> + use<> {
    let size = view.size;
    (0..size).flat_map(move |y| (0..size).map(move |x| (x, y)))
}

fn grid<const N: usize>(view: &View, pixel: (usize, usize), side: usize) -> [Ray; N] {
    std::array::from_fn(|i| {
        let offset = |k: usize| (k as f64 + 0.5) / side as f64;
        view.ray(pixel.0 as f64 + offset(i % side), pixel.1 as f64 + offset(i / side))
    })
}

fn nearer<'a>(a: Option<Meeting<'a>>, b: Option<Meeting<'a>>) -> Option<Meeting<'a>> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if a.distance <= b.distance { a } else { b }),
        (a, b) => a.or(b),
    }
}

/// A moving body, unless what stands still is in front of it.
fn over(moving: Option<Meeting<'_>>, still: Option<Hit>) -> Option<Hit> {
    match (moving, still) {
        (Some(moving), Some(still)) if still.distance < moving.distance => Some(still),
        (Some(moving), _) => Some(moving.hit()),
        (None, still) => still,
    }
}

fn is_edge(hits: &[Option<Hit>]) -> bool {
    let first = hits[0];
    hits.iter().any(|hit| match (first, hit) {
        (None, None) => false,
        (Some(a), Some(b)) => a.part != b.part || (a.color - b.color).abs().max_element() > SMOOTH_PIXEL,
        _ => true,
    })
}

fn average(hits: &[Option<Hit>]) -> [u8; 4] {
    let (mut color, mut count) = (DVec3::ZERO, 0);
    for hit in hits.iter().flatten() {
        color += hit.color;
        count += 1;
    }
    if count == 0 {
        return [0; 4];
    }
    let color = color / f64::from(count);
    let byte = |v: f64| (255.0 * v + 0.5) as u8;
    [byte(color.x), byte(color.y), byte(color.z), byte(f64::from(count) / hits.len() as f64)]
}
