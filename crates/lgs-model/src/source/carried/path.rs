//! Paths that carry Gaussians, and whom they carry.

use lgs_core::linear::{add, mat_vec, matrix_from_quat, norm, quat_mul, scale, sub};

use crate::source::config::DELTAS;
use crate::source::pose::quat_exp;

/// A path of a thing from the first moment on.
#[derive(Clone, Debug, PartialEq)]
pub struct CarryingPath {
    /// Times, ascending, and places at these, world units; evenly on the way in between, at rest beyond.
    pub places: Vec<(f32, [f32; 3])>,
    /// First and last time of each stretch over which nothing but a field acted on the thing.
    pub flights: Vec<[f32; 2]>,
    /// Radius of the ball around the first place whose Gaussians it carries, world units.
    pub reach: f32,
    /// Angular velocity at which it turns what it carries about the place, world axes, radians per unit of
    /// time from the first place to the last.
    pub spin: [f32; 3],
}

/// What a path does to Gaussians by a time, given their canonical centres x and their poses x′, q′ without
/// it: `x′ ↦ x′ + c − c₀ + (R − 1) (x − c₀)`, `q′ ↦ R ⊗ q′`. What x′ is off x does not turn: a path that is
/// off by a little is so in the world and not on the thing, where that would go round with it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carried {
    /// Quaternion of R.
    turn: [f32; 4],
    /// c₀ and c, world units.
    from: [f32; 3],
    to: [f32; 3],
}

impl CarryingPath {
    pub(super) fn start(&self) -> [f32; 3] {
        self.places.first().map_or([0.0; 3], |place| place.1)
    }

    /// What it does to Gaussians by a time.
    pub(super) fn carried(&self, time: f32) -> Carried {
        let [first, last] = [self.places.first(), self.places.last()].map(|place| place.map_or(0.0, |p| p.0));
        let turned = scale(self.spin, time.clamp(first, last) - first);
        Carried { turn: quat_exp(turned), from: self.start(), to: place_at(&self.places, time) }
    }
}

impl Carried {
    /// A centre, given the canonical one.
    pub(super) fn center(&self, canonical: [f32; 3], moved: [f32; 3]) -> [f32; 3] {
        let offset = sub(canonical, self.from);
        let turned = sub(mat_vec(&matrix_from_quat(self.turn), offset), offset);
        add(moved, add(sub(self.to, self.from), turned))
    }

    /// An orientation.
    pub(super) fn rotation(&self, q: [f32; 4]) -> [f32; 4] {
        quat_mul(self.turn, q)
    }

    /// The same of pose rows `[x′, q′, Δs]` with the canonical centres behind them, as rows from the right: a
    /// matrix, and what is added.
    pub(super) fn of_rows(&self) -> ([[f32; DELTAS]; DELTAS + 3], [f32; DELTAS]) {
        let (turn, mut matrix, mut added) =
            (matrix_from_quat(self.turn), [[0.0; DELTAS]; DELTAS + 3], [0.0; DELTAS]);
        let one = |i: usize, j: usize| f32::from(u8::from(i == j));
        for i in 0..3 {
            matrix[i][i] = 1.0;
            matrix[7 + i][7 + i] = 1.0;
            (0..3).for_each(|j| matrix[DELTAS + i][j] = turn[j][i] - one(i, j));
        }
        for i in 0..4 {
            matrix[3 + i][3..7].copy_from_slice(&self.rotation(std::array::from_fn(|j| one(i, j))));
        }
        added[..3].copy_from_slice(&self.center([0.0; 3], [0.0; 3]));
        (matrix, added)
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
