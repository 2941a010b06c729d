//! Foreground pixels over time, of a scene, of a source model, and against true images.

use std::collections::BTreeMap;

use lgs_core::{Camera, GaussianCloud, linear};
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion};
use rayon::prelude::*;

use super::super::mean;
use super::Range;
use crate::image_score::ImageScore;
use crate::render;
use crate::thresholds::{
    COVERED, DISPLACEMENT_TIMES, DYNAMIC_DISPLACEMENT, EXTENT_TIMES, EXTENT_VIEWS, EXTENT_WIDTH,
    OPACITY_THRESHOLD,
};

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
    let views = ViewSet::new(cameras, background);
    let covered = views.is_covered(&scene.cloud_at(&motion.state_at(0.0), 0.0));
    let bare = LagrangianScene {
        static_gaussians: GaussianCloud {
            sh_degree: scene.dynamic_gaussians.sh_degree,
            ..Default::default()
        },
        shading: None,
        light: None,
        ..scene.clone()
    };
    let shown = if covered && !scene.dynamic_gaussians.is_empty() { &bare } else { scene };
    views.extent(3.0 * scene.motion.time_window, |t| shown.cloud_at(&motion.state_at(t), t))
}

/// Foreground pixels of a source model over those at t = 0, for times up to three windows.
///
/// Where everything is covered, only Gaussians that move within the window are drawn, by more than 0.01 world
/// units from where they are at t = 0.
#[must_use]
pub fn source_pixel_extent(
    source: &dyn SourceModel,
    window: f32,
    cameras: &[Camera],
    background: [f32; 3],
) -> Option<Range> {
    let views = ViewSet::new(cameras, background);
    if !views.is_covered(&source.cloud_at(0.0)) {
        return views.extent(3.0 * window, |t| source.cloud_at(t));
    }
    let start = source.positions_at(0.0);
    let mut moves = vec![false; start.len()];
    for i in 1..=DISPLACEMENT_TIMES {
        let now = source.positions_at(window * i as f32 / DISPLACEMENT_TIMES as f32);
        moves
            .iter_mut()
            .zip(start.iter().zip(&now))
            .for_each(|(moves, (&a, &b))| *moves |= linear::norm(linear::sub(b, a)) >= DYNAMIC_DISPLACEMENT);
    }
    let dynamic_gaussians: Vec<usize> = (0..moves.len()).filter(|&i| moves[i]).collect();
    views.extent(3.0 * window, |t| source.cloud_at(t).select(&dynamic_gaussians))
}

/// The small views through which foreground pixels are counted.
struct ViewSet {
    views: Vec<Camera>,
    background: [f32; 3],
}

impl ViewSet {
    fn new(cameras: &[Camera], background: [f32; 3]) -> Self {
        Self { views: spaced(cameras, EXTENT_VIEWS).into_iter().map(shrunk).collect(), background }
    }

    /// Whether a cloud leaves nothing of the background to see.
    fn is_covered(&self, cloud: &GaussianCloud) -> bool {
        let counts = counts(cloud, &self.views, self.background);
        counts.iter().zip(&self.views).all(|(&count, view)| count as f64 > COVERED * view.pixels() as f64)
    }

    /// Range over times in (0, `end`] of foreground over that at t = 0.
    fn extent(&self, end: f32, mut cloud_at: impl FnMut(f32) -> GaussianCloud) -> Option<Range> {
        let start = counts(&cloud_at(0.0), &self.views, self.background);
        let ratio = |i: usize| {
            let cloud = cloud_at(end * i as f32 / EXTENT_TIMES as f32);
            mean_ratio(&counts(&cloud, &self.views, self.background), &start).unwrap_or(f64::NAN)
        };
        Range::of((1..=EXTENT_TIMES).map(ratio).collect::<Vec<_>>())
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
    if camera.width <= EXTENT_WIDTH {
        return *camera;
    }
    let height = (u64::from(camera.height) * u64::from(EXTENT_WIDTH) / u64::from(camera.width)).max(1) as u32;
    camera.resized(EXTENT_WIDTH, height)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grows_is_found_to_grow() {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, 96, 96);
        let views = ViewSet::new(&[camera], [1.0; 3]);
        let ball = |radius: f32| GaussianCloud::isotropic(vec![[0.0; 3]], radius, [0.5; 3], 0.95);
        assert!(!views.is_covered(&ball(0.1)) && views.is_covered(&ball(5.0)));
        let range = views.extent(1.0, |t| ball(0.15 * (1.0 + t))).expect("range");
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
