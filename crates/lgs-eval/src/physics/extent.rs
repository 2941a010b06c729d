//! Whether a scene keeps its size: foreground pixels (G46), spread of objects, and reach of the moving
//! Gaussians.
//!
//! Pixels depend on perspective and on what leaves the view, so the truth's own pixels are compared where
//! images show them, and spread and reach in space where ground truth is known.

use std::collections::BTreeMap;

use lgs_core::{Camera, GaussianCloud, linear};
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion, SceneState};
use rayon::prelude::*;

use super::truth::Truth;
use super::{centroid, distance, long_steps, mean, percentile, window_steps};
use crate::image_score::ImageScore;
use crate::{finite, render};

/// Largest image width for counting pixels: silhouettes need no more.
const WIDTH: u32 = 200;

/// Cameras looked through at most, evenly chosen.
const VIEWS: usize = 12;

/// Times in (0, 3 τ_max].
const TIMES: usize = 30;

/// Opacity above which a pixel is foreground.
const OPACITY_THRESHOLD: f32 = 0.5;

/// Every how many steps spread and reach are looked at.
const STRIDE: usize = 5;

/// Maximum and minimum of a ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Largest.
    pub max: f64,
    /// Smallest.
    pub min: f64,
}

impl Range {
    fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        values.into_iter().try_fold(None, |range: Option<Self>, v| {
            finite(v).map(|v| {
                Some(range.map_or(Self { max: v, min: v }, |r| Self { max: r.max.max(v), min: r.min.min(v) }))
            })
        })?
    }
}

/// Foreground pixels over those at t = 0: mean over views, range over times in (0, 3 τ_max].
///
/// Where everything is covered by static Gaussians (a room) only the moving ones are drawn: the walls would
/// hide every change.
#[must_use]
pub fn pixel_extent(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    cameras: &[Camera],
    background: [f32; 3],
) -> Option<Range> {
    let lens = Lens::new(cameras, background);
    let covered = lens.is_covered(&scene.cloud_at(&motion.state_at(0.0)));
    let bare = LagrangianScene {
        static_gaussians: GaussianCloud {
            sh_degree: scene.dynamic_gaussians.sh_degree,
            ..Default::default()
        },
        ..scene.clone()
    };
    let shown = if covered && !scene.dynamic_gaussians.is_empty() { &bare } else { scene };
    lens.extent(3.0 * scene.motion.time_window, |t| shown.cloud_at(&motion.state_at(t)))
}

/// The same of a source model that is asked for times up to three windows. Where everything is covered, only
/// what moves within the window is drawn: farther than 0.01 world units from where it is at t = 0 (G18).
#[must_use]
pub fn source_pixel_extent(
    source: &dyn SourceModel,
    window: f32,
    cameras: &[Camera],
    background: [f32; 3],
) -> Option<Range> {
    const STATIC: f32 = 0.01;
    const SAMPLES: usize = 15;
    let lens = Lens::new(cameras, background);
    if !lens.is_covered(&source.cloud_at(0.0)) {
        return lens.extent(3.0 * window, |t| source.cloud_at(t));
    }
    let start = source.positions_at(0.0);
    let mut moves = vec![false; start.len()];
    for i in 1..=SAMPLES {
        let now = source.positions_at(window * i as f32 / SAMPLES as f32);
        moves
            .iter_mut()
            .zip(start.iter().zip(&now))
            .for_each(|(moves, (&a, &b))| *moves |= linear::norm(linear::sub(b, a)) >= STATIC);
    }
    let dynamic_gaussians: Vec<usize> = (0..moves.len()).filter(|&i| moves[i]).collect();
    lens.extent(3.0 * window, |t| source.cloud_at(t).select(&dynamic_gaussians))
}

/// What foreground is counted through.
struct Lens {
    views: Vec<Camera>,
    background: [f32; 3],
}

impl Lens {
    fn new(cameras: &[Camera], background: [f32; 3]) -> Self {
        Self { views: spaced(cameras, VIEWS).into_iter().map(shrunk).collect(), background }
    }

