//! The prior that the Gaussians of a tracked thing follow its path, as a gradient by the deformed positions.
//!
//! The Gaussians whose canonical centres lie in a track's ball at the first time belong to it, each to its
//! nearest. For the Gaussians of a track, `E = weight · |mean(q) − mean(p) − (c(t) − c(0))|²` with canonical
//! p, deformed q and the path c: only their mean is bound to the path, so how they turn and what shape they
//! have is left to the images. Where the texture told a spin, with rotations R, each of them is, with
//! `guide.rotations` or if the thing turns round and is carried:
//! `E = weight · mean |q − c(t) − R(t) (p − c(0))|²`.

use burn::tensor::Tensor;
use lgs_core::linear::{Mat3, sub, transpose};
use lgs_data::dataset::Dataset;

use super::config_groups::GuideConfig;
use crate::cloud_tensors::rows;
use crate::thresholds::GUIDED_RADII;
use crate::tracks::{Track, find_tracks};

/// The paths that guide a motion.
pub(super) struct Guide {
    tracks: Vec<Track>,
    start: f32,
}

impl Guide {
    /// The paths of what moves, if the set shows its moments in few enough images for these to be needed.
    pub(super) fn new(dataset: &Dataset, config: &GuideConfig) -> Self {
        let frames = dataset.split("train");
        let mut times: Vec<f32> = frames.iter().map(|f| f.time).collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        let start = times.first().copied().unwrap_or(0.0);
        let sparse = (frames.len() as f32) < config.below_images_per_time * times.len() as f32;
        let mut tracks = if config.weight > 0.0 && sparse {
            tracing::info_span!("paths of silhouettes")
                .in_scope(|| find_tracks(frames, dataset.background, dataset.scene_box()))
        } else {
            Vec::new()
        };
        if !config.rotations {
            tracks.iter_mut().filter(|track| !track.turns_round()).for_each(|track| track.spin = None);
        }
        Self { tracks, start }
    }

    /// The paths.
    pub(super) fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Whether there is nothing to follow.
    pub(super) fn is_empty(&self) -> bool {
        self.tracks.is_empty()
    }

    /// The gradient `[n, 3]` of the energy by the deformed positions at a time.
    pub(super) fn gradient(
        &self,
        canonical: &Tensor<2>,
        deformed: &Tensor<2>,
        time: f32,
        weight: f32,
    ) -> Tensor<2> {
        let distances = self.tracks.iter().map(|track| self.distance(track, canonical)).collect();
        let (nearest, owner) = Tensor::cat(distances, 1).min_dim_with_indices(1);
        let is_owned = nearest.lower_elem(GUIDED_RADII);
        let mut gradient = deformed.zeros_like();
        for (index, track) in self.tracks.iter().enumerate() {
            let belongs = owner.clone().equal_elem(index as i32).bool_and(is_owned.clone()).float();
            let part = belongs.clone().sum_dim(0).clamp_min(1.0).recip();
            let off = match track.rotation(time - self.start) {
                Some(rotation) => deformed.clone() - self.carried(track, &rotation, canonical, time),
                None => {
                    let moved = (deformed.clone() - canonical.clone()) * belongs.clone();
                    let path = sub(track.position(time), track.position(self.start));
                    moved.sum_dim(0) * part.clone() - rows(&[path], &deformed.device())
                }
            };
            gradient = gradient + belongs * (off * part).mul_scalar(2.0 * weight);
        }
        gradient
    }

    /// Canonical positions `[n, 3]` carried along a track, and turned about it, to a time.
    fn carried(&self, track: &Track, rotation: &Mat3, canonical: &Tensor<2>, time: f32) -> Tensor<2> {
        let device = canonical.device();
        let from_center = canonical.clone() - rows(&[track.position(self.start)], &device);
        from_center.matmul(rows(&transpose(rotation), &device)) + rows(&[track.position(time)], &device)
    }

    /// Distances `[n, 1]` of canonical positions from the start of a track, in its radii.
    fn distance(&self, track: &Track, canonical: &Tensor<2>) -> Tensor<2> {
        let start = rows(&[track.position(self.start)], &canonical.device());
        (canonical.clone() - start).square().sum_dim(1).sqrt().div_scalar(track.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud_tensors::host_rows;
    use crate::device::DeviceName;
    use crate::tracks::Track;

    #[test]
    fn only_the_mean_of_a_tracks_gaussians_is_pulled_and_only_towards_its_path() {
        let moments: Vec<f32> = (0..20).map(|i| 0.05 * i as f32).collect();
        let path: Vec<[f32; 3]> = moments.iter().map(|t| [2.0 * t, 0.0, 0.0]).collect();
        let guide = Guide { tracks: vec![Track::through(&moments, &path, 0.5).expect("a path")], start: 0.0 };
        let canonical = [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [5.0, 0.0, 0.0]];
        let on_path = [[1.1, 0.3, 0.0], [0.9, -0.3, 0.0], [5.0, 0.0, 0.0]];
        let device = DeviceName::Cpu.device();
        let gradient = |deformed: &[[f32; 3]]| -> Vec<[f32; 3]> {
            host_rows(&guide.gradient(&rows(&canonical, &device), &rows(deformed, &device), 0.5, 2.0))
        };
        let still = gradient(&on_path);
        assert!(still.as_flattened().iter().all(|g| g.abs() < 1e-4), "{still:?}");
        let behind = gradient(&canonical);
        let energy = |x: f32| 2.0 * (x - 1.0).powi(2);
        let slope = (energy(0.01) - energy(-0.01)) / 0.02;
        assert!((behind[0][0] + behind[1][0] - slope).abs() < 1e-2, "{behind:?} {slope}");
        assert_eq!(behind[2], [0.0; 3]);
    }
    #[test]
    fn the_gaussians_of_a_ball_that_turns_are_drawn_to_where_it_carries_them() {
        let moments: Vec<f32> = (0..20).map(|i| 0.05 * i as f32).collect();
        let path: Vec<[f32; 3]> = moments.iter().map(|t| [2.0 * t, 0.0, 0.0]).collect();
        let mut track = Track::through(&moments, &path, 0.5).expect("a path");
        // A quarter turn about z by the time 0.5.
        track.spin = Some([0.0, 0.0, std::f32::consts::PI]);
        let guide = Guide { tracks: vec![track], start: 0.0 };
        let device = DeviceName::Cpu.device();
        let canonical = rows(&[[0.2, 0.0, 0.1], [0.0, -0.2, 0.0]], &device);
        let gradient = |deformed: [[f32; 3]; 2]| -> Vec<[f32; 3]> {
            host_rows(&guide.gradient(&canonical, &rows(&deformed, &device), 0.5, 2.0))
        };
        let carried = [[1.0, 0.2, 0.1], [1.2, 0.0, 0.0]];
        let still = gradient(carried);
        assert!(still.as_flattened().iter().all(|g| g.abs() < 1e-4), "{still:?}");
        let [mut off, right] = carried;
        off[1] += 0.1;
        let pulled = gradient([off, right]);
        // E = 2 (0.1² + 0) / 2, so dE/dy = 0.2.
        assert!((pulled[0][1] - 0.2).abs() < 1e-3 && pulled[1][0].abs() < 1e-4, "{pulled:?}");
    }
}
