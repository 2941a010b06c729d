//! Trajectories from elsewhere as a source model: frames of the same Gaussians, and what is between them.
//!
//! Between two frames a centre follows the cubic Hermite curve whose slopes at the frames are those of the
//! parabola through the frame and its two neighbours (at the first and last frame, through the three
//! nearest): constant acceleration is reproduced exactly, whatever the spacing. Rotations turn at constant
//! rate along the shorter arc. Before the first and after the last frame the Gaussians rest where they are
//! there; [`SourceModel::time_range`] says so.

use std::path::Path;

use lgs_core::GaussianCloud;
use lgs_core::linear::quat_normalize;
use lgs_data::frames::FrameSequence;

use super::error::SourceError;
use super::kind::SourceKind;
use super::model::SourceModel;
use super::registry::{Imports, Kind};
use crate::scene::{insert_cloud, read_cloud};
use crate::tensor_file::TensorFile;

/// Cosine of half an angle from which two rotations count as equal: the arc between them has no direction in
/// single precision.
const SAME_ROTATION: f32 = 0.999_999;

pub(super) const KIND: Kind = Kind {
    name: "frames",
    format: "lagrangegs-frames/1",
    read: |file, path| Ok(Box::new(ImportedFrames::from_tensors(file, path)?)),
    imports: Imports::Possible,
    training: None,
};

/// Gaussians at several times.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedFrames {
    frames: FrameSequence,
}

impl ImportedFrames {
    /// A source model of frames, as [`lgs_data::frames::read_frames`] returns them.
    #[must_use]
    pub fn new(frames: FrameSequence) -> Self {
        Self { frames }
    }

    /// Reads what [`SourceModel::save`] wrote to `path`.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape, or the times are not ascending.
    pub fn from_tensors(file: &TensorFile, path: &Path) -> Result<Self, SourceError> {
        let gaussians = read_cloud(file, "gaussians")?;
        gaussians.validate().map_err(|source| SourceError::Cloud { path: path.to_owned(), source })?;
        let n = gaussians.len();
        let times = file.values("times")?.1.to_vec();
        if times.len() < 2 || times.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(file.field("times", "at least two ascending numbers", format!("{times:?}")).into());
        }
        let rows = |name: &str, counts: &[usize], width: usize| {
            let (shape, values) = file.values(name)?;
            let fits = counts.iter().any(|&count| shape == [count, n, width]);
            let expected = || format!("shape [{counts:?}, {n}, {width}]");
            if fits { Ok(values) } else { Err(file.field(name, &expected(), format!("{shape:?}"))) }
        };
        let positions = rows("positions", &[times.len()], 3)?.as_chunks::<3>().0;
        let rotations = rows("rotations", &[1, times.len()], 4)?.as_chunks::<4>().0;
        let frames = FrameSequence {
            positions: positions.chunks(n.max(1)).map(<[_]>::to_vec).collect(),
            rotations: rotations.chunks(n.max(1)).map(<[_]>::to_vec).collect(),
            gaussians,
            times,
        };
        Ok(Self { frames })
    }

    /// The frame at or before a time that has a successor, and how far the time is towards it, in [0, 1].
    fn segment(&self, time: f32) -> (usize, f64) {
        let times = &self.frames.times;
        let segment = times.partition_point(|&t| t <= time).saturating_sub(1).min(times.len() - 2);
        let (from, to) = (f64::from(times[segment]), f64::from(times[segment + 1]));
        (segment, ((f64::from(time) - from) / (to - from)).clamp(0.0, 1.0))
    }

    fn rotations_at(&self, time: f32) -> Vec<[f32; 4]> {
        let (segment, along) = self.segment(time);
        match self.frames.rotations.get(segment..segment + 2) {
            Some([a, b]) => a
                .iter()
                .zip(b)
                .map(|(a, b)| slerp(quat_normalize(*a), quat_normalize(*b), along as f32))
                .collect(),
            _ => self.frames.rotations[0].iter().map(|q| quat_normalize(*q)).collect(),
        }
    }
}

