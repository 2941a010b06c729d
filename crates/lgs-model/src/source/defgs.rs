//! DefGS: canonical Gaussians and a network that displaces, turns and scales them at a time
//! (method §3.1).
//!
//! Our rasterizer normalises quaternions (the authors' does not), so the Gaussians drawn at time t have the
//! rotations `normalise(q/‖q‖ + Δr)`, and a cloud with these rotations looks the same. A scale that the
//! network pushes to zero or below is replaced by [`DEFORMED_SCALE_FLOOR`].

use std::path::Path;
use std::sync::Arc;

use burn::tensor::Tensor;
use lgs_core::GaussianCloud;
use lgs_core::linear::quat_normalize;
use lgs_nn::NamedLayers;
use serde::{Deserialize, Serialize};

use super::config::{DELTAS, DeformationConfig, ScaleMode};
use super::error::SourceError;
use super::input::InputFrame;
use super::kind::SourceKind;
use super::model::SourceModel;
use super::motion::{Canonical, Captured, Learned, Moment, MotionConfig, SourceMotion};
use super::network::Deformation;
use super::pose_network::PoseNetwork;
use super::registry::{Imports, Kind, Training};
use super::tensor::{NetworkCall, deform};
use crate::scene::{insert_cloud, read_cloud};
use crate::tensor_file::{TensorFile, TensorFileError};

/// Smallest standard deviation after an additive change, world units: keeps logarithms finite.
pub const DEFORMED_SCALE_FLOOR: f32 = 1e-6;

pub(super) const KIND: Kind = Kind {
    name: "defgs",
    format: "lagrangegs-defgs/1",
    read: |file, path| Ok(Box::new(DefGs::from_tensors(file, path)?)),
    imports: Imports::Possible,
    training: Some(Training { validate, motion }),
};

/// A trained DefGS model.
#[derive(Clone, Debug, PartialEq)]
pub struct DefGs {
    /// Gaussians before deformation.
    pub canonical: GaussianCloud,
    /// The network that moves them.
    pub deformation: Deformation,
}

impl SourceModel for DefGs {
    fn kind(&self) -> SourceKind {
        SourceKind::Defgs
    }

    fn len(&self) -> usize {
        self.canonical.len()
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        compose(&self.canonical, &self.poses(time), self.deformation.config.scale_mode)
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        positions(&self.poses(time))
    }

    fn to_tensors(&self) -> TensorFile {
        let mut file = TensorFile::new(self.kind().format());
        insert_cloud(&mut file, "canonical", &self.canonical);
        self.deformation.insert_into(&mut file, "deformation");
        file
    }
}

/// Centres of Gaussians in the poses `[x', q', Δs]`.
pub(super) fn positions(poses: &[[f32; DELTAS]]) -> Vec<[f32; 3]> {
    poses.iter().map(|&[x, y, z, ..]| [x, y, z]).collect()
}

/// Canonical Gaussians in the poses `[x', q', Δs]`.
#[must_use]
pub fn compose(canonical: &GaussianCloud, poses: &[[f32; DELTAS]], mode: ScaleMode) -> GaussianCloud {
    let scaled = canonical.log_scales.iter().zip(poses).map(|(s, pose)| {
        std::array::from_fn(|i| match mode {
            ScaleMode::Additive => (s[i].exp() + pose[7 + i]).max(DEFORMED_SCALE_FLOOR).ln(),
            ScaleMode::Exponent => s[i] + pose[7 + i],
            ScaleMode::Fixed => s[i],
        })
    });
    GaussianCloud {
        means: positions(poses),
        rotations: poses.iter().map(|&[_, _, _, w, x, y, z, ..]| quat_normalize([w, x, y, z])).collect(),
        log_scales: scaled.collect(),
        raw_opacities: canonical.raw_opacities.clone(),
        sh: canonical.sh.clone(),
        sh_degree: canonical.sh_degree,
    }
}

#[derive(Serialize, Deserialize)]
struct Header {
    config: DeformationConfig,
    #[serde(flatten)]
    frame: InputFrame,
}

impl Deformation {
    /// Adds the network's parameters, by name under `prefix`, and its sizes.
    pub fn insert_into(&self, file: &mut TensorFile, prefix: &str) {
        let header = Header { config: self.config.clone(), frame: self.frame };
        // A plain structure of numbers and names always serialises.
        file.set_metadata(prefix, serde_json::to_string(&header).unwrap_or_default());
        file.insert_params(prefix, &self.config.layout().params(), &self.params);
    }

    /// Reads what [`Self::insert_into`] wrote.
    ///
    /// # Errors
    /// If sizes or parameters are absent, do not fit or are not finite.
    pub fn read_from(file: &TensorFile, prefix: &str) -> Result<Self, TensorFileError> {
        let header: Header = file.metadata_json(prefix)?;
        header
            .config
            .validate()
            .map_err(|(field, reason)| file.field(&format!("{prefix}.{field}"), "a size in range", reason))?;
        if let Some(found) = header.frame.defect() {
            let name = format!("{prefix}.scale");
            return Err(file.field(&name, "a positive scale and a finite centre", found));
        }
        let params = file.params(prefix, &header.config.layout().params())?;
        Ok(Self { config: header.config, frame: header.frame, params })
    }
}

impl DefGs {
    fn poses(&self, time: f32) -> Vec<[f32; DELTAS]> {
        self.deformation.poses(&self.canonical.means, &self.canonical.rotations, time)
    }

