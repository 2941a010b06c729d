//! Where the first Gaussians go: the points that a set ships, or random ones in a box inferred from the
//! cameras.
//!
//! The box is a cube. Its centre is the point nearest to all viewing axes in the least-squares sense (with a
//! weak pull to a point in front of the cameras, which decides when the axes are parallel). Half its side is
//! what the median camera sees at the centre's depth, `distance · tan(fov / 2)`, at most 0.9 of the camera's
//! distance, so that points do not sit on the lenses. A set without any transparent pixel shows surroundings,
//! which reach beyond what its cameras aim at: its cube is 1.3 times as large.
//!
//! Random points are carved: a point survives if every earliest training image whose view it lies in shows
//! something there, which is an opaque pixel, or, in an image without transparency, one that differs from the
//! background. Their colour is the mean of what those images show.

use super::hull::{Shown, shown_at};
use super::set::{Dataset, Frame};
use super::store::Picture;
use crate::ply::Points;
use crate::thresholds::{
    CARVING_TRIES, CENTER_PULL, EXTENT_FACTOR, MAX_BOX_DISTANCE, NEAR_SHARE, SURROUNDINGS,
};
use glam::{Mat3, Vec3};
use lgs_core::{Camera, DEFAULT_NEAR, stream};
use rand::RngExt;
use std::sync::Arc;

/// An axis-aligned cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneBox {
    /// Centre, world units.
    pub center: [f32; 3],
    /// Half the side, world units.
    pub half_side: f32,
}

impl Dataset {
    /// The shipped points, or `count` random ones in [`Self::scene_box`] with grey colours; the same seed
    /// gives the same points.
    #[must_use]
    pub fn initial_points(&self, count: usize, seed: u64) -> Points {
        if let Some(points) = &self.init_points {
            return points.clone();
        }
        let cube = self.scene_box();
        let mut rng = stream(seed, "initial points", 0);
        let positions: Vec<[f32; 3]> = (0..count).map(|_| random_point(&cube, &mut rng)).collect();
        Points { colors: vec![[0.5; 3]; positions.len()], positions }
    }

    /// As [`Self::initial_points`], but carved by what the earliest training images show and coloured by
    /// them.
    ///
    /// Fewer than `count` points come back only if the silhouettes share next to no volume of the box.
    #[must_use]
    pub fn carved_points(&self, count: usize, seed: u64) -> Points {
        if let Some(points) = &self.init_points {
            return points.clone();
        }
        let cube = self.scene_box();
        let earliest = earliest_frames(self.split("train"));
        let views: Vec<(&Frame, Arc<Picture>)> =
            earliest.into_iter().map(|frame| (frame, frame.picture())).collect();
        let mut rng = stream(seed, "carved points", 0);
        let mut points = Points::default();
        for _ in 0..count * CARVING_TRIES {
            if points.positions.len() == count {
                break;
            }
            let point = random_point(&cube, &mut rng);
            if let Some(color) = seen_color(&views, point, self.background) {
                points.positions.push(point);
                points.colors.push(color);
            }
        }
        points
    }

    /// The width, world units, that a pixel of the median training camera covers at the centre of
    /// [`Self::scene_box`].
    #[must_use]
    pub fn pixel_size(&self) -> f32 {
        pixel_size_at(&self.cameras("train"), self.scene_box().center)
    }

    /// Radius of the training cameras around their mean, times 1.1; thresholds of
    /// densification are in this unit.
    #[must_use]
    pub fn extent(&self) -> f32 {
        camera_extent(self.split(self.first_split()))
    }

    /// Median distance of the training cameras from what they look at, world units; 0 without images. Other
    /// than the extent it does not depend on how far around the scene they stand.
    #[must_use]
    pub fn viewing_distance(&self) -> f32 {
        let frames = self.cameras(self.first_split());
        let views: Vec<(Vec3, Vec3, f32)> = frames.iter().map(|frame| view_of(&frame.camera)).collect();
        if views.is_empty() {
            return 0.0;
        }
        let center = point_nearest_to_axes(&views);
        let mut distances: Vec<f32> = views.iter().map(|view| view.0.distance(center)).collect();
        distances.sort_by(f32::total_cmp);
        distances[distances.len() / 2]
    }

