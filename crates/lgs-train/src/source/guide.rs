//! A pull of the Gaussians of a tracked thing towards its path, as a cotangent of the deformed positions.
//!
//! The Gaussians whose canonical centres lie in a track's ball at the first time belong to it, each to its
//! nearest. For the Gaussians of a track, `E = weight · |mean(q) − mean(p) − (c(t) − c(0))|²` with canonical
//! p, deformed q and the path c: only their mean is held to the path, so how they turn and what shape they
//! have is left to the images.

use lgs_core::linear::{add, norm, scale, sub};
use lgs_data::dataset::Dataset;

use super::config::GuideConfig;
use crate::tracks::{Track, find_tracks};

/// Radius of the ball around a path's start whose Gaussians follow it, in radii of the track.
const BALL: f32 = 1.1;

/// The paths that motion is guided by.
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
        let tracks = if config.weight > 0.0 && sparse {
            tracing::info_span!("paths of silhouettes")
                .in_scope(|| find_tracks(frames, dataset.background, dataset.scene_box()))
        } else {
            Vec::new()
        };
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

    /// The gradient of the energy by the deformed positions at a time.
    pub(super) fn gradient(
        &self,
        canonical: &[[f32; 3]],
        deformed: &[[f32; 3]],
        time: f32,
        weight: f32,
    ) -> Vec<[f32; 3]> {
        let owners: Vec<Option<usize>> = canonical.iter().map(|&p| self.owner(p)).collect();
        let mut gradient = vec![[0.0; 3]; canonical.len()];
        for (index, track) in self.tracks.iter().enumerate() {
            let members: Vec<usize> = (0..canonical.len()).filter(|&i| owners[i] == Some(index)).collect();
            if members.is_empty() {
                continue;
            }
            let moved = members.iter().fold([0.0; 3], |sum, &i| add(sum, sub(deformed[i], canonical[i])));
            let part = 1.0 / members.len() as f32;
            let off = sub(scale(moved, part), sub(track.position(time), track.position(self.start)));
            members.iter().for_each(|&i| gradient[i] = scale(off, 2.0 * weight * part));
        }
        gradient
    }

    /// The track that a canonical position belongs to.
    fn owner(&self, position: [f32; 3]) -> Option<usize> {
        let distance = |track: &Track| norm(sub(position, track.position(self.start))) / track.radius;
        let near = self.tracks.iter().map(distance).enumerate().filter(|(_, d)| *d < BALL);
        near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracks::Track;

    #[test]
    fn only_the_mean_of_a_tracks_gaussians_is_pulled_and_only_towards_its_path() {
        let moments: Vec<f32> = (0..20).map(|i| 0.05 * i as f32).collect();
        let path: Vec<[f32; 3]> = moments.iter().map(|t| [2.0 * t, 0.0, 0.0]).collect();
        let guide = Guide { tracks: vec![Track::through(&moments, &path, 0.5).expect("a path")], start: 0.0 };
        let canonical = [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [5.0, 0.0, 0.0]];
        let on_path = [[1.1, 0.3, 0.0], [0.9, -0.3, 0.0], [5.0, 0.0, 0.0]];
        let still = guide.gradient(&canonical, &on_path, 0.5, 2.0);
        assert!(still.as_flattened().iter().all(|g| g.abs() < 1e-4), "{still:?}");
        let behind = guide.gradient(&canonical, &canonical, 0.5, 2.0);
        let energy = |x: f32| 2.0 * (x - 1.0).powi(2);
        let slope = (energy(0.01) - energy(-0.01)) / 0.02;
        assert!((behind[0][0] + behind[1][0] - slope).abs() < 1e-2, "{behind:?} {slope}");
        assert_eq!(behind[2], [0.0; 3]);
    }
}