    /// Reads what [`SourceModel::save`] wrote to `path`.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape.
    pub fn from_tensors(file: &TensorFile, path: &Path) -> Result<Self, SourceError> {
        let canonical = read_cloud(file, "canonical")?;
        canonical.validate().map_err(|source| SourceError::Cloud { path: path.to_owned(), source })?;
        let deformation = Deformation::read_from(file, "deformation")?;
        Ok(Self { canonical, deformation })
    }
}

fn validate(config: &MotionConfig<'_>) -> Result<(), (String, String)> {
    config.deformation_only()?;
    let refused = |(field, reason)| (format!("deformation.{field}"), reason);
    config.deformation.validate().map_err(refused)?;
    match config.deformation.code {
        0 => Ok(()),
        _ => Err(("deformation.code".to_owned(), "the source `defgs` has no code".to_owned())),
    }
}

fn motion(config: &MotionConfig<'_>, captured: Captured) -> Box<dyn SourceMotion> {
    Box::new(DeformationMotion { config: Arc::new(config.deformation.clone()), frame: captured.frame })
}

/// The deformation network in training.
struct DeformationMotion {
    config: Arc<DeformationConfig>,
    frame: InputFrame,
}

impl SourceMotion for DeformationMotion {
    fn init(&self, seed: u64) -> Vec<f32> {
        self.config.fresh(seed)
    }

    fn parameters(&self) -> usize {
        self.config.layout().len
    }

    fn poses(&self, network: Tensor<1>, canonical: Canonical, at: Moment) -> Tensor<2> {
        let call = NetworkCall { config: Arc::clone(&self.config), frame: self.frame, time: at.time };
        deform(network, canonical.means, canonical.rotations, call)
    }

    fn scale_mode(&self) -> ScaleMode {
        self.config.scale_mode
    }

    fn model(&self, learned: Learned) -> Box<dyn SourceModel> {
        let Learned { cloud: canonical, parameters: params, .. } = learned;
        let config = (*self.config).clone();
        let deformation = Deformation { config, frame: self.frame, params };
        Box::new(DefGs { canonical, deformation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{HeadInit, load_source};

    fn model(config: DeformationConfig) -> DefGs {
        let means: Vec<[f32; 3]> =
            (0..40).map(|i| [(i as f32).sin(), (i as f32).cos(), i as f32 * 0.02]).collect();
        let mut canonical = GaussianCloud::isotropic(means, 0.05, [0.3, 0.5, 0.7], 0.6);
        canonical.rotations.iter_mut().enumerate().for_each(|(i, q)| *q = [1.0, i as f32 * 0.1, -0.3, 2.0]);
        let frame = InputFrame::around(&canonical.means);
        DefGs { deformation: Deformation::init(config, frame, 3), canonical }
    }

    #[test]
    fn without_gain_at_the_start_a_model_starts_as_its_canonical_gaussians() {
        let model = model(DeformationConfig {
            gain_start: 0.0,
            head_init: HeadInit::Uniform,
            ..DeformationConfig::quick()
        });
        let start = model.positions_at(0.0);
        let off =
            start.as_flattened().iter().zip(model.canonical.means.as_flattened()).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f32::max) < 1e-6);
        assert_ne!(model.positions_at(0.5), model.canonical.means);
        let cloud = model.cloud_at(0.5);
        assert_eq!(cloud.means, model.positions_at(0.5));
        assert!(cloud.rotations.iter().all(|q| (q.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-5));
    }

    #[test]
    fn scales_pushed_below_zero_are_floored() {
        let model = model(DeformationConfig::paper());
        let mut deltas = vec![[0.0; DELTAS]; 40];
        deltas[0][7] = -1.0;
        let cloud = compose(&model.canonical, &deltas, ScaleMode::Additive);
        assert_eq!(cloud.log_scales[0][0], DEFORMED_SCALE_FLOOR.ln());
        assert!((cloud.log_scales[0][1] - model.canonical.log_scales[0][1]).abs() < 1e-6);
        assert!(
            (compose(&model.canonical, &deltas, ScaleMode::Exponent).log_scales[0][0]
                - (0.05_f32.ln() - 1.0))
                .abs()
                < 1e-6
        );
    }

    #[test]
    fn files_round_trip_and_defects_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("source.safetensors");
        let saved = model(DeformationConfig::quick());
        saved.save(&path).expect("save");
        let read = || TensorFile::load(&path, saved.kind().format()).map_err(SourceError::from);
        assert_eq!(read().and_then(|file| DefGs::from_tensors(&file, &path)).expect("load"), saved);
        assert_eq!(load_source(&path).expect("load").cloud_at(0.3), saved.cloud_at(0.3));
        let mut bad = saved.clone();
        bad.deformation.params[7] = f32::NAN;
        bad.save(&path).expect("save");
        let text = load_source(&path).err().expect("nan").to_string();
        assert!(text.contains("source.safetensors") && text.contains("deformation.time.0.weight"), "{text}");
        let absent = load_source(&folder.path().join("none")).err().expect("absent").to_string();
        assert!(absent.contains("none"), "{absent}");
        TensorFile::new("something/1").save(&path).expect("save");
        let other = load_source(&path).err().expect("format").to_string();
        assert!(other.contains("something/1") && other.contains(SourceKind::Defgs.format()), "{other}");
    }
}
