//! Which objects the images show to move.
//!
//! Where images say nothing, a source model's motion is arbitrary: a plain wall slides along itself. An
//! object whose Gaussians could as well rest where they are at t = 0 belongs to the static Gaussians (method
//! §5.1).

use lgs_core::GaussianCloud;
use lgs_data::dataset::Frame;
use lgs_distill::Partition;
use lgs_model::source::SourceModel;
use lgs_render::{Splats, mse, rasterize};
use rayon::prelude::*;

use super::spread::spread_over_time;
use super::thresholds::{OBSERVED_FRACTION, OBSERVED_FRAMES};

/// The training frames that tell what is seen to move.
#[derive(Clone, Copy)]
pub(super) struct TrainingFrames<'a> {
    pub(super) frames: &'a [Frame],
    /// Colour behind the Gaussians.
    pub(super) background: [f32; 3],
}

/// For every object of a partition of the source's Gaussians, whether its rest would show in the training
/// frames: would raise their error by the fraction `tolerance` (0: everything counts as seen to move).
pub(super) fn observed_to_move(
    source: &dyn SourceModel,
    partition: &Partition,
    training: TrainingFrames<'_>,
    tolerance: f32,
) -> Vec<bool> {
    let tolerance = f64::from(tolerance);
    let frames = spread_over_time(training.frames, OBSERVED_FRAMES, [1, 2]);
    if tolerance <= 0.0 || frames.is_empty() {
        return vec![true; partition.objects];
    }
    let start = source.cloud_at(0.0);
    let members: Vec<Vec<usize>> = (0..partition.objects).map(|object| partition.members(object)).collect();
    let errors: Vec<Vec<f64>> =
        frames.par_iter().map(|frame| errors(source, &start, &members, frame, training.background)).collect();
    let total = |column: usize| errors.iter().map(|row| row[column]).sum::<f64>();
    let moving = total(0);
    let rises: Vec<f64> =
        (1..=partition.objects).map(|column| total(column) / moving.max(f64::MIN_POSITIVE) - 1.0).collect();
    for (object, rise) in rises.iter().enumerate() {
        tracing::debug!(
            object,
            gaussians = members[object].len(),
            rise,
            "error of the images if it were at rest"
        );
    }
    // Of a poor source little shows; then what shows most moves all the same.
    let most = rises.iter().copied().fold(0.0, f64::max);
    rises.iter().map(|&rise| rise >= tolerance.min(OBSERVED_FRACTION * most)).collect()
}

/// Mean squared errors of a frame: of the source, and with each object at rest.
fn errors(
    source: &dyn SourceModel,
    start: &GaussianCloud,
    members: &[Vec<usize>],
    frame: &Frame,
    background: [f32; 3],
) -> Vec<f64> {
    let mut image = frame.composited(background);
    frame.leave_out(&mut image.pixels, background);
    let error = |cloud: &GaussianCloud| {
        let drawn = rasterize(&Splats::from(cloud), &frame.camera, background);
        let mut own = drawn.to_image();
        frame.exposure.expose(&mut own.pixels, &drawn.transmittance, background);
        frame.leave_out(&mut own.pixels, background);
        mse(&own, &image)
    };
    let cloud = source.cloud_at(frame.time);
    let resting = members.iter().map(|members| {
        let mut resting = cloud.clone();
        for &i in members {
            resting.means[i] = start.means[i];
            resting.rotations[i] = start.rotations[i];
            resting.log_scales[i] = start.log_scales[i];
        }
        error(&resting)
    });
    std::iter::once(error(&cloud)).chain(resting).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure};
    use lgs_distill::PartitionConfig;
    use lgs_model::source::ImportedFrames;

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
        let partition = Partition { object: vec![0, 1], objects: 2 };
        let training = TrainingFrames { frames: &frames, background: [1.0; 3] };
        let tolerance = PartitionConfig::default().unseen_motion;
        assert_eq!(observed_to_move(&source, &partition, training, tolerance), [true, false]);
        let alone = Partition { object: vec![-1, 0], objects: 1 };
        assert_eq!(observed_to_move(&source, &alone, training, tolerance), [true], "nothing shows more");
        assert_eq!(observed_to_move(&source, &partition, training, 0.0), [true, true], "everything counts");
    }
}
