//! A trained model of Gaussians that follow control nodes, and its file.

use std::path::Path;

use lgs_core::GaussianCloud;

use super::blend::{BlendInput, blend};
use super::neighbors::Neighbors;
use super::node::{FEATURES, NODE, Node};
use crate::scene::{insert_cloud, read_cloud};
use crate::source::config::{DELTAS, MAX_NEIGHBORS, ScaleMode};
use crate::source::defgs::{compose, positions};
use crate::source::error::SourceError;
use crate::source::kind::SourceKind;
use crate::source::model::SourceModel;
use crate::source::network::Deformation;
use crate::tensor_file::TensorFile;

/// Name of the number of nodes that a Gaussian follows.
const FOLLOWED: &str = "followed";

/// Gaussians that follow control nodes, which a network moves.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlNodes {
    /// Gaussians before deformation.
    pub canonical: GaussianCloud,
    /// Their features.
    pub features: Vec<[f32; FEATURES]>,
    /// Rows of nodes.
    pub nodes: Vec<[f32; NODE]>,
    /// The network that moves the nodes.
    pub deformation: Deformation,
    followed: usize,
    neighbors: Neighbors,
}

impl ControlNodes {
    /// Gaussians with features that follow up to `followed` of the nodes.
    ///
    /// # Panics
    /// If there are not as many features as Gaussians.
    #[must_use]
    pub fn new(
        canonical: GaussianCloud,
        features: Vec<[f32; FEATURES]>,
        nodes: Vec<[f32; NODE]>,
        deformation: Deformation,
        followed: usize,
    ) -> Self {
        let neighbors = Neighbors::search(&nodes, &canonical.means, &features, followed);
        Self { canonical, features, nodes, deformation, followed, neighbors }
    }

    fn poses(&self, time: f32) -> Vec<[f32; DELTAS]> {
        blend(BlendInput {
            nodes: &self.nodes,
            poses: &node_poses(&self.deformation, &self.nodes, time),
            means: &self.canonical.means,
            rotations: &self.canonical.rotations,
            features: &self.features,
            neighbors: &self.neighbors,
        })
    }

    /// Reads what [`SourceModel::save`] wrote to `path`.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape.
    pub fn from_tensors(file: &TensorFile, path: &Path) -> Result<Self, SourceError> {
        let canonical = read_cloud(file, "canonical")?;
        canonical.validate().map_err(|source| SourceError::Cloud { path: path.to_owned(), source })?;
        let features = file.rows::<FEATURES>("features")?;
        if features.len() != canonical.len() {
            let expected = format!("{} rows", canonical.len());
            return Err(file.field("features", &expected, format!("{} rows", features.len())).into());
        }
        let deformation = Deformation::read_from(file, "deformation")?;
        let followed: usize = file.metadata_json(FOLLOWED)?;
        if !(1..=MAX_NEIGHBORS).contains(&followed) {
            let expected = format!("a number from 1 to {MAX_NEIGHBORS}");
            return Err(file.field(FOLLOWED, &expected, followed.to_string()).into());
        }
        Ok(Self::new(canonical, features, file.rows("nodes")?, deformation, followed))
    }
}

/// Pose rows of nodes at a time.
pub(super) fn node_poses(deformation: &Deformation, nodes: &[[f32; NODE]], time: f32) -> Vec<[f32; DELTAS]> {
    let positions: Vec<[f32; 3]> = nodes.iter().map(|node| Node::of(node).position).collect();
    deformation.poses(&positions, &vec![[1.0, 0.0, 0.0, 0.0]; nodes.len()], time)
}

impl SourceModel for ControlNodes {
    fn kind(&self) -> SourceKind {
        SourceKind::Nodes
    }

    fn len(&self) -> usize {
        self.canonical.len()
    }

    fn cloud_at(&self, time: f32) -> GaussianCloud {
        compose(&self.canonical, &self.poses(time), ScaleMode::Fixed)
    }

    fn positions_at(&self, time: f32) -> Vec<[f32; 3]> {
        positions(&self.poses(time))
    }

    fn to_tensors(&self) -> TensorFile {
        let mut file = TensorFile::new(self.kind().format());
        insert_cloud(&mut file, "canonical", &self.canonical);
        file.insert("features", &[self.features.len(), FEATURES], self.features.as_flattened());
        file.insert("nodes", &[self.nodes.len(), NODE], self.nodes.as_flattened());
        self.deformation.insert_into(&mut file, "deformation");
        file.set_metadata(FOLLOWED, self.followed.to_string());
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::nodes::choose::{first_features, first_nodes};
    use crate::source::{DeformationConfig, HeadInit, InputFrame, load_source};

    fn model() -> ControlNodes {
        let means = (0..60).map(|i| [(i as f32).sin(), (i as f32).cos(), i as f32 * 0.02]).collect();
        let canonical = GaussianCloud::isotropic(means, 0.05, [0.3, 0.5, 0.7], 0.6);
        let frame = InputFrame::around(&canonical.means);
        let config = DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::quick() };
        let deformation = Deformation::init(config, frame, 3);
        let features = first_features(&canonical);
        let nodes = first_nodes(&canonical, &features, frame.scale, 12);
        ControlNodes::new(canonical, features, nodes, deformation, 4)
    }

    #[test]
    fn files_round_trip_and_defects_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let (saved, path) = (model(), folder.path().join("source.safetensors"));
        saved.save(&path).expect("save");
        let read = load_source(&path).expect("load");
        assert_eq!(read.cloud_at(0.3), saved.cloud_at(0.3));
        assert_eq!(read.cloud_at(0.3).means, read.positions_at(0.3));
        assert_ne!(read.positions_at(0.6), saved.canonical.means);
        let refused = |change: &dyn Fn(&mut TensorFile)| {
            let mut file = saved.to_tensors();
            change(&mut file);
            file.save(&path).expect("save");
            load_source(&path).err().expect("a defect").to_string()
        };
        let text = refused(&|file| file.insert("features", &[59, 3], &[0.0; 177]));
        assert!(text.contains("`features`") && text.contains("60 rows"), "{text}");
        let text = refused(&|file| file.set_metadata(FOLLOWED, "9"));
        assert!(text.contains("`followed`") && text.contains("source.safetensors"), "{text}");
        let text = refused(&|file| file.insert("nodes", &[2, 7], &[0.0; 14]));
        assert!(text.contains("`nodes`"), "{text}");
        let text = refused(&|file| file.insert("nodes", &[1, 8], &[f32::NAN; 8]));
        assert!(text.contains("`nodes`"), "{text}");
    }

    #[test]
    fn a_model_without_nodes_rests() {
        let model = model();
        let resting = ControlNodes::new(model.canonical, model.features, Vec::new(), model.deformation, 4);
        assert_eq!(resting.positions_at(0.7), resting.canonical.means);
    }
}
