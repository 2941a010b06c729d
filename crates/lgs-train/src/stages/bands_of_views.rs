//! Bands that allow for what single views have wrong, and for what the last choice of laws has put right
//! (method §6).
//!
//! Gaussians that are a little off in one view pull the poses of a body the same way at all times. The
//! scatter of the poses about a law, from which its posterior comes, does not show such errors; that views
//! disagree does. The start and the constants of a law are therefore fitted with each view left out (a
//! jackknife, to first order), and how far these forecasts part widens the band.
//!
//! What all views have in common is Gaussians that were tuned to a motion that was off. They hold the poses
//! back to it, so that as much is left to be put right as the last choice has put right, at any time. Nor is
//! a place ever known better than images resolve it, however many values they have.

use lgs_core::geometry::wide;
use lgs_core::{Stream, holding, stream};
use lgs_data::dataset::Frame;
use lgs_dynamics::{Edit, Reversal};
use lgs_mechanics::bands::HELD;
use lgs_model::{Dynamics, LagrangianScene, Motion, ObjectModel};
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::body::Positions;
use super::newton::Newton;
use super::thresholds::{DRAWS_OF_FORECASTS, FEWEST_VIEWS, FORECAST_PROBE, MOST_GROUPS, PARTICLES_OF_BAND};

/// The scene with the bands of its laws as wide as the disagreement of views asks for, the difference from
/// the motion that it had `before`, with the same Gaussians, and the length that its images resolve, world
/// units.
pub(super) fn with_bands_of_views(
    mut scene: LagrangianScene,
    before: &LagrangianScene,
    frames: &[&Frame],
    (resolved, seed): (f64, u64),
) -> LagrangianScene {
    let Some(groups) = groups_of(frames).filter(|_| scene.objects.iter().any(has_band)) else {
        return scene;
    };
    let (newton, chosen) = (Newton::new(&scene, seed), scene.clone());
    let changes = newton.without_each(&scene, frames, &groups);
    let window = f64::from(scene.motion.time_window);
    let mut motions = motions([&chosen, before]);
    for (object, changes) in changes.iter().enumerate() {
        if !has_band(&scene.objects[object]) {
            continue;
        }
        let Dynamics::Generalised(dynamics) = &mut scene.objects[object].dynamics else { continue };
        let (law, known) = (&dynamics.law, &mut dynamics.known);
        let times = known.band.times.clone();
        let forecasts = Forecasts::new(&newton, object, changes, &times);
        let apart = forecasts.radius(&mut stream(seed, "bands of views", object as u64));
        let corrected = corrections(&mut motions, (before, object), &times);
        let own = known.band.radius.iter().map(|radius| radius.unwrap_or(f64::INFINITY));
        let parts = own.zip(apart.iter().zip(&corrected));
        let radius: Vec<f64> = parts
            .map(|(own, (apart, corrected))| resolved.hypot(own).hypot(*apart).hypot(*corrected))
            .collect();
        tracing::debug!(object, own = ?known.band.radius, ?apart, ?corrected, "bands of views");
        known.widen(law, (&times, &radius), window, forecasts.path(&times, window));
    }
    scene
}

/// Motions of two scenes without an edit.
fn motions(scenes: [&LagrangianScene; 2]) -> [Motion<'_>; 2] {
    scenes.map(|scene| Motion::new(scene, Edit::default(), Reversal::default()))
}