    /// Whether a cloud leaves nothing of the background to see.
    fn is_covered(&self, cloud: &GaussianCloud) -> bool {
        let counts = counts(cloud, &self.views, self.background);
        counts.iter().zip(&self.views).all(|(&count, view)| count as f64 > 0.95 * view.pixels() as f64)
    }

    /// Range over times in (0, `end`] of foreground over that at t = 0.
    fn extent(&self, end: f32, mut cloud_at: impl FnMut(f32) -> GaussianCloud) -> Option<Range> {
        let start = counts(&cloud_at(0.0), &self.views, self.background);
        let ratio = |i: usize| {
            let cloud = cloud_at(end * i as f32 / TIMES as f32);
            mean_ratio(&counts(&cloud, &self.views, self.background), &start).unwrap_or(f64::NAN)
        };
        Range::of((1..=TIMES).map(ratio).collect::<Vec<_>>())
    }
}

fn mean_ratio(counts: &[usize], start: &[usize]) -> Option<f64> {
    let ratios: Vec<f64> =
        counts.iter().zip(start).filter(|&(_, &s)| s > 0).map(|(&c, &s)| c as f64 / s as f64).collect();
    mean(&ratios)
}

/// Foreground pixels in every view.
fn counts(cloud: &GaussianCloud, views: &[Camera], background: [f32; 3]) -> Vec<usize> {
    let count =
        |view: &Camera| render(cloud, view, background).opacity().filter(|&o| o > OPACITY_THRESHOLD).count();
    views.par_iter().map(count).collect()
}

fn shrunk(camera: &Camera) -> Camera {
    if camera.width <= WIDTH {
        return *camera;
    }
    let height = (u64::from(camera.height) * u64::from(WIDTH) / u64::from(camera.width)).max(1) as u32;
    camera.resized(WIDTH, height)
}

/// At most `count` items, evenly spaced, the first among them.
fn spaced<T>(items: &[T], count: usize) -> Vec<&T> {
    let n = items.len().min(count);
    (0..n).map(|i| &items[i * items.len() / n]).collect()
}

/// Foreground pixels over the true images', by frames as (time, score): mean over the views of a time, range
/// over times.
#[must_use]
pub fn pixel_extent_against_images<'a>(frames: impl Iterator<Item = (f32, &'a ImageScore)>) -> Option<Range> {
    let mut by_time: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    for (time, score) in frames {
        // A key in millionths, because floats have no order of their own.
        let sums = by_time.entry((f64::from(time) * 1e6).round() as i64).or_default();
        sums.0 += score.predicted_pixels as f64;
        sums.1 += score.true_pixels as f64;
    }
    Range::of(
        by_time.into_values().filter(|&(_, truth)| truth > 0.0).map(|(predicted, truth)| predicted / truth),
    )
}

/// Spread of every object relative to t = 0, over the same of the true object that most of its Gaussians
/// match; range over objects and steps in [0, 3 τ_max].
#[must_use]
pub fn spread_against_truth(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
) -> Option<Range> {
    let matches = truth.matches(&scene.dynamic_gaussians.means);
    let dt = scene.motion.dt;
    let states: Vec<(f32, &SceneState)> = motion
        .states(long_steps(&scene.motion))
        .iter()
        .enumerate()
        .step_by(STRIDE)
        .map(|(i, s)| (i as f32 * dt, s))
        .collect();
    let mut ratios = Vec::new();
    for object in scene.objects.iter().filter(|o| o.members.len() > 1) {
        let label = most_common(matches[object.members.clone()].iter().map(|&p| truth.object(p)));
        let true_points = |points: &[[f32; 3]]| -> Vec<[f32; 3]> {
            points
                .iter()
                .enumerate()
                .filter(|&(p, _)| Some(truth.object(p)) == label)
                .map(|(_, &q)| q)
                .collect()
        };
        let start = (
            spread(&scene.dynamic_gaussians.means[object.members.clone()]),
            spread(&true_points(truth.start())),
        );
        for (t, state) in &states {
            let Some(at) = truth.at(*t) else { continue };
            let now = (spread(&state.q[object.members.clone()]), spread(&true_points(&at.points)));
            ratios.push((now.0 / start.0) / (now.1 / start.1));
        }
    }
    Range::of(ratios)
}

