//! Linear motion: every Gaussian moves at a constant velocity that is an affine function of its start.
//!
//! With the position `x̂ = (x − c)/σ` in the input frame, `x(t) = x + t σ (b + A x̂)`, and rotations and
//! scales stay. The twelve parameters are b and the rows of A, all zero before training: a baseline for other
//! kinds, and enough for static scenes. Of the settings it reads `deformation.normalised_positions` alone.

use std::path::Path;

use burn::tensor::Tensor;
use lgs_core::GaussianCloud;
use lgs_core::linear::{add, mat_vec, quat_normalize, scale, sub};

use super::config::ScaleMode;
use super::error::SourceError;
use super::input::InputFrame;
use super::kind::SourceKind;
use super::model::SourceModel;
use super::motion::{Canonical, Captured, Learned, Moment, MotionConfig, SourceMotion};
use super::registry::{Imports, Kind, Training};
use crate::scene::{insert_cloud, read_cloud};
use crate::tensor_file::TensorFile;

pub(super) const KIND: Kind = Kind {
    name: "linear",
    format: "lagrangegs-linear/1",
    read: |file, path| Ok(Box::new(LinearMotion::from_tensors(file, path)?)),
    imports: Imports::Impossible,
    training: Some(Training { validate: |config| config.deformation_only(), motion }),
};

/// Parameters: b, then the rows of A.
const PARAMETERS: usize = 12;

/// Gaussians with constant velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearMotion {
    /// Gaussians at t = 0.
    pub canonical: GaussianCloud,
    /// The map of positions to which b and A refer.
    pub frame: InputFrame,
    /// b, then the rows of A, per unit of time.
    pub velocity: [[f32; 3]; 4],
}

impl LinearMotion {
    fn velocity_at(&self, position: [f32; 3]) -> [f32; 3] {
        let [offset, rows @ ..] = self.velocity;
        let local = scale(sub(position, self.frame.center), 1.0 / self.frame.scale);
        scale(add(offset, mat_vec(&rows, local)), self.frame.scale)
    }

    /// Reads what [`SourceModel::save`] wrote to `path`.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape.
    pub fn from_tensors(file: &TensorFile, path: &Path) -> Result<Self, SourceError> {
        let canonical = read_cloud(file, "canonical")?;
        canonical.validate().map_err(|source| SourceError::Cloud { path: path.to_owned(), source })?;
        let frame: InputFrame = file.metadata_json("frame")?;
        if let Some(found) = frame.defect() {
            return Err(file.field("frame", "a positive scale and a finite centre", found).into());
        }
        let rows = file.rows::<3>("velocity")?;
        let velocity = <[_; 4]>::try_from(rows)
            .map_err(|rows| file.field("velocity", "shape [4, 3]", format!("{} rows", rows.len())))?;
        Ok(Self { canonical, frame, velocity })
    }
}

impl SourceModel for LinearMotion {
    fn kind(&self) -> SourceKind {
        SourceKind::Linear
    }

    fn len(&self) -> usize {
        self.canonical.len()
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        GaussianCloud {
            means: self.positions_at(time),
            rotations: self.canonical.rotations.iter().map(|&q| quat_normalize(q)).collect(),
            ..self.canonical.clone()
        }
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        self.canonical.means.iter().map(|&x| add(x, scale(self.velocity_at(x), time))).collect()
    }

    fn to_tensors(&self) -> TensorFile {
        let mut file = TensorFile::new(self.kind().format());
        insert_cloud(&mut file, "canonical", &self.canonical);
        // A plain structure of numbers always serialises.
        file.set_metadata("frame", serde_json::to_string(&self.frame).unwrap_or_default());
        file.insert("velocity", &[4, 3], self.velocity.as_flattened());
        file
    }
}

fn motion(_config: &MotionConfig<'_>, captured: Captured) -> Box<dyn SourceMotion> {
    Box::new(AffineVelocity { frame: captured.frame })
}

/// Linear motion in training.
struct AffineVelocity {
    frame: InputFrame,
}

