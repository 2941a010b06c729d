//! Things that stand apart from everything else that moves at a moment: blobs of several cameras that agree
//! on a place and a size.

use glam::{DMat3, DVec3};
use lgs_core::geometry::{inverse, narrow, outer, wide};
use lgs_core::linear::{dot, norm, scale, sub};

use super::curve::median_of;
use super::silhouettes::{Blob, Silhouette};
use super::thresholds::{
    AGREEING_RADII, COVERING_VIEWS, FEWEST_VIEWS, LEAST_SINE, MOST_BLOBS_OF_VIEW, MOST_VIEWS_OF_MOMENT,
    SIZE_RATIO,
};

/// A thing that stands apart at a moment, as a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Isolated {
    /// World units.
    pub(super) position: [f32; 3],
    /// World units.
    pub(super) radius: f32,
    /// Number of cameras whose blobs agree on it.
    pub(super) views: usize,
    /// Median distance of the position from their rays, world units.
    pub(super) miss: f32,
}

/// A blob as a camera sees it.
#[derive(Clone, Copy)]
struct Seen {
    view: usize,
    eye: [f32; 3],
    blob: Blob,
}

impl Seen {
    /// Distance of a point from the blob's ray and radius of a ball there that fills the blob, world units;
    /// nothing behind the camera.
    fn of(&self, point: [f32; 3]) -> Option<(f32, f32)> {
        let from_eye = sub(point, self.eye);
        let depth = dot(from_eye, self.blob.direction);
        let miss = norm(sub(from_eye, scale(self.blob.direction, depth)));
        (depth > 0.0).then_some((miss, self.blob.angular_radius * depth))
    }

    /// Whether it may be the blob of a ball.
    fn agrees(&self, position: [f32; 3], radius: f32) -> bool {
        self.of(position).is_some_and(|(miss, own)| miss < AGREEING_RADII * radius && are_alike(own, radius))
    }
}

/// Whether two radii are those of one thing.
pub(super) fn are_alike(a: f32, b: f32) -> bool {
    a.max(b) < SIZE_RATIO * a.min(b)
}

/// The things that the silhouettes of a moment show apart from others; those that most cameras agree on
/// first.
pub(super) fn isolated(silhouettes: &[&Silhouette]) -> Vec<Isolated> {
    let mut blobs = seen(silhouettes);
    let mut found = Vec::new();
    let candidates = candidates(&blobs);
    loop {
        let supporters = |&(position, radius): &([f32; 3], f32)| {
            let mut own: Vec<Option<usize>> = vec![None; silhouettes.len()];
            for (index, blob) in blobs.iter().enumerate() {
                if own[blob.view].is_none() && blob.agrees(position, radius) {
                    own[blob.view] = Some(index);
                }
            }
            own.into_iter().flatten().collect::<Vec<usize>>()
        };
        // The first of those that most cameras agree on.
        let best = candidates.iter().map(supporters).reduce(|a, b| if b.len() > a.len() { b } else { a });
        let Some(best) = best.filter(|best| best.len() >= FEWEST_VIEWS) else { break };
        let members: Vec<Seen> = best.iter().map(|&index| blobs[index]).collect();
        found.extend(fitted(&members).filter(|thing| is_covered(thing.position, silhouettes)));
        let mut index = 0..;
        blobs.retain(|_| index.next().is_some_and(|i| best.binary_search(&i).is_err()));
    }
    found
}

/// The blobs of a moment: the largest of every view, of at most so many views.
fn seen(silhouettes: &[&Silhouette]) -> Vec<Seen> {
    let step = silhouettes.len().div_ceil(MOST_VIEWS_OF_MOMENT).max(1);
    let of_view = |(view, silhouette): (usize, &&Silhouette)| {
        let mut blobs = silhouette.blobs.clone();
        blobs.sort_by(|a, b| b.angular_radius.total_cmp(&a.angular_radius));
        let eye = silhouette.camera.center_in_world();
        blobs.into_iter().take(MOST_BLOBS_OF_VIEW).map(move |blob| Seen { view, eye, blob })
    };
    silhouettes.iter().enumerate().step_by(step).flat_map(of_view).collect()
}

/// Places, with radii, where the rays of two blobs of different views meet that are alike in size there.
fn candidates(blobs: &[Seen]) -> Vec<([f32; 3], f32)> {
    let pairs = (0..blobs.len()).flat_map(|i| (i + 1..blobs.len()).map(move |j| (i, j)));
    pairs.filter_map(|(i, j)| meeting(&blobs[i], &blobs[j])).collect()
}

fn meeting(a: &Seen, b: &Seen) -> Option<([f32; 3], f32)> {
    if a.view == b.view {
        return None;
    }
    let between = sub(b.eye, a.eye);
    let (u, v) = (a.blob.direction, b.blob.direction);
    let cosine = dot(u, v);
    let squared_sine = 1.0 - cosine * cosine;
    if squared_sine < LEAST_SINE * LEAST_SINE {
        return None;
    }
    let along = (dot(between, u) - cosine * dot(between, v)) / squared_sine;
    let back = (cosine * dot(between, u) - dot(between, v)) / squared_sine;
    let point = |eye: [f32; 3], ray: [f32; 3], depth: f32| std::array::from_fn(|i| eye[i] + depth * ray[i]);
    let (p, q): ([f32; 3], [f32; 3]) = (point(a.eye, u, along), point(b.eye, v, back));
    let radii = [a.blob.angular_radius * along, b.blob.angular_radius * back];
    let radius = (radii[0] * radii[1]).max(0.0).sqrt();
    let meet = along > 0.0
        && back > 0.0
        && are_alike(radii[0], radii[1])
        && norm(sub(p, q)) < AGREEING_RADII * radius;
    meet.then(|| (std::array::from_fn(|i| 0.5 * (p[i] + q[i])), radius))
}

/// The ball nearest to the rays of blobs.
fn fitted(members: &[Seen]) -> Option<Isolated> {
    let (mut gram, mut rhs) = (DMat3::ZERO, DVec3::ZERO);
    for seen in members {
        let ray = wide(seen.blob.direction);
        let across = DMat3::IDENTITY - outer(ray, ray);
        gram += across;
        rhs += across * wide(seen.eye);
    }
    let position = narrow(inverse(&gram)? * rhs);
    let seen: Vec<(f32, f32)> = members.iter().filter_map(|seen| seen.of(position)).collect();
    let radius = median_of(seen.iter().map(|s| s.1))?;
    let miss = median_of(seen.iter().map(|s| s.0))?;
    (miss < AGREEING_RADII * radius).then_some(Isolated { position, radius, views: members.len(), miss })
}

/// Whether nearly all views that a place lies in show something there that moves: rays of blobs also meet
/// where nothing is.
fn is_covered(position: [f32; 3], silhouettes: &[&Silhouette]) -> bool {
    let (mut views, mut covered) = (0, 0);
    for Silhouette { camera, inside, .. } in silhouettes {
        let ([x, y], depth) = camera.pixel_from_world(position);
        if depth <= 0.0 || x < 0.0 || y < 0.0 || x >= camera.width as f32 || y >= camera.height as f32 {
            continue;
        }
        views += 1;
        covered += usize::from(inside[y as usize * camera.width as usize + x as usize]);
    }
    covered as f32 >= COVERING_VIEWS * views as f32
}
