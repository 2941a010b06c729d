//! Frames spread evenly over time.

use lgs_data::dataset::Frame;

/// At most `count` frames, spread evenly over all frames in order of time: of `count` equal parts of these,
/// the frame at a phase in each, given as a numerator and a denominator.
pub(super) fn spread_over_time(frames: &[Frame], count: usize, phase: [usize; 2]) -> Vec<&Frame> {
    let mut ordered: Vec<&Frame> = frames.iter().collect();
    ordered.sort_by(|a, b| a.time.total_cmp(&b.time));
    let (count, [part, of]) = (count.min(ordered.len()), phase);
    (0..count).map(|k| ordered[(of * k + part) * ordered.len() / (of * count)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure};

    #[test]
    fn frames_are_spread_over_time_and_differ_by_phase() {
        let camera = Camera::look_at([0.0, -1.0, 0.0], [0.0; 3], 0.5, 1, 1);
        let frame = |i: usize| Frame {
            name: String::new(),
            camera_id: 0,
            camera,
            time: ((7 * i) % 12) as f32,
            exposure: Exposure::IDENTITY,
            pixels: vec![0; 4].into(),
        };
        let frames: Vec<Frame> = (0..12).map(frame).collect();
        let times = |count, phase| -> Vec<f32> {
            spread_over_time(&frames, count, phase).iter().map(|f| f.time).collect()
        };
        assert_eq!(times(3, [0, 3]), [0.0, 4.0, 8.0]);
        assert_eq!(times(3, [1, 3]), [1.0, 5.0, 9.0]);
        assert_eq!(times(3, [1, 2]), [2.0, 6.0, 10.0]);
        assert_eq!(times(12, [2, 3]), times(12, [0, 1]));
        assert_eq!(times(50, [1, 3]), times(12, [0, 1]), "all of them, once");
    }
}
