//! The frames that the static warm-up sees where it is to show the scene's start alone.

use std::collections::BTreeSet;

use glam::DVec3;
use lgs_data::dataset::Frame;

use crate::thresholds::FIRST_SPREAD;

/// The earliest time by which as many viewpoints have been seen, and from places spread out at least half as
/// far as all are: those of a camera that moves smoothly are close to each other at first, and show the scene
/// from one side. The last time if there are fewer viewpoints.
pub(super) fn end_of_first_window(frames: &[Frame], least_cameras: usize) -> f32 {
    let mut order: Vec<&Frame> = frames.iter().collect();
    order.sort_by(|a, b| a.time.total_cmp(&b.time));
    let mut all = Viewpoints::default();
    order.iter().for_each(|frame| all.add(frame));
    let least_spread = FIRST_SPREAD * all.spread();
    let mut seen = Viewpoints::default();
    let found = order.iter().find(|frame| {
        seen.add(frame);
        seen.cameras.len() >= least_cameras && seen.spread() >= least_spread
    });
    found.or(order.last()).map_or(0.0, |frame| frame.time)
}

/// Cameras that have been seen, and the moments of their places, world units.
#[derive(Default)]
struct Viewpoints {
    cameras: BTreeSet<usize>,
    sum: DVec3,
    squares: f64,
}

impl Viewpoints {
    fn add(&mut self, frame: &Frame) {
        if self.cameras.insert(frame.camera_id) {
            let center = glam::Vec3::from(frame.camera.center_in_world()).as_dvec3();
            self.sum += center;
            self.squares += center.length_squared();
        }
    }

    /// Root mean square distance of the places from their mean, world units.
    fn spread(&self) -> f64 {
        let count = self.cameras.len().max(1) as f64;
        (self.squares / count - (self.sum / count).length_squared()).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::order::FrameOrder;
    use crate::source::{SourceConfig, WarmupFrames};
    use lgs_core::{Camera, Exposure};

    /// A frame of each of some directions, degrees about the vertical, one after the other in time.
    fn frames(degrees: impl IntoIterator<Item = f32>) -> Vec<Frame> {
        let frame = |(camera_id, degrees): (usize, f32)| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let camera = Camera::look_at([4.0 * cos, 4.0 * sin, 1.0], [0.0; 3], 0.7, 1, 1);
            let (name, time, exposure) = (String::new(), 0.01 * camera_id as f32, Exposure::IDENTITY);
            Frame { name, camera_id, camera, time, exposure, pixels: vec![0; 4].into() }
        };
        degrees.into_iter().enumerate().map(frame).collect()
    }

    #[test]
    fn a_camera_that_jumps_has_shown_the_start_after_the_viewpoints_asked_for() {
        let jumping = frames((0..60).map(|i| 137.5 * i as f32));
        assert_eq!(end_of_first_window(&jumping, 10), jumping[9].time);
        assert_eq!(end_of_first_window(&jumping[..5], 10), jumping[4].time, "too few");
        assert_eq!(end_of_first_window(&[], 10), 0.0);
    }

    #[test]
    fn a_camera_that_moves_smoothly_shows_the_start_for_longer() {
        let circling = frames((0..60).map(|i| 3.0 * i as f32));
        let end = end_of_first_window(&circling, 10);
        assert!(end > circling[20].time && end < circling[45].time, "{end}");
    }

    #[test]
    fn cameras_that_stand_show_it_at_the_first_time() {
        let mut standing = frames((0..24).map(|i| 30.0 * i as f32));
        for (i, frame) in standing.iter_mut().enumerate() {
            (frame.camera_id, frame.time) = (i % 12, (i / 12) as f32);
        }
        assert_eq!(end_of_first_window(&standing, 4), 0.0);
    }

    #[test]
    fn a_warm_up_of_all_times_ends_with_the_first_frames() {
        let jumping = frames((0..60).map(|i| 137.5 * i as f32));
        let config = SourceConfig {
            warmup_iterations: 300,
            warmup_frames: WarmupFrames::AllThenFirst,
            warmup_cameras: 10,
            window_steps: 1,
            ..SourceConfig::standard()
        };
        let mut order = FrameOrder::new(&jumping, &config, 0);
        let mut latest =
            |steps: std::ops::Range<usize>| steps.map(|step| order.next((step, step), &config)).max();
        let found = [1..150, 150..300, 300..400].map(&mut latest);
        assert_eq!(found, [Some(59), Some(9), Some(59)]);
    }
}
