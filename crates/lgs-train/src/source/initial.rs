//! The first Gaussians (method §3.4): positions from the dataset, its silhouettes or a box; sizes from the
//! spacing of neighbours.

use std::collections::BTreeMap;

use lgs_core::linear::{add, norm, scale, sub};
use lgs_core::{GaussianCloud, SH_C0, mean_squared_neighbor_distance, sh_coefficients, stream};
use lgs_data::dataset::{Dataset, Frame, Points};
use lgs_model::source::InputFrame;
use rand::RngExt;

use super::config::SourceConfig;
use super::config_groups::InitialPoints;
use super::flown::points_of;
use crate::data_summary::DataSummary;
use crate::thresholds::{
    FIRST_OPACITY, FIRST_SHARE, LEAST_CARVED_FRACTION, MIN_SQUARED_DISTANCE, MOST_CELLS, TRACKED_FRACTION,
};
use crate::tracks::Track;

/// The Gaussians that training starts from, with balls of them where the tracks begin and on the surfaces of
/// things in flight; the same for the same seed.
pub(super) fn initial_cloud(
    dataset: &Dataset,
    config: &SourceConfig,
    (tracks, things): (&[Track], &[Track]),
    seed: u64,
) -> GaussianCloud {
    let mut points = thinned(initial_points(dataset, config, seed), config.densify.max_gaussians);
    if !tracks.is_empty() {
        points = with_tracked(dataset, &points, tracks, seed);
    }
    let own = points_of(dataset, config, things);
    points.positions.extend(own.positions);
    points.colors.extend(own.colors);
    let squared = mean_squared_neighbor_distance(&points.positions, 3);
    let log_scales: Vec<f32> = squared.iter().map(|&d| 0.5 * d.max(MIN_SQUARED_DISTANCE).ln()).collect();
    gaussians_at(points.positions, &points.colors, &log_scales, config.sh_degree)
}

/// Round Gaussians as training starts them, faint, with colours in [0, 1] and logarithms of standard
/// deviations.
pub(super) fn gaussians_at(
    means: Vec<[f32; 3]>,
    colors: &[[f32; 3]],
    log_scales: &[f32],
    sh_degree: usize,
) -> GaussianCloud {
    let n = means.len();
    let coefficients = sh_coefficients(sh_degree);
    let mut sh = vec![0.0; n * 3 * coefficients];
    for (row, color) in sh.chunks_exact_mut(3 * coefficients).zip(colors) {
        (0..3).for_each(|c| row[c] = (color[c] - 0.5) / SH_C0);
    }
    GaussianCloud {
        means,
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        log_scales: log_scales.iter().map(|&s| [s; 3]).collect(),
        raw_opacities: vec![(FIRST_OPACITY / (1.0 - FIRST_OPACITY)).ln(); n],
        sh,
        sh_degree,
    }
}

/// Whether first points are carved by silhouettes: not where the set ships points, nor by the images of the
/// first time where the camera jumps, since one image carves a cone.
fn is_carved(points: InitialPoints, data: Option<DataSummary>) -> bool {
    let Some(data) = data.filter(|data| data.points == 0) else { return false };
    match points {
        InitialPoints::Random => false,
        InitialPoints::HullOfAll => true,
        InitialPoints::Hull | InitialPoints::Surfaces => !data.has_jumping_camera(),
    }
}

fn initial_points(dataset: &Dataset, config: &SourceConfig, seed: u64) -> Points {
    let count = config.initial_gaussians;
    if config.initial_half_extent > 0.0 && dataset.init_points.is_none() {
        let mut random = stream(seed, "initial points", 0);
        let half = config.initial_half_extent;
        let positions: Vec<[f32; 3]> =
            (0..count).map(|_| std::array::from_fn(|_| random.random_range(-half..half))).collect();
        return Points { colors: vec![[0.5; 3]; count], positions };
    }
    if config.initial_points == InitialPoints::Surfaces && dataset.init_points.is_none() {
        let is_opaque = !dataset.split("train").iter().any(Frame::has_alpha);
        let most = match config.densify.max_gaussians {
            0 => count,
            budget => (FIRST_SHARE * budget as f64) as usize,
        };
        let points = if is_opaque { dataset.surface_points(most, seed) } else { Points::default() };
        if points.positions.len() >= count.min(most) {
            return points;
        }
    }
    if is_carved(config.initial_points, DataSummary::of(dataset)) {
        let points = match config.initial_points {
            InitialPoints::HullOfAll => dataset.hull_points(count, seed),
            _ => dataset.carved_points(count, seed),
        };
        if points.positions.len() as f32 >= LEAST_CARVED_FRACTION * count as f32 {
            return points;
        }
    }
    dataset.initial_points(count, seed)
}