    /// The training split, else the first one.
    fn first_split(&self) -> &str {
        let first = || self.splits.keys().next().map_or("train", String::as_str);
        if self.splits.contains_key("train") { "train" } else { first() }
    }

    /// The cube that the training cameras look at.
    #[must_use]
    pub fn scene_box(&self) -> SceneBox {
        let frames = self.cameras(self.first_split());
        let views: Vec<(Vec3, Vec3, f32)> = frames.iter().map(|frame| view_of(&frame.camera)).collect();
        if views.is_empty() {
            return SceneBox { center: [0.0; 3], half_side: 1.0 };
        }
        let reach = if frames.iter().any(|frame| frame.has_alpha()) { 1.0 } else { SURROUNDINGS };
        let center = point_nearest_to_axes(&views);
        let mut halves: Vec<f32> = views
            .iter()
            .map(|&(eye, _, half_tan)| {
                let distance = eye.distance(center);
                (distance * half_tan).min(MAX_BOX_DISTANCE * distance)
            })
            .collect();
        halves.sort_by(f32::total_cmp);
        SceneBox { center: center.into(), half_side: (reach * halves[halves.len() / 2]).max(1e-3) }
    }
}

/// The median over cameras of a pixel's width at the depth of a point, world units; 0 without cameras.
fn pixel_size_at(frames: &[&Frame], point: [f32; 3]) -> f32 {
    let mut sizes: Vec<f32> = frames
        .iter()
        .map(|frame| frame.camera.pixel_from_world(point).1.max(0.0) / frame.camera.fx)
        .collect();
    sizes.sort_by(f32::total_cmp);
    sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)
}

/// 1.1 times the largest distance of a camera from the mean of all.
fn camera_extent(frames: &[Frame]) -> f32 {
    let centers: Vec<Vec3> = frames.iter().map(|frame| Vec3::from(frame.camera.center_in_world())).collect();
    let mean = centers.iter().fold(Vec3::ZERO, |sum, &c| sum + c) / centers.len().max(1) as f32;
    EXTENT_FACTOR * centers.iter().map(|c| c.distance(mean)).fold(0.0, f32::max)
}

/// Near planes of cameras that leave them to the data: for each the same share of its own distance from what
/// the cameras of a rig look at, so that a camera that stands close still shows what comes closer.
#[derive(Clone, Copy, Debug)]
pub struct NearPlanes {
    center: Vec3,
    /// Near plane over distance; nothing for a single camera.
    share: Option<f32>,
}

impl NearPlanes {
    /// Near planes for a rig: a part of the distance, but no more than the depth from which the nearest other
    /// camera sees the same, in the median over the cameras.
    #[must_use]
    pub fn of(rig: &[Camera]) -> Self {
        let views: Vec<(Vec3, Vec3, f32)> = rig.iter().map(view_of).collect();
        let center = if views.is_empty() { Vec3::ZERO } else { point_nearest_to_axes(&views) };
        let share = |&(eye, _, half_tan): &(Vec3, Vec3, f32)| {
            let apart = views.iter().map(|other| other.0.distance(eye)).filter(|&apart| apart > 0.0);
            let shared = apart.fold(f32::INFINITY, f32::min) / (2.0 * half_tan);
            shared.is_finite().then(|| NEAR_SHARE.min(shared / eye.distance(center)))
        };
        let mut shares: Vec<f32> = views.iter().filter_map(share).collect();
        shares.sort_by(f32::total_cmp);
        Self { center, share: shares.get(shares.len() / 2).copied() }
    }

    /// The near plane of a camera, world units, to two digits, so that poses that differ by rounding have the
    /// same. That of 3D Gaussian splatting where the rig is a single camera.
    #[must_use]
    pub fn at(&self, camera: &Camera) -> f32 {
        let Some(share) = self.share else { return DEFAULT_NEAR };
        let near = share * Vec3::from(camera.center_in_world()).distance(self.center);
        let unit = 10.0_f32.powf(near.max(f32::MIN_POSITIVE).log10().floor() - 1.0);
        let rounded = (near / unit).round() * unit;
        if rounded.is_normal() { rounded } else { DEFAULT_NEAR }
    }
}

