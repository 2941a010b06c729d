//! Paths that carry Gaussians, and whom they carry.

use lgs_core::linear::{add, norm, scale, sub};

/// A path of a thing from the first moment on.
#[derive(Clone, Debug, PartialEq)]
pub struct CarryingPath {
    /// Times, ascending, and places at these, world units; evenly on the way in between, at rest beyond.
    pub places: Vec<(f32, [f32; 3])>,
    /// First and last time of each stretch over which nothing but a field acted on the thing.
    pub flights: Vec<[f32; 2]>,
    /// Radius of the ball around the first place whose Gaussians it carries, world units.
    pub reach: f32,
}

impl CarryingPath {
    pub(super) fn start(&self) -> [f32; 3] {
        self.places.first().map_or([0.0; 3], |place| place.1)
    }

    /// The way from the first place by a time.
    #[must_use]
    pub fn displacement(&self, time: f32) -> [f32; 3] {
        sub(place_at(&self.places, time), self.start())
    }
}

/// The place at a time, evenly on the way from one given place to the next, given their times, which ascend;
/// beyond these the nearest, and the origin where none is given.
#[must_use]
pub fn place_at(places: &[(f32, [f32; 3])], time: f32) -> [f32; 3] {
    let after = places.partition_point(|(t, _)| *t < time);
    let last = places.len().saturating_sub(1);
    let (Some(&(start, from)), Some(&(end, to))) =
        (places.get(after.saturating_sub(1)), places.get(after.min(last)))
    else {
        return [0.0; 3];
    };
    let part = ((time - start) / (end - start).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    add(from, scale(sub(to, from), part))
}

/// The number of the path that carries each of some canonical centres, from 1; 0: none does.
pub(super) fn owners(paths: &[CarryingPath], means: &[[f32; 3]]) -> Vec<u32> {
    let owner = |mean: &[f32; 3]| {
        let away = |path: &CarryingPath| norm(sub(*mean, path.start())) / path.reach;
        let numbered = (1..).zip(paths).filter(|(_, path)| away(path) < 1.0);
        numbered.min_by(|a, b| away(a.1).total_cmp(&away(b.1))).map_or(0, |(number, _)| number)
    };
    means.iter().map(owner).collect()
}