impl SourceModel for ImportedFrames {
    fn kind(&self) -> SourceKind {
        SourceKind::Frames
    }

    fn len(&self) -> usize {
        self.frames.gaussians.len()
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        GaussianCloud {
            means: self.positions_at(time),
            rotations: self.rotations_at(time),
            ..self.frames.gaussians.clone()
        }
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        let (segment, along) = self.segment(time);
        let shares = frame_shares(&self.frames.times, segment, along);
        let rows: Vec<(&Vec<[f32; 3]>, f64)> =
            shares.iter().map(|&(frame, share)| (&self.frames.positions[frame], share)).collect();
        let at = |i: usize| {
            std::array::from_fn(|c| {
                rows.iter().map(|(row, share)| share * f64::from(row[i][c])).sum::<f64>() as f32
            })
        };
        (0..self.len()).map(at).collect()
    }

    fn time_range(&self) -> Option<[f32; 2]> {
        Some([*self.frames.times.first()?, *self.frames.times.last()?])
    }

    fn known_times(&self) -> Option<&[f32]> {
        Some(&self.frames.times)
    }

    fn before(&self, time: f32) -> Option<Box<dyn SourceModel>> {
        let mut frames = self.frames.clone();
        let kept = frames.times.partition_point(|&t| t < time);
        frames.times.truncate(kept);
        frames.positions.truncate(kept);
        if frames.rotations.len() > 1 {
            frames.rotations.truncate(kept.max(1));
        }
        Some(Box::new(Self { frames }))
    }

    fn to_tensors(&self) -> TensorFile {
        let FrameSequence { gaussians, times, positions, rotations } = &self.frames;
        let n = gaussians.len();
        let mut file = TensorFile::new(self.kind().format());
        insert_cloud(&mut file, "gaussians", gaussians);
        file.insert("times", &[times.len()], times);
        file.insert("positions", &[positions.len(), n, 3], positions.concat().as_flattened());
        file.insert("rotations", &[rotations.len(), n, 4], rotations.concat().as_flattened());
        file
    }
}

/// The frames around a point of a segment and their shares in it; the shares sum to one.
fn frame_shares(times: &[f32], segment: usize, along: f64) -> Vec<(usize, f64)> {
    let u = along;
    let length = f64::from(times[segment + 1]) - f64::from(times[segment]);
    let first = segment.saturating_sub(1);
    let mut shares: Vec<(usize, f64)> =
        (first..times.len().min(segment + 3)).map(|frame| (frame, 0.0)).collect();
    let mut add = |frame: usize, share: f64| shares[frame - first].1 += share;
    add(segment, (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u));
    add(segment + 1, u * u * (3.0 - 2.0 * u));
    for (frame, basis) in [(segment, u * (1.0 - u) * (1.0 - u)), (segment + 1, u * u * (u - 1.0))] {
        for (neighbour, share) in slope_shares(times, frame) {
            add(neighbour, basis * length * share);
        }
    }
    shares
}

/// The frames that the slope at a frame comes from, and their shares in it: the derivative there of the
/// parabola through the three frames nearest in order, or of the line through two.
fn slope_shares(times: &[f32], frame: usize) -> Vec<(usize, f64)> {
    let count = times.len().min(3);
    let start = frame.saturating_sub(1).min(times.len() - count);
    let t = |i: usize| f64::from(times[start + i]);
    let at = f64::from(times[frame]);
    let share = |i: usize| {
        let others: Vec<usize> = (0..count).filter(|&j| j != i).collect();
        let scale: f64 = others.iter().map(|&j| t(i) - t(j)).product();
        // The derivative of a product of one or two factors.
        let slope: f64 = if count == 2 { 1.0 } else { others.iter().map(|&j| at - t(j)).sum() };
        (start + i, slope / scale)
    };
    (0..count).map(share).collect()
}

