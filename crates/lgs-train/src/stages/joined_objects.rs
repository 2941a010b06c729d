//! Objects that no image shows to move apart.
//!
//! Tracks of a source slip over plain surfaces: those of a rod turn about it while the bob at its end does
//! not, so the two look like bodies that hang on each other. An object that touches another one and could as
//! well be carried by the rigid motion of that one belongs to it (method §5.1).

use std::collections::BTreeSet;

use lgs_core::k_nearest;
use lgs_distill::Partition;
use lgs_model::source::SourceModel;

use super::counterfactual::{ComparedFrames, RigidMotion, RigidlyMoved};
use super::thresholds::{OBSERVED_FRACTION, TOUCHING_NEIGHBORS};

/// The partition in which objects belong to one that they touch, where its motion in place of their own would
/// raise the error of the frames by less than the fraction `tolerance`, and by far less than their rest
/// does (`rises`).
pub(super) fn joined(
    source: &dyn SourceModel,
    partition: Partition,
    (frames, rises): (&ComparedFrames<'_>, &[f64]),
    tolerance: f64,
) -> Partition {
    let start = source.positions_at(0.0);
    let pairs = touching(&start, &partition);
    if pairs.is_empty() {
        return partition;
    }
    let now: Vec<Vec<[f32; 3]>> = frames.times().map(|time| source.positions_at(time)).collect();
    let carried = |&(part, whole): &(usize, usize)| {
        let of_whole = partition.members(whole);
        let chosen = |places: &[[f32; 3]]| -> Vec<[f32; 3]> { of_whole.iter().map(|&i| places[i]).collect() };
        let from = chosen(&start);
        let motions = now.iter().map(|now| RigidMotion::between(&from, &chosen(now))).collect();
        RigidlyMoved { members: partition.members(part), motions }
    };
    let carried: Vec<RigidlyMoved> = pairs.iter().map(carried).collect();
    let allowed = rises.iter().map(|rise| tolerance.min(OBSERVED_FRACTION * rise));
    let mut belongs: Vec<(usize, f64)> = allowed.enumerate().collect();
    for (&(part, whole), rise) in pairs.iter().zip(frames.rises(source, &carried)) {
        tracing::debug!(part, whole, rise, "error of the images if an object were carried by another one");
        if rise < belongs[part].1 {
            belongs[part] = (whole, rise);
        }
    }
    partition.joined(&belongs.into_iter().map(|(whole, _)| whole).collect::<Vec<usize>>())
}

/// Pairs of a smaller object and a larger one that touch at t = 0: one has a Gaussian among the nearest ones
/// of a Gaussian of the other.
fn touching(start: &[[f32; 3]], partition: &Partition) -> BTreeSet<(usize, usize)> {
    let moving: Vec<usize> = (0..start.len()).filter(|&i| partition.object[i] >= 0).collect();
    let (near, row) = k_nearest(&moving.iter().map(|&i| start[i]).collect::<Vec<_>>(), TOUCHING_NEIGHBORS);
    let object = |at: usize| partition.object[moving[at]] as usize;
    let pair = |(at, &other): (usize, &u32)| {
        let (a, b) = (object(at / row), object(other as usize));
        (a != b).then_some((a.max(b), a.min(b)))
    };
    near.iter().enumerate().filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::observed_motion::rises_at_rest;
    use lgs_core::linear::add;
    use lgs_core::{Camera, Exposure, GaussianCloud};
    use lgs_data::dataset::Frame;
    use lgs_data::frames::FrameSequence;
    use lgs_model::source::ImportedFrames;
    use lgs_render::{Splats, rasterize};

    /// A bar of four Gaussians, of which the last two slide by `apart` more than the others.
    fn bar(apart: f32) -> ImportedFrames {
        let means: Vec<[f32; 3]> = (0..4).map(|i| [0.2 * i as f32 - 0.3, 0.0, 0.0]).collect();
        let gaussians = GaussianCloud::isotropic(means.clone(), 0.1, [0.1, 0.5, 0.2], 0.9);
        let slid =
            |(i, &mean): (usize, &[f32; 3])| add(mean, [0.0, 0.0, if i < 2 { 0.6 } else { 0.6 + apart }]);
        ImportedFrames::new(FrameSequence {
            times: vec![0.0, 1.0],
            positions: vec![means.clone(), means.iter().enumerate().map(slid).collect()],
            rotations: vec![gaussians.rotations.clone()],
            gaussians,
        })
    }

    /// What becomes of the halves of the bar as the source has it, where images show it to slide as a whole.
    fn found(apart: f32, shown: &ImportedFrames) -> Partition {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, 48, 48);
        let frame = |&time: &f32| {
            let drawn = rasterize(&Splats::from(&shown.cloud_at(time)), &camera, [1.0; 3]).image;
            // Not quite what the source draws.
            let pixel = |(i, p): (usize, &[f32; 3])| {
                [p[0] - 0.03 * (i % 7) as f32, p[1], p[2], 1.0].map(|v| (255.0 * v).round() as u8)
            };
            let pixels = drawn.iter().enumerate().flat_map(pixel).collect::<Vec<u8>>().into();
            Frame { name: String::new(), camera_id: 0, camera, time, exposure: Exposure::IDENTITY, pixels }
        };
        let frames: Vec<Frame> = [0.0, 0.5, 1.0].iter().map(frame).collect();
        let frames = ComparedFrames::new(&frames, [1.0; 3]);
        let (source, partition) = (bar(apart), Partition { object: vec![0, 0, 1, 1], objects: 2 });
        let rises = rises_at_rest(&source, &partition, &frames);
        joined(&source, partition, (&frames, &rises), 0.6)
    }

    #[test]
    fn parts_that_no_image_shows_to_move_apart_are_one_object() {
        assert_eq!(found(0.01, &bar(0.0)).objects, 1);
        let apart = found(0.3, &bar(0.3));
        assert_eq!((apart.objects, apart.object), (2, vec![0, 0, 1, 1]));
    }
}