impl SourceMotion for AffineVelocity {
    fn init(&self, _seed: u64) -> Vec<f32> {
        vec![0.0; PARAMETERS]
    }

    fn parameters(&self) -> usize {
        PARAMETERS
    }

    fn poses(&self, network: Tensor<1>, canonical: Canonical, at: Moment) -> Tensor<2> {
        let Canonical { means, rotations, .. } = canonical;
        let InputFrame { center, scale } = self.frame;
        let center = Tensor::<2>::from_floats([center], &means.device());
        let local = (means.clone() - center) / scale;
        let offset = network.clone().narrow(0, 0, 3).reshape([1, 3]);
        let rows = network.narrow(0, 3, 9).reshape([3, 3]);
        let moved = means.clone() + (local.matmul(rows.transpose()) + offset) * (scale * at.time);
        Tensor::cat(vec![moved, rotations, means.zeros_like()], 1)
    }

    fn scale_mode(&self) -> ScaleMode {
        ScaleMode::Fixed
    }

    fn model(&self, learned: Learned) -> Box<dyn SourceModel> {
        let mut velocity = [[0.0; 3]; 4];
        velocity.as_flattened_mut().copy_from_slice(&learned.parameters);
        Box::new(LinearMotion { canonical: learned.cloud, frame: self.frame, velocity })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::load_source;
    use burn::tensor::{Device, TensorData};

    fn model() -> LinearMotion {
        let means = vec![[0.5, -1.0, 2.0], [0.1, 0.2, 0.3]];
        LinearMotion {
            canonical: GaussianCloud::isotropic(means, 0.1, [0.5; 3], 0.9),
            frame: InputFrame { center: [0.1, 0.2, 0.3], scale: 2.0 },
            velocity: [[0.3, -0.1, 0.2], [0.0, -1.5, 0.0], [1.5, 0.0, 0.0], [0.0, 0.0, 0.4]],
        }
    }

    #[test]
    fn gaussians_move_at_constant_velocities() {
        let model = model();
        let [start, half, end] = [0.0, 0.5, 1.0].map(|t| model.positions_at(t));
        assert_eq!(start, model.canonical.means);
        for i in 0..model.len() {
            assert!((0..3).all(|c| (2.0 * half[i][c] - start[i][c] - end[i][c]).abs() < 1e-5));
        }
        // At the frame's centre the velocity is σ b.
        assert!((0..3).all(|c| (end[1][c] - start[1][c] - 2.0 * model.velocity[0][c]).abs() < 1e-5));
    }

    #[test]
    fn training_poses_are_those_of_the_model() {
        let (model, device) = (model(), Device::flex());
        let motion = AffineVelocity { frame: model.frame };
        let tensor = |values: &[f32], width: usize| {
            Tensor::<2>::from_data(TensorData::new(values.to_vec(), [values.len() / width, width]), &device)
        };
        let network = tensor(model.velocity.as_flattened(), PARAMETERS).reshape([PARAMETERS]);
        let means = tensor(model.canonical.means.as_flattened(), 3);
        let rotations = tensor(model.canonical.rotations.as_flattened(), 4);
        let at = Moment { time: 0.7, iteration: 0, window_end: 1.0 };
        let canonical = Canonical { means, rotations, features: None };
        let poses = motion.poses(network, canonical, at).into_data().try_to_vec::<f32>().expect("f32");
        for (pose, expected) in poses.chunks(10).zip(model.positions_at(0.7)) {
            assert!((0..3).all(|c| (pose[c] - expected[c]).abs() < 1e-5), "{pose:?} {expected:?}");
        }
    }

    #[test]
    fn files_round_trip_and_defects_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let (model, path) = (model(), folder.path().join("linear.safetensors"));
        model.save(&path).expect("save");
        assert_eq!(load_source(&path).expect("load").cloud_at(0.3), model.cloud_at(0.3));
        let mut file = model.to_tensors();
        file.insert("velocity", &[3, 3], &[0.0; 9]);
        file.save(&path).expect("save");
        let text = load_source(&path).err().expect("shape").to_string();
        assert!(text.contains("linear.safetensors") && text.contains("`velocity`"), "{text}");
    }
}