/// From one unit quaternion to another at constant rate, along the shorter arc.
fn slerp(a: [f32; 4], b: [f32; 4], along: f32) -> [f32; 4] {
    let cos: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let (b, cos) = if cos < 0.0 { (b.map(|v| -v), -cos) } else { (b, cos) };
    let (share_a, share_b) = if cos > SAME_ROTATION {
        (1.0 - along, along)
    } else {
        let angle = cos.acos();
        (((1.0 - along) * angle).sin() / angle.sin(), (along * angle).sin() / angle.sin())
    };
    quat_normalize(std::array::from_fn(|i| share_a * a[i] + share_b * b[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::load_source;

    /// One Gaussian in free fall that turns about z by an angle of 3 t, at uneven times.
    fn falling(times: &[f32]) -> ImportedFrames {
        let positions: Vec<Vec<[f32; 3]>> =
            times.iter().map(|&t| vec![[1.0 + 2.0 * t, 0.0, 3.0 - 4.9 * t * t]]).collect();
        let rotations = times
            .iter()
            .map(|&t| vec![[(1.5 * t).cos(), 0.0, 0.0, (1.5 * t).sin()].map(|v| 2.0 * v)])
            .collect();
        let gaussians = GaussianCloud::isotropic(positions[0].clone(), 0.1, [0.5; 3], 0.9);
        ImportedFrames::new(FrameSequence { gaussians, times: times.to_vec(), positions, rotations })
    }

    #[test]
    fn constant_acceleration_and_constant_turning_are_exact_between_uneven_frames() {
        let model = falling(&[0.0, 0.1, 0.15, 0.4, 0.75]);
        for i in 0..=75 {
            let t = 0.01 * i as f32;
            let cloud = model.cloud_at(t);
            let expected = [1.0 + 2.0 * t, 0.0, 3.0 - 4.9 * t * t];
            assert!(
                (0..3).all(|c| (cloud.means[0][c] - expected[c]).abs() < 2e-6),
                "t = {t}: {:?}, expected {expected:?}",
                cloud.means[0]
            );
            let turned = [(1.5 * t).cos(), 0.0, 0.0, (1.5 * t).sin()];
            assert!(
                (0..4).all(|c| (cloud.rotations[0][c] - turned[c]).abs() < 2e-6),
                "t = {t}: {:?}",
                cloud.rotations[0]
            );
        }
    }

    #[test]
    fn frames_are_met_and_held_outside_of_their_range() {
        let model = falling(&[-0.1, 0.2, 0.3]);
        assert_eq!(model.time_range(), Some([-0.1, 0.3]));
        for (t, frame) in [(0.2, 1), (0.3, 2), (5.0, 2), (-0.1, 0), (-3.0, 0)] {
            let (found, expected) = (model.positions_at(t)[0], model.frames.positions[frame][0]);
            assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 1e-6), "t = {t}");
        }
        let two = falling(&[0.0, 1.0]);
        assert!((two.positions_at(0.5)[0][2] - (3.0 - 2.45)).abs() < 1e-6, "two frames make a line");
    }

    #[test]
    fn the_shorter_arc_is_taken_and_equal_rotations_stay() {
        let a = quat_normalize([1.0, 0.2, 0.0, 0.0]);
        let near = slerp(a, a.map(|v| -v), 0.5);
        assert!((0..4).all(|c| (near[c] - a[c]).abs() < 1e-6), "{near:?}");
    }

    #[test]
    fn files_round_trip_and_defects_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("frames.safetensors");
        let model = falling(&[0.0, 0.1, 0.3]);
        model.save(&path).expect("save");
        let back = load_source(&path).expect("load");
        assert_eq!((back.kind(), back.len(), back.time_range()), (SourceKind::Frames, 1, Some([0.0, 0.3])));
        assert_eq!(back.cloud_at(0.17), model.cloud_at(0.17));
        let mut file = model.to_tensors();
        file.insert("positions", &[2, 1, 3], &[0.0; 6]);
        file.save(&path).expect("save");
        let text = load_source(&path).err().expect("shape").to_string();
        assert!(text.contains("frames.safetensors") && text.contains("`positions`"), "{text}");
    }
}
