//! The preset `standard`: settings that are resolved from the data ([`SourceConfig::resolved`]), for any size
//! of images and worlds. Values were chosen by measurement (docs/experiments.md).

use lgs_model::source::{DeformationConfig, NodesConfig};

use super::config::SourceConfig;
use super::config_groups::{DensifyConfig, InitialPoints, LearningRates, ShadingConfig, WarmupFrames};

impl SourceConfig {
    /// DefGS for any set: a quarter of an hour to an hour on two CPU cores.
    #[must_use]
    pub fn standard() -> Self {
        let iterations = 8000;
        let quick = Self::quick();
        Self {
            iterations,
            coarse_levels: 2,
            coarse_share: 0.25,
            warmup_iterations: 600,
            warmup_frames: WarmupFrames::ByCameras,
            initial_gaussians: 1000,
            initial_points: InitialPoints::Surfaces,
            near: 0.0,
            sh_degree: 3,
            views_per_coefficient: 3.0,
            learning_rates: LearningRates::standard(),
            shading: ShadingConfig { after: iterations / 2, trial: 0, ..quick.shading },
            densify: DensifyConfig::standard(iterations),
            static_regulariser: 0.0,
            static_regulariser_after: 0,
            ..quick
        }
    }

    /// Control nodes for any set.
    #[must_use]
    pub fn nodes_standard() -> Self {
        let Self { kind, nodes, rigidity, guide, deformation, .. } = Self::nodes_quick();
        let nodes = nodes.map(|nodes| NodesConfig { rigidity_decay: 0.1, ..nodes });
        let deformation = DeformationConfig { width: 128, position_frequencies: 6, ..deformation };
        Self { kind, nodes, rigidity, guide, deformation, ..Self::standard() }
    }

    /// FreeGave for any set.
    #[must_use]
    pub fn freegave_standard() -> Self {
        let Self { kind, deformation, velocity, advection, .. } = Self::freegave_quick();
        Self { kind, deformation, velocity, advection, ..Self::standard() }
    }
}

impl LearningRates {
    /// Values for any set.
    #[must_use]
    pub fn standard() -> Self {
        Self {
            position_start: 4e-4,
            position_end: 4e-6,
            while_growing: 1.0,
            deformation_start: 3e-3,
            deformation_end: 3e-5,
            ..Self::quick()
        }
    }
}

impl DensifyConfig {
    /// Values for a training of `iterations`: a budget by the size of images.
    #[must_use]
    pub fn standard(iterations: usize) -> Self {
        Self {
            before: iterations * 6 / 10,
            min_opacity: 0.005,
            prune_extent: 0.0,
            opacity_weight: 0.01,
            scale_weight: 0.044,
            per_pixel: 0.25,
            max_gaussians: 0,
            ..Self::quick(iterations)
        }
    }
}