/// Points of which at most so many are left (0: all), spread as evenly as they lie: every voxel of a grid as
/// fine as that allows keeps the mean of its own. A scene that starts with more Gaussians than its budget
/// could neither afford nor lose them.
pub(super) fn thinned(points: Points, most: usize) -> Points {
    let count = points.positions.len();
    if most == 0 || count <= most {
        return points;
    }
    let frame = InputFrame::around(&points.positions);
    let voxels = |cells: i64| {
        let mut voxels: BTreeMap<[i64; 3], (usize, [f32; 6])> = BTreeMap::new();
        for (p, c) in points.positions.iter().zip(&points.colors) {
            let local = |axis: usize| f64::from((p[axis] - frame.center[axis]) / frame.scale);
            let key = std::array::from_fn(|axis| (0.5 * local(axis) * cells as f64).round() as i64);
            let (n, sums) = voxels.entry(key).or_default();
            *n += 1;
            (0..3).for_each(|i| (sums[i], sums[3 + i]) = (sums[i] + p[i], sums[3 + i] + c[i]));
        }
        voxels
    };
    // The number of voxels grows with that of cells, if not strictly: the largest that fits is bisected.
    let (mut fits, mut too_many) = (1_i64, MOST_CELLS);
    while too_many - fits > 1 {
        let cells = (fits + too_many) / 2;
        if voxels(cells).len() <= most { fits = cells } else { too_many = cells }
    }
    let mean = |(n, sums): (usize, [f32; 6])| sums.map(|sum| sum / n as f32);
    let means: Vec<[f32; 6]> = voxels(fits).into_values().map(mean).take(most).collect();
    Points {
        positions: means.iter().map(|m| [m[0], m[1], m[2]]).collect(),
        colors: means.iter().map(|m| [m[3], m[4], m[5]]).collect(),
    }
}

/// Balls of points at the starts of the tracks, and of the given points those that the first images show
/// beside these.
fn with_tracked(dataset: &Dataset, points: &Points, tracks: &[Track], seed: u64) -> Points {
    let frames = dataset.split("train");
    let first = frames.iter().map(|f| f.time).fold(f32::INFINITY, f32::min);
    let earliest: Vec<&Frame> = frames.iter().filter(|f| f.time <= first).collect();
    let explained = |p: [f32; 3]| {
        let seen_as = |frame: &&Frame, track: &Track| {
            let from_eye = sub(p, frame.camera.center_in_world());
            track.explains(&frame.camera, frame.time, scale(from_eye, 1.0 / norm(from_eye).max(1e-9)))
        };
        earliest.iter().any(|frame| tracks.iter().any(|track| seen_as(frame, track)))
    };
    let mut kept = Points::default();
    for (&position, &color) in points.positions.iter().zip(&points.colors) {
        if !explained(position) {
            kept.positions.push(position);
            kept.colors.push(color);
        }
    }
    let each = (TRACKED_FRACTION * points.positions.len() as f32) as usize / tracks.len();
    let mut random = stream(seed, "points of tracks", 0);
    for track in tracks {
        let center = track.position(first);
        let mut in_ball = || loop {
            let p: [f32; 3] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
            if norm(p) <= 1.0 {
                return add(center, scale(p, track.radius));
            }
        };
        kept.positions.extend((0..each).map(|_| in_ball()));
    }
    kept.colors.resize(kept.positions.len(), [0.5; 3]);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_image_of_a_camera_that_jumps_carves_nothing() {
        let jumping = DataSummary::JUMPING;
        let standing = DataSummary { views: 12, images: 600, ..jumping };
        for points in [InitialPoints::Hull, InitialPoints::Surfaces] {
            assert!(!is_carved(points, Some(jumping)) && is_carved(points, Some(standing)));
            assert!(
                !is_carved(points, Some(DataSummary { points: 9, ..standing })) && !is_carved(points, None)
            );
        }
        assert!(is_carved(InitialPoints::HullOfAll, Some(jumping)));
        assert!(!is_carved(InitialPoints::Random, Some(standing)));
    }

    #[test]
    fn points_are_thinned_to_a_budget_and_stay_where_they_were() {
        let position = |i: usize| [i % 20, i / 20 % 20, i / 400].map(|c| c as f32);
        let positions: Vec<[f32; 3]> = (0..8000).map(position).collect();
        let colors: Vec<[f32; 3]> = positions.iter().map(|p| p.map(|v| v / 20.0)).collect();
        let points = Points { positions, colors };
        assert_eq!(thinned(points.clone(), 0), points);
        assert_eq!(thinned(points.clone(), 8000), points);
        for most in [1, 500, 3000] {
            let few = thinned(points.clone(), most);
            let count = few.positions.len();
            assert!(count <= most && 4 * count > most, "{count} of {most}");
            for (p, c) in few.positions.iter().zip(&few.colors) {
                assert!((0..3).all(|i| (0.0..=19.0).contains(&p[i]) && (p[i] / 20.0 - c[i]).abs() < 1e-4));
            }
        }
    }
}
