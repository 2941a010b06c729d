//! Objects that no image shows to move apart.
//!
//! Tracks of a source slip over plain surfaces: those of a rod turn about it while the bob at its end does
//! not, so the two look like bodies that hang on each other. An object that touches another one and could as
//! well be carried by the rigid motion of that one belongs to it (method §5.1).

use std::collections::{BTreeMap, BTreeSet};

use lgs_core::k_nearest;
use lgs_distill::Partition;
use lgs_model::source::SourceModel;

use super::counterfactual::{ComparedFrames, RigidMotion, RigidlyMoved};
use super::thresholds::{OBSERVED_FRACTION, TOUCHING_NEIGHBORS};

/// Objects' motions since t = 0 at the times of the compared frames, by index of the object.
type Motions = BTreeMap<usize, Vec<RigidMotion>>;

/// The partition in which objects belong to one that they touch, where its motion in place of their own would
/// raise the error of the frames by less than the fraction `tolerance`, and by far less than their rest
/// does (`rises`): the motion of its tracks, or else the one that images show, of the objects of a partition.
pub(super) fn joined(
    source: &dyn SourceModel,
    partition: Partition,
    (frames, rises): (&ComparedFrames<'_>, &[f64]),
    tolerance: f64,
    shown: &dyn Fn(&Partition) -> Motions,
) -> Partition {
    let start = source.positions_at(0.0);
    let mut pairs = touching(&start, &partition);
    if pairs.is_empty() {
        return partition;
    }
    let allowed = rises.iter().map(|rise| tolerance.min(OBSERVED_FRACTION * rise));
    let mut belongs: Vec<(usize, f64)> = allowed.enumerate().collect();
    let mut join = |pairs: &BTreeSet<(usize, usize)>, motions: &Motions| {
        let carried = |&(part, whole): &(usize, usize)| {
            let motions = motions.get(&whole)?.clone();
            Some(((part, whole), RigidlyMoved { members: partition.members(part), motions }))
        };
        let (pairs, carried): (Vec<_>, Vec<_>) = pairs.iter().filter_map(carried).unzip();
        for ((part, whole), rise) in pairs.into_iter().zip(frames.rises(source, &carried)) {
            tracing::debug!(part, whole, rise, "images with an object carried by another one");
            if rise < belongs[part].1 {
                belongs[part] = (whole, rise);
            }
        }
        belongs.iter().map(|(whole, _)| *whole).collect::<Vec<usize>>()
    };
    let mut wholes = join(&pairs, &motions_of_tracks(source, &partition, frames));
    pairs.retain(|&(part, _)| wholes[part] == part);
    if !pairs.is_empty() {
        wholes = join(&pairs, &shown(&partition));
    }
    partition.joined(&wholes)
}

/// The rigid motion of each object by the source's tracks.
fn motions_of_tracks(
    source: &dyn SourceModel,
    partition: &Partition,
    frames: &ComparedFrames<'_>,
) -> Motions {
    let start = source.positions_at(0.0);
    let now: Vec<Vec<[f32; 3]>> = frames.times().map(|time| source.positions_at(time)).collect();
    let of_object = |object: usize| {
        let members = partition.members(object);
        let chosen = |places: &[[f32; 3]]| -> Vec<[f32; 3]> { members.iter().map(|&i| places[i]).collect() };
        let from = chosen(&start);
        (object, now.iter().map(|now| RigidMotion::between(&from, &chosen(now))).collect())
    };
    (0..partition.objects).map(of_object).collect()
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
    use glam::{DMat3, DVec3};
    use lgs_core::linear::add;
    use lgs_core::{Camera, Exposure, GaussianCloud};
    use lgs_data::dataset::Frame;
    use lgs_data::frames::FrameSequence;
    use lgs_model::source::ImportedFrames;
    use lgs_render::{Splats, rasterize};

    /// A bar of four Gaussians, of which the first two slide up by the first of two distances and the last
    /// two by the second.
    fn bar(up: [f32; 2]) -> ImportedFrames {
        let means: Vec<[f32; 3]> = (0..4).map(|i| [0.2 * i as f32 - 0.3, 0.0, 0.0]).collect();
        let gaussians = GaussianCloud::isotropic(means.clone(), 0.1, [0.1, 0.5, 0.2], 0.9);
        let slid = |(i, &mean): (usize, &[f32; 3])| add(mean, [0.0, 0.0, up[i / 2]]);
        ImportedFrames::new(FrameSequence {
            times: vec![0.0, 1.0],
            positions: vec![means.clone(), means.iter().enumerate().map(slid).collect()],
            rotations: vec![gaussians.rotations.clone()],
            gaussians,
        })
    }

    /// What becomes of the halves of the bar as a source has it, where images show another one, and perhaps
    /// that the first half slides up by a distance.
    fn found(source: &ImportedFrames, images: &ImportedFrames, shown: Option<f64>) -> Partition {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, 48, 48);
        let frame = |&time: &f32| {
            let drawn = rasterize(&Splats::from(&images.cloud_at(time)), &camera, [1.0; 3]).image;
            // Not quite what the source draws.
            let pixel = |(i, p): (usize, &[f32; 3])| {
                [p[0] - 0.03 * (i % 7) as f32, p[1], p[2], 1.0].map(|v| (255.0 * v).round() as u8)
            };
            let pixels = drawn.iter().enumerate().flat_map(pixel).collect::<Vec<u8>>().into();
            Frame { name: String::new(), camera_id: 0, camera, time, exposure: Exposure::IDENTITY, pixels }
        };
        let frames: Vec<Frame> = [0.0, 0.5, 1.0].iter().map(frame).collect();
        let frames = ComparedFrames::new(&frames, [1.0; 3]);
        let partition = Partition { object: vec![0, 0, 1, 1], objects: 2 };
        let rises = rises_at_rest(source, &partition, &frames);
        let slid = |up: f64| {
            let pose = |time: f32| (DMat3::IDENTITY, f64::from(time) * up * DVec3::Z);
            let motion = |time| RigidMotion::between_poses(&pose(0.0), &pose(time));
            Motions::from([(0, frames.times().map(motion).collect())])
        };
        let shown = |_: &Partition| shown.map(slid).unwrap_or_default();
        joined(source, partition, (&frames, &rises), 0.6, &shown)
    }

    #[test]
    fn parts_that_no_image_shows_to_move_apart_are_one_object() {
        let as_one = bar([0.6; 2]);
        assert_eq!(found(&bar([0.6, 0.61]), &as_one, None).objects, 1);
        let apart = bar([0.6, 0.9]);
        let halves = found(&apart, &apart, Some(0.6));
        assert_eq!((halves.objects, halves.object), (2, vec![0, 0, 1, 1]));
    }

    #[test]
    fn parts_whose_tracks_alone_move_apart_are_one_object() {
        let (source, images) = (bar([0.4, 0.6]), bar([0.6; 2]));
        assert_eq!(found(&source, &images, None).objects, 2);
        assert_eq!(found(&source, &images, Some(0.6)).objects, 1);
    }
}
