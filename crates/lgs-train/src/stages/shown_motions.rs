//! The rigid motions of a source's objects as images show them: near a joint, the tracks of a source blend
//! the motions of two bodies.

use std::collections::BTreeMap;

use lgs_data::dataset::Frame;

use super::counterfactual::RigidMotion;
use super::image_poses::ImagePoses;
use super::pose_search::displacements;
use super::recorded_bodies::{bodies_of, with_recorded_bodies};
use super::rest_retuned::Objects;
use super::scene_request::InitialSceneRequest;

/// The motions of a source's objects since t = 0 at some times, by index of the object, as far as these are
/// rigid bodies: the images of these times tell how each is displaced from the nearest rigid motion to its
/// tracks.
pub(super) fn shown_motions(
    objects: &Objects<'_>,
    request: &InitialSceneRequest<'_>,
    times: &[f32],
) -> BTreeMap<usize, Vec<RigidMotion>> {
    let Ok(scene) = objects.playing(&vec![true; objects.len()], request) else { return BTreeMap::new() };
    let mut sampled: Vec<f32> = std::iter::once(0.0).chain(times.iter().map(|time| time.max(0.0))).collect();
    sampled.sort_by(f32::total_cmp);
    sampled.dedup();
    let is_sampled = |frame: &&Frame| sampled.contains(&frame.time.max(0.0));
    let frames: Vec<&Frame> = request.frames.iter().filter(is_sampled).collect();
    let bodies = bodies_of(&scene, &sampled);
    let recorded = with_recorded_bodies(&scene, &bodies, &sampled);
    let poses = ImagePoses::new(&recorded, &sampled);
    let parts: Vec<_> = bodies.iter().flat_map(|(_, parts)| parts.iter().cloned()).collect();
    let found = displacements(&poses, &parts, &frames);
    let of_object = |((index, _), (part, found)): (&(usize, _), (_, &Vec<_>))| {
        let body = poses.of_body(part, found);
        let start = body.poses[0];
        let at = |time: &f32| sampled.partition_point(|&sampled| sampled < time.max(0.0));
        let motions = times.iter().map(|time| RigidMotion::between_poses(&start, &body.poses[at(time)]));
        (!body.deforms).then(|| (*index, motions.collect()))
    };
    bodies.iter().zip(parts.iter().zip(&found)).filter_map(of_object).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;
    use lgs_core::geometry::wide;
    use lgs_core::{Camera, Exposure, GaussianCloud};
    use lgs_data::frames::FrameSequence;
    use lgs_distill::{DistillConfig, Partition, PartitionConfig, Trajectories};
    use lgs_model::source::{ImportedFrames, SourceModel};
    use lgs_render::{Splats, rasterize};

    use crate::stages::motion_options::MotionOptions;

    /// A block that slides up by a distance in a unit of time.
    fn block(up: f32) -> ImportedFrames {
        let place = |i: usize| [i % 4, i / 4 % 4, i / 16].map(|k| 0.15 * k as f32 - 0.2);
        let means: Vec<[f32; 3]> = (0..64).map(place).collect();
        let gaussians = GaussianCloud::isotropic(means.clone(), 0.08, [0.1, 0.5, 0.2], 0.9);
        let slid = |t: f32| means.iter().map(|&[x, y, z]| [x, y, z + t * up]).collect();
        ImportedFrames::new(FrameSequence {
            times: vec![0.0, 0.5, 1.0],
            positions: [0.0, 0.5, 1.0].map(slid).to_vec(),
            rotations: vec![gaussians.rotations.clone()],
            gaussians,
        })
    }

    #[test]
    fn images_tell_how_far_a_body_is_from_its_tracks() {
        let (source, truth, times) = (block(0.4), block(0.5), [0.5, 1.0]);
        let eyes = [[0.0, -3.0, 0.2], [2.6, 1.5, 0.2], [-2.6, 1.5, 0.2]];
        let frame = |time: f32, camera_id: usize| {
            let camera = Camera::look_at(eyes[camera_id], [0.0, 0.0, 0.2], 0.7, 64, 64);
            let drawn = rasterize(&Splats::from(&truth.cloud_at(time)), &camera, [1.0; 3]).image;
            let bytes = |p: &[f32; 3]| [p[0], p[1], p[2], 1.0].map(|v| (255.0 * v).round() as u8);
            let pixels = drawn.iter().flat_map(bytes).collect::<Vec<u8>>().into();
            Frame { name: String::new(), camera_id, camera, time, exposure: Exposure::IDENTITY, pixels }
        };
        let of_time = |time: f32| [0, 1, 2].map(|camera| frame(time, camera));
        let frames: Vec<Frame> = [0.0, 0.5, 1.0].into_iter().flat_map(of_time).collect();
        let request = InitialSceneRequest {
            partition: &PartitionConfig::default(),
            distill: &DistillConfig::default(),
            motion: &MotionOptions::default(),
            time_window: 1.0,
            pixel_size: 0.03,
            background: [1.0; 3],
            frames: &frames,
            viewing_distance: 3.0,
            seed: 1,
            device: &Device::flex(),
        };
        let sampled = vec![0.0, 0.5, 1.0];
        let positions = sampled.iter().map(|&time| source.positions_at(time)).collect();
        let trajectories = Trajectories::unweighted(sampled, positions);
        let partition = Partition { object: vec![0; 64], objects: 1 };
        let motions = shown_motions(&Objects::new(&source, &trajectories, &partition), &request, &times);
        for (time, motion) in times.iter().zip(&motions[&0]) {
            let place = motion.applied_to(wide([0.1, 0.0, 0.2]));
            let expected = wide([0.1, 0.0, 0.2 + 0.5 * time]);
            assert!(place.distance(expected) < 0.005, "{place} at {time}");
        }
    }
}
