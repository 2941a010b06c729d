//! Which objects the images show to move.
//!
//! Where images say nothing, a source model's motion is arbitrary: a plain wall slides along itself. An
//! object whose Gaussians could as well rest where they are at t = 0 belongs to the static Gaussians (method
//! §5.1).

use lgs_distill::Partition;
use lgs_model::source::SourceModel;

use super::counterfactual::{ComparedFrames, RigidMotion, RigidlyMoved};
use super::thresholds::OBSERVED_FRACTION;

/// For every object of a partition of the source's Gaussians, the fraction by which its rest would raise the
/// error of the frames.
pub(super) fn rises_at_rest(
    source: &dyn SourceModel,
    partition: &Partition,
    frames: &ComparedFrames<'_>,
) -> Vec<f64> {
    let at_rest = |object| {
        let motions = vec![RigidMotion::REST; frames.len()];
        RigidlyMoved { members: partition.members(object), motions }
    };
    let rises = frames.rises(source, &(0..partition.objects).map(at_rest).collect::<Vec<_>>());
    for (object, rise) in rises.iter().enumerate() {
        tracing::debug!(object, rise, "error of the images if it were at rest");
    }
    rises
}

/// For every object, whether images show it to move: whether its rest would raise their error by the fraction
/// `tolerance`.
pub(super) fn observed_to_move(rises: &[f64], tolerance: f64) -> Vec<bool> {
    // Of a poor source little shows; then what shows most moves all the same.
    let most = rises.iter().copied().fold(0.0, f64::max);
    rises.iter().map(|&rise| rise >= tolerance.min(OBSERVED_FRACTION * most)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure, GaussianCloud};
    use lgs_data::dataset::Frame;
    use lgs_distill::PartitionConfig;
    use lgs_model::source::ImportedFrames;
    use lgs_render::{Splats, rasterize};

    /// Two balls that slide as far as each other, of which the second has the colour of the background.
    fn sliding() -> ImportedFrames {
        let gaussians = GaussianCloud {
            means: vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; 2],
            log_scales: vec![[-2.0; 3]; 2],
            raw_opacities: vec![3.0; 2],
            sh: [[-1.7; 3], [1.0 / 0.282_094_8 * 0.5; 3]].concat(),
            sh_degree: 0,
        };
        lgs_model::testing::sliding(gaussians, [0.0, 0.0, 0.6])
    }

    #[test]
    fn what_no_image_shows_to_move_rests() {
        let source = sliding();
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, 48, 48);
        let frame = |&time: &f32| {
            let drawn = rasterize(&Splats::from(&source.cloud_at(time)), &camera, [1.0; 3]).to_image();
            // Not quite what the source draws.
            let pixel = |(i, p): (usize, &[f32; 3])| {
                [p[0] - 0.01 * (i % 7) as f32, p[1], p[2], 1.0].map(|v| (255.0 * v).round() as u8)
            };
            Frame {
                name: String::new(),
                camera_id: 0,
                camera,
                time,
                exposure: Exposure::IDENTITY,
                pixels: drawn.pixels.iter().enumerate().flat_map(pixel).collect::<Vec<u8>>().into(),
            }
        };
        let frames: Vec<Frame> = [0.0, 0.5, 1.0].iter().map(frame).collect();
        let tolerance = f64::from(PartitionConfig::default().unseen_motion);
        let frames = ComparedFrames::new(&frames, [1.0; 3]);
        let observed = |object: Vec<i32>| {
            let objects = object.iter().filter(|&&object| object >= 0).count();
            observed_to_move(&rises_at_rest(&source, &Partition { object, objects }, &frames), tolerance)
        };
        assert_eq!(observed(vec![0, 1]), [true, false]);
        assert_eq!(observed(vec![-1, 0]), [true], "nothing shows more");
    }
}
