//! Priors of a motion beside the images, as gradients by the deformed positions: rigid neighbourhoods, static
//! surroundings, paths of silhouettes.

use burn::tensor::{Device, Tensor};
use lgs_model::source::Moment;
use lgs_model::{TensorFile, TensorFileError};

use super::config::SourceConfig;
use super::guide::Guide;
use super::rigidity::NeighborGraph;
use super::static_regulariser;
use crate::cloud_tensors::host_rows;

/// The priors of a training run, and the neighbours of its Gaussians since the last densification.
pub(super) struct MotionPriors {
    config: SourceConfig,
    guide: Guide,
    graph: Option<NeighborGraph>,
    extent: f32,
    device: Device,
}

impl MotionPriors {
    /// The priors of a configuration; `extent` is that of the scene, world units.
    pub(super) fn new(guide: Guide, extent: f32, config: &SourceConfig, device: &Device) -> Self {
        Self { config: config.clone(), guide, graph: None, extent, device: device.clone() }
    }

    /// The gradient `[n, 3]` of all priors by the deformed positions, given these and the canonical ones,
    /// both `[n, 3]`; nothing where no prior acts.
    pub(super) fn gradient(
        &mut self,
        canonical: &Tensor<2>,
        deformed: &Tensor<2>,
        at: Moment,
    ) -> Option<Tensor<2>> {
        let (config, mut parts) = (&self.config, Vec::new());
        if config.static_regulariser > 0.0 && at.iteration > config.static_regulariser_after {
            let regulariser =
                static_regulariser::gradient(canonical, deformed, config.static_regulariser, self.extent);
            parts.push(regulariser);
        }
        if config.rigidity.weight > 0.0 {
            let graph = self.graph.get_or_insert_with(|| {
                NeighborGraph::new(&host_rows(canonical), config.rigidity.neighbors, &self.device)
            });
            parts.push(graph.gradient(canonical, deformed, &config.rigidity));
        }
        if !self.guide.is_empty() {
            let weight = config.guide_weight(at.iteration - 1);
            parts.push(self.guide.gradient(canonical, deformed, at.time, weight));
        }
        parts.into_iter().reduce(|sum, part| sum + part)
    }

    /// Neighbours have to be found anew, since the Gaussians are others now.
    pub(super) fn forget_neighbors(&mut self) {
        self.graph = None;
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        if let Some(graph) = &self.graph {
            graph.insert_into(file);
        }
    }

    /// Reads the neighbours of `n` Gaussians from a checkpoint.
    pub(super) fn restore(&mut self, file: &TensorFile, n: usize) -> Result<(), TensorFileError> {
        self.graph = NeighborGraph::read_from(file, n, &self.device)?;
        Ok(())
    }
}