fn random_point(cube: &SceneBox, rng: &mut lgs_core::Stream) -> [f32; 3] {
    cube.center.map(|c| c + rng.random_range(-1.0f32..1.0) * cube.half_side)
}

/// Centre, viewing axis and the larger half tangent of the field of view.
fn view_of(camera: &Camera) -> (Vec3, Vec3, f32) {
    let axis = camera.camera_from_world.row(2).truncate();
    let half_tan = (0.5 * camera.width as f32 / camera.fx).max(0.5 * camera.height as f32 / camera.fy);
    (Vec3::from(camera.center_in_world()), axis.normalize_or(Vec3::Z), half_tan)
}

/// The point nearest to viewing axes, each given with its camera's centre; half tangents play no part.
pub(super) fn point_nearest_to_axes(views: &[(Vec3, Vec3, f32)]) -> Vec3 {
    let count = views.len() as f32;
    let mean_eye = views.iter().map(|v| v.0).sum::<Vec3>() / count;
    let spread = views.iter().map(|v| v.0.distance(mean_eye)).fold(0.0, f32::max).max(1.0);
    let ahead = mean_eye + views.iter().map(|v| v.1).sum::<Vec3>() / count * spread;
    let (mut matrix, mut target) = (Mat3::from_diagonal(Vec3::splat(CENTER_PULL)), CENTER_PULL * ahead);
    for &(eye, axis, _) in views {
        let across = Mat3::IDENTITY - Mat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        matrix += across * (1.0 / count);
        target += across * eye / count;
    }
    matrix.inverse() * target
}

/// The earliest frame of every camera whose first time is the split's first time.
fn earliest_frames(frames: &[Frame]) -> Vec<&Frame> {
    let first = frames.iter().map(|f| f.time).fold(f32::INFINITY, f32::min);
    frames.iter().filter(|f| f.time <= first).collect()
}

/// The mean colour of a point in the views that it lies in; nothing if one of them shows background there or
/// none sees it. Masked pixels say nothing.
fn seen_color(views: &[(&Frame, Arc<Picture>)], point: [f32; 3], background: [f32; 3]) -> Option<[f32; 3]> {
    let (mut sum, mut seen) = ([0.0; 3], 0);
    for (frame, picture) in views {
        match shown_at(frame, picture, point, background) {
            None => {}
            Some(Shown::Background) => return None,
            Some(Shown::Something(color)) => {
                seen += 1;
                (0..3).for_each(|c| sum[c] += color[c]);
            }
        }
    }
    (seen > 0).then(|| sum.map(|v| v / seen as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near_of(cameras: impl Iterator<Item = (Vec3, Vec3)>) -> Vec<f32> {
        let camera = |(eye, target): (Vec3, Vec3)| Camera::look_at(eye.into(), target.into(), 0.8, 160, 120);
        let rig: Vec<Camera> = cameras.map(camera).collect();
        rig.iter().map(|camera| NearPlanes::of(&rig).at(camera)).collect()
    }

    #[test]
    fn near_planes_follow_the_rig_in_every_unit() {
        for unit in [0.01, 1.0, 100.0] {
            let on_ring = |i: usize| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.3) * 4.0 * unit;
            let closer = |i: usize| if i == 3 { 0.4 * on_ring(i) } else { on_ring(i) };
            let around = near_of((0..6).map(|i| (closer(i), Vec3::ZERO)));
            for (i, near) in around.into_iter().enumerate() {
                assert!((near - 0.2 * closer(i).length()).abs() < 0.02 * unit, "{i}: {near}");
            }
            // Side by side, and turned to a point far behind whatever they show.
            let row = |i: usize| Vec3::new(0.1 * i as f32 * unit, 0.0, 0.0);
            let aside = near_of((0..9).map(|i| (row(i), Vec3::new(0.4, 20.0, 0.0) * unit)));
            assert!(aside.iter().all(|&near| near < 0.15 * unit), "{aside:?}");
        }
        assert_eq!(near_of(std::iter::once((Vec3::X, Vec3::ZERO))), [DEFAULT_NEAR]);
    }
}