/// Root-mean-square distance to the centroid.
fn spread(points: &[[f32; 3]]) -> f64 {
    let center = centroid(points).map(|c| c as f32);
    let squares: Vec<f64> = points.iter().map(|&p| distance(p, center).powi(2)).collect();
    mean(&squares).unwrap_or(0.0).sqrt()
}

fn most_common(labels: impl Iterator<Item = i32>) -> Option<i32> {
    let mut counts: BTreeMap<i32, usize> = BTreeMap::new();
    for label in labels {
        *counts.entry(label).or_default() += 1;
    }
    counts.into_iter().max_by_key(|&(label, count)| (count, std::cmp::Reverse(label))).map(|(label, _)| label)
}

/// Farthest distance of moving Gaussians, and its 99th percentile, from the centre of the true paths' box,
/// over the true points' farthest.
#[must_use]
pub fn reach_against_truth(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
    truth: &Truth<'_>,
) -> Option<(f64, f64)> {
    let moving = truth.moving();
    let visited: Vec<[f32; 3]> = truth
        .samples()
        .iter()
        .flat_map(|points| points.iter().zip(&moving).filter(|&(_, &m)| m).map(|(&p, _)| p))
        .collect();
    let (low, high) = visited.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(low, high), p| {
        (std::array::from_fn(|c| low[c].min(p[c])), std::array::from_fn(|c| high[c].max(p[c])))
    });
    let center: [f32; 3] = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
    let true_reach = visited.iter().map(|&p| distance(p, center)).fold(0.0, f64::max);
    let mut farthest = vec![0.0_f64; scene.dynamic_gaussians.len()];
    let mut include = |states: &[SceneState]| {
        for state in states.iter().step_by(STRIDE) {
            for (far, &q) in farthest.iter_mut().zip(&state.q) {
                let d = distance(q, center);
                // Infinity instead of NaN, so that a diverged Gaussian cannot vanish in a maximum.
                *far = if d.is_nan() { f64::INFINITY } else { far.max(d) };
            }
        }
    };
    include(motion.states(long_steps(&scene.motion)));
    include(motion.past_states(window_steps(&scene.motion)));
    let p99 = percentile(farthest.clone(), 0.99)?;
    Some((finite(farthest.into_iter().fold(0.0, f64::max) / true_reach)?, finite(p99 / true_reach)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diverged_ratio_is_no_range() {
        assert_eq!(Range::of([1.0, 2.0, 0.5]), Some(Range { max: 2.0, min: 0.5 }));
        assert_eq!(Range::of([1.0, f64::NAN]), None);
        assert_eq!(Range::of([]), None);
    }

    #[test]
    fn what_grows_is_found_to_grow() {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, 96, 96);
        let lens = Lens::new(&[camera], [1.0; 3]);
        let ball = |radius: f32| GaussianCloud::isotropic(vec![[0.0; 3]], radius, [0.5; 3], 0.95);
        assert!(!lens.is_covered(&ball(0.1)) && lens.is_covered(&ball(5.0)));
        let range = lens.extent(1.0, |t| ball(0.15 * (1.0 + t))).expect("range");
        assert!(
            (range.max - 4.0).abs() < 0.4 && range.min > 1.0,
            "twice the radius, four times the pixels: {range:?}"
        );
    }

    #[test]
    fn views_are_spaced_evenly() {
        let items: Vec<usize> = (0..24).collect();
        assert_eq!(spaced(&items, 4), [&0, &6, &12, &18]);
        assert_eq!(spaced(&items[..2], 4), [&0, &1]);
    }

    #[test]
    fn views_in_which_nothing_was_seen_do_not_count() {
        assert_eq!(mean_ratio(&[10, 5, 7], &[5, 5, 0]), Some(1.5));
    }
}
