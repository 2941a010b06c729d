//! Paths of a few particles of every object through both models and, where it is known, the truth.

use lgs_core::nearest_indices;
use lgs_eval::physics::Truth;
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion};

use crate::thresholds::{
    DRAWN_OBJECTS, DRAWN_PARTICLES, DRAWN_STRIDE, PARTICLES_PER_OBJECT, SOURCE_TIMES, STEP_TOLERANCE,
    TRUTH_TIMES,
};

/// A particle followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Particle {
    /// Object of the scene.
    pub(crate) object: usize,
    /// Row of the moving Gaussians.
    pub(crate) row: usize,
}

/// Positions of particles over times.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tracks {
    pub(crate) times: Vec<f64>,
    /// `[particle][time]`, world units.
    pub(crate) positions: Vec<Vec<[f32; 3]>>,
}

/// The particles, and their paths in each model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Paths {
    pub(crate) particles: Vec<Particle>,
    pub(crate) lagrangian: Tracks,
    pub(crate) source: Option<Tracks>,
    pub(crate) truth: Option<Tracks>,
    /// End of the captured window.
    pub(crate) window: f64,
}

impl Paths {
    /// Follows particles from −τ_max to 3 τ_max; empty for a scene without dynamic Gaussians.
    pub(crate) fn of(
        scene: &LagrangianScene,
        motion: &mut Motion<'_>,
        source: Option<&dyn SourceModel>,
        truth: Option<&Truth<'_>>,
    ) -> Self {
        let particles = chosen(scene);
        let window = f64::from(scene.motion.time_window);
        if particles.is_empty() {
            return Self { window, ..Self::default() };
        }
        let starts: Vec<[f32; 3]> = particles.iter().map(|p| scene.dynamic_gaussians.means[p.row]).collect();
        Self {
            lagrangian: lagrangian(scene, motion, &particles),
            source: source.filter(|s| !s.is_empty()).map(|s| followed_by_source(s, &starts, window)),
            truth: truth.map(|t| carried(t, &starts, window)),
            particles,
            window,
        }
    }

    /// Particles of an object, as indices.
    pub(crate) fn of_object(&self, object: usize) -> impl Iterator<Item = usize> {
        self.particles.iter().enumerate().filter(move |(_, p)| p.object == object).map(|(i, _)| i)
    }

    /// Objects that have particles, in their order.
    pub(crate) fn objects(&self) -> Vec<usize> {
        let mut objects: Vec<usize> = self.particles.iter().map(|p| p.object).collect();
        objects.dedup();
        objects
    }
}

/// The largest objects' particles that lie farthest from each other.
fn chosen(scene: &LagrangianScene) -> Vec<Particle> {
    let mut objects: Vec<usize> =
        (0..scene.objects.len()).filter(|&o| !scene.objects[o].members.is_empty()).collect();
    objects.sort_by_key(|&o| (std::cmp::Reverse(scene.objects[o].members.len()), o));
    objects.truncate(DRAWN_OBJECTS);
    objects.sort_unstable();
    let [fewest, most] = PARTICLES_PER_OBJECT;
    let each = (DRAWN_PARTICLES / objects.len().max(1)).clamp(fewest, most);
    objects
        .into_iter()
        .flat_map(|object| {
            let members = scene.objects[object].members.clone();
            let first = members.start;
            spread(&scene.dynamic_gaussians.means[members], each)
                .into_iter()
                .map(move |i| Particle { object, row: first + i })
        })
        .collect()
}

/// Indices of points far from each other: the one farthest from the centre, then always the one farthest from
/// all before.
pub(crate) fn spread(points: &[[f32; 3]], count: usize) -> Vec<usize> {
    let n = points.len().max(1) as f32;
    let center: [f32; 3] = std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f32>() / n);
    let squared = |a: [f32; 3], b: [f32; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>();
    let mut distances: Vec<f32> = points.iter().map(|&p| squared(p, center)).collect();
    let mut found: Vec<usize> = Vec::new();
    while found.len() < count.min(points.len()) {
        let Some(next) =
            (0..points.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b]).then(b.cmp(&a)))
        else {
            break;
        };
        if found.is_empty() {
            distances.fill(f32::INFINITY);
        }
        for (distance, &point) in distances.iter_mut().zip(points) {
            *distance = distance.min(squared(point, points[next]));
        }
        found.push(next);
    }
    found
}

fn lagrangian(scene: &LagrangianScene, motion: &mut Motion<'_>, particles: &[Particle]) -> Tracks {
    let dt = f64::from(scene.motion.dt);
    let steps = |time: f64| (time / dt + STEP_TOLERANCE).floor() as usize;
    let window = f64::from(scene.motion.time_window);
    let (back, ahead) = (steps(window), steps(3.0 * window));
    let mut tracks = Tracks { times: Vec::new(), positions: vec![Vec::new(); particles.len()] };
    for (count, backwards) in [(back, true), (ahead, false)] {
        let states = if backwards { motion.past_states(count) } else { motion.states(count) };
        let mut rows: Vec<usize> = (0..=count).step_by(DRAWN_STRIDE).chain([count]).collect();
        rows.dedup();
        if backwards {
            rows.remove(0);
            rows.reverse();
        }
        for row in rows {
            tracks.times.push(if backwards { -1.0 } else { 1.0 } * dt * row as f64);
            for (positions, particle) in tracks.positions.iter_mut().zip(particles) {
                positions.push(states[row].q[particle.row]);
            }
        }
    }
    tracks
}

/// The source's Gaussians nearest to the particles at t = 0.
fn followed_by_source(source: &dyn SourceModel, starts: &[[f32; 3]], window: f64) -> Tracks {
    let times = spaced(-window, 3.0 * window, SOURCE_TIMES);
    let twins: Vec<usize> =
        nearest_indices(&source.positions_at(0.0), starts).into_iter().map(|i| i as usize).collect();
    let mut positions = vec![Vec::new(); starts.len()];
    for &time in &times {
        let all = source.positions_at(time as f32);
        positions.iter_mut().zip(&twins).for_each(|(path, &twin)| path.push(all[twin]));
    }
    Tracks { times, positions }
}

/// The particles fixed to the true objects that they lie on.
fn carried(truth: &Truth<'_>, starts: &[[f32; 3]], window: f64) -> Tracks {
    let points = truth.matches(starts);
    let mut tracks = Tracks { times: Vec::new(), positions: vec![Vec::new(); starts.len()] };
    for time in spaced(-window, 3.0 * window, TRUTH_TIMES) {
        let Some(at) = truth.at(time as f32) else { continue };
        tracks.times.push(time);
        for ((path, &start), &point) in tracks.positions.iter_mut().zip(starts).zip(&points) {
            path.push(truth.carried(&at, point, start));
        }
    }
    tracks
}

/// Evenly spaced times, both ends among them.
pub(crate) fn spaced(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| from + (to - from) * i as f64 / (count.max(2) - 1) as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_points_are_the_corners() {
        let grid: Vec<[f32; 3]> = (0..25).map(|i| [(i % 5) as f32, (i / 5) as f32, 0.0]).collect();
        let mut corners = spread(&grid, 4);
        corners.sort_unstable();
        assert_eq!(corners, [0, 4, 20, 24]);
        assert_eq!(spread(&grid[..2], 9).len(), 2);
        assert!(spread(&[], 3).is_empty());
    }
}