/// How far a scene has the Gaussians of an object at some times from where it had them before: root mean
/// square, world units. Where it had no law of the object, it said nothing of times outside of the window.
fn corrections(
    [now, then]: &mut [Motion<'_>; 2],
    (before, object): (&LagrangianScene, usize),
    times: &[f64],
) -> Vec<f64> {
    let had_law = has_band(&before.objects[object]);
    let window = f64::from(before.motion.time_window);
    let members = &before.objects[object].members;
    let at = |&time: &f64| {
        let time = if had_law { time } else { time.clamp(0.0, window) } as f32;
        let [now, then] = [now.state_at(time).q, then.state_at(time).q];
        let square = |row: usize| wide(now[row]).distance_squared(wide(then[row]));
        let apart = (members.clone().map(square).sum::<f64>() / members.len().max(1) as f64).sqrt();
        if apart.is_finite() { apart } else { f64::INFINITY }
    };
    times.iter().map(at).collect()
}

/// Whether an object follows a law with a band.
fn has_band(object: &ObjectModel) -> bool {
    let law = object.dynamics.generalised().filter(|_| object.recording.is_none());
    law.is_some_and(|dynamics| !dynamics.known.band.times.is_empty())
}

/// Groups of frames with errors of their own: those of each view, or of neighbouring views where there are
/// many. `None` of too few views.
fn groups_of(frames: &[&Frame]) -> Option<Vec<usize>> {
    let mut views: Vec<usize> = frames.iter().map(|frame| frame.camera_id).collect();
    views.sort_unstable();
    views.dedup();
    let groups = views.len().min(MOST_GROUPS);
    let group = |frame: &&Frame| views.partition_point(|&view| view < frame.camera_id) * groups / views.len();
    (views.len() >= FEWEST_VIEWS).then(|| frames.iter().map(group).collect())
}

/// Forecasts of some particles of an object: by time and particle.
struct Forecasts {
    /// With all views.
    middle: Positions,
    /// Of each group that is left out: how far the positions are from the mean over the groups.
    apart: Vec<Positions>,
}

impl Forecasts {
    fn new(newton: &Newton, object: usize, changes: &[Vec<f64>], times: &[f64]) -> Self {
        let times: Vec<f32> = times.iter().map(|&time| time as f32).collect();
        let forecast = |by: &[f64]| -> Positions {
            let all = newton.positions(object, by, &times);
            let some = |all: Vec<[f32; 3]>| {
                let count = all.len().min(PARTICLES_OF_BAND);
                (0..count).map(|i| all[i * all.len() / count]).collect()
            };
            all.into_iter().map(some).collect()
        };
        let middle = forecast(&vec![0.0; changes.first().map_or(0, Vec::len)]);
        // To first order as the changes are: constants that images bind together may change a lot together.
        let slope = |by: &Vec<f64>| -> Positions {
            let [above, below] = [FORECAST_PROBE, -FORECAST_PROBE]
                .map(|part| forecast(&by.iter().map(|by| part * by).collect::<Vec<_>>()));
            let one = |(a, b): (&[f32; 3], &[f32; 3])| {
                std::array::from_fn(|i| (a[i] - b[i]) / (2.0 * FORECAST_PROBE as f32))
            };
            above.iter().zip(&below).map(|(a, b)| a.iter().zip(b).map(one).collect()).collect()
        };
        let mut apart: Vec<Positions> = changes.iter().map(slope).collect();
        let count = apart.len() as f32;
        for time in 0..middle.len() {
            for particle in 0..middle[time].len() {
                for axis in 0..3 {
                    let mean = apart.iter().map(|of| of[time][particle][axis]).sum::<f32>() / count;
                    apart.iter_mut().for_each(|of| of[time][particle][axis] -= mean);
                }
            }
        }
        Self { middle, apart }
    }

    /// Radius that holds a share of the particles' positions, at each time. The jackknife's covariance is
    /// (n − 1) / n times the sum over the groups; of so few, the deviation is itself uncertain, and the
    /// distribution Student's.
    fn radius(&self, stream: &mut Stream) -> Vec<f64> {
        let groups = self.apart.len();
        let freedoms = (groups - 1) as f64;
        let scale = (freedoms / groups as f64).sqrt();
        let chi = ChiSquared::new(freedoms).expect("groups leave a freedom");
        let draw = |_| -> Vec<f32> {
            let heavy = scale * (freedoms / chi.sample(stream)).sqrt();
            let mut weight = || -> f64 { StandardNormal.sample(stream) };
            (0..groups).map(|_| (heavy * weight()) as f32).collect()
        };
        let draws: Vec<Vec<f32>> = (0..DRAWS_OF_FORECASTS).map(draw).collect();
        let at = |time: usize| {
            let distance = |particle: usize, weights: &Vec<f32>| {
                let axis = |axis: usize| -> f32 {
                    weights.iter().zip(&self.apart).map(|(w, of)| w * of[time][particle][axis]).sum()
                };
                f64::from(axis(0).hypot(axis(1)).hypot(axis(2)))
            };
            let particles = 0..self.middle[time].len();
            let distances = particles.flat_map(|p| draws.iter().map(move |weights| distance(p, weights)));
            holding(HELD, distances.collect())
        };
        (0..self.middle.len()).map(at).collect()
    }

    /// Length of the path in a time, the mean over all times.
    fn path(&self, times: &[f64], duration: f64) -> f64 {
        let step = |pair: &[Vec<[f32; 3]>]| {
            let square = |(a, b): (&[f32; 3], &[f32; 3])| {
                (0..3).map(|axis| f64::from(a[axis] - b[axis]).powi(2)).sum::<f64>()
            };
            let sum: f64 = pair[0].iter().zip(&pair[1]).map(square).sum();
            (sum / pair[0].len().max(1) as f64).sqrt()
        };
        let length: f64 = self.middle.windows(2).map(step).sum();
        let [first, last] = [times.first(), times.last()].map(|time| time.copied().unwrap_or(0.0));
        length * duration / (last - first).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure, GaussianCloud};
    use lgs_mechanics::Law;
    use lgs_mechanics::bands::{Known, PositionBand};
    use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
    use lgs_model::{GeneralisedDynamics, MotionConfig};

    fn frame(camera_id: usize) -> Frame {
        let camera = Camera::look_at([0.0, -1.0, 0.0], [0.0; 3], 0.5, 1, 1);
        let pixels = vec![0; 4].into();
        Frame { name: String::new(), camera_id, camera, time: 0.0, exposure: Exposure::IDENTITY, pixels }
    }

    fn groups_of_views(views: &[usize]) -> Option<Vec<usize>> {
        let frames: Vec<Frame> = views.iter().map(|&view| frame(view)).collect();
        groups_of(&frames.iter().collect::<Vec<_>>())
    }

    #[test]
    fn each_view_is_a_group_and_many_views_are_twelve() {
        assert_eq!(groups_of_views(&[7, 3, 7, 9, 3]), Some(vec![1, 0, 1, 2, 0]));
        assert_eq!(groups_of_views(&[0, 1, 0, 1]), None);
        let many: Vec<usize> = (0..36).collect();
        let groups = groups_of_views(&many).expect("groups");
        assert_eq!(groups, many.iter().map(|view| view / 3).collect::<Vec<_>>());
    }

    #[test]
    fn the_radius_is_that_of_students_distribution_of_the_jackknife() {
        let offsets: Vec<f32> = (0..12).map(|group| 0.01 * (group as f32 - 5.5)).collect();
        let apart = offsets.iter().map(|&x| vec![vec![[x, 0.0, 0.0]; 4]]).collect();
        let forecasts = Forecasts { middle: vec![vec![[0.0; 3]; 4]], apart };
        let found = forecasts.radius(&mut stream(1, "test", 0))[0];
        let squares: f64 = offsets.iter().map(|x| f64::from(*x).powi(2)).sum();
        // Nine tenths of Student's distribution with 11 degrees of freedom are within 1.796.
        let expected = 1.796 * (11.0 / 12.0 * squares).sqrt();
        assert!((found / expected - 1.0).abs() < 0.2, "{found}, not {expected}");
    }

    /// A Gaussian that slides freely with a velocity, by a law with a band or without.
    fn sliding(velocity: f64, has_band: bool) -> LagrangianScene {
        let band = PositionBand { times: vec![0.0; usize::from(has_band)], ..PositionBand::default() };
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.05).expect("a law");
        let start = State { x: vec![0.0; 3], v: vec![velocity, 0.0, 0.0] };
        let known = Known { band, ..Known::default() };
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
        let dynamics = Dynamics::Generalised(dynamics);
        let config = MotionConfig { dt: 0.05, time_window: 1.0 };
        LagrangianScene {
            velocities: vec![[velocity as f32, 0.0, 0.0]],
            objects: vec![ObjectModel { members: 0..1, dynamics, recording: None }],
            dynamic_gaussians: GaussianCloud::isotropic(vec![[0.0; 3]], 0.15, [0.5; 3], 0.9),
            ..LagrangianScene::still(GaussianCloud::default(), config, [1.0; 3])
        }
    }

    #[test]
    fn as_much_is_left_to_be_put_right_as_was_put_right_where_a_law_said_something() {
        let corrected = |had_law: bool| {
            let scenes = [sliding(0.6, true), sliding(0.5, had_law)];
            corrections(&mut motions(scenes.each_ref()), (&scenes[1], 0), &[-1.0, 0.5, 2.0])
        };
        let near = |found: Vec<f64>, expected: [f64; 3]| {
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5)
        };
        assert!(near(corrected(true), [0.1, 0.05, 0.2]), "{:?}", corrected(true));
        assert!(near(corrected(false), [0.0, 0.05, 0.1]), "{:?}", corrected(false));
    }

    #[test]
    fn a_path_is_as_long_as_the_way_of_a_window() {
        let middle = (0..9).map(|i| vec![[0.5 * i as f32, 0.0, 1.0]; 2]).collect();
        let times: Vec<f64> = (0..9).map(|i| 0.25 * f64::from(i) - 1.0).collect();
        let path = Forecasts { middle, apart: Vec::new() }.path(&times, 0.75);
        assert!((path - 1.5).abs() < 1e-6, "{path}");
    }
}
