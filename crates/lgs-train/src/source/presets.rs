//! Values of the settings of source training. The `paper` ones are DefGS as published (method §3); the
//! `quick` ones were chosen by measurement on two CPU cores and are written into every run's `config.toml`.

use lgs_core::DEFAULT_NEAR;
use lgs_model::source::{
    AdvectionConfig, DeformationConfig, NodesConfig, ScaleMode, SourceKind, VelocityConfig,
};

use super::config::SourceConfig;
use super::config_groups::{
    Antialias, DensifyConfig, DensifyMethod, GuideConfig, InitialPoints, LearningRates, McmcConfig,
    RigidityConfig, ShadingConfig, WarmupFrames,
};
use crate::cameras::CamerasConfig;
use crate::preset::Preset;

/// Near plane of FreeGave as published, world units.
const FREEGAVE_NEAR: f32 = 0.8;

impl SourceConfig {
    /// The defaults of a kind under a preset.
    #[must_use]
    pub fn preset(kind: SourceKind, preset: Preset) -> Self {
        match (kind, preset) {
            (SourceKind::Freegave, Preset::Quick) => Self::freegave_quick(),
            (SourceKind::Freegave, Preset::Standard) => Self::freegave_standard(),
            (SourceKind::Nodes, Preset::Standard) => Self::nodes_standard(),
            (_, Preset::Standard) => Self { kind, ..Self::standard() },
            (SourceKind::Freegave, Preset::Paper) => Self::freegave_paper(),
            (SourceKind::Nodes, Preset::Quick) => Self::nodes_quick(),
            (SourceKind::Nodes, Preset::Paper) => Self::nodes_paper(),
            // The settings of `frames` have no effect: nothing is trained.
            (SourceKind::Frames, _) | (_, Preset::Quick) => Self { kind, ..Self::quick() },
            (_, Preset::Paper) => Self { kind, ..Self::paper() },
        }
    }

    /// DefGS for synthetic scenes as published: hours on a GPU, days on a CPU.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            kind: SourceKind::Defgs,
            import: String::new(),
            stretch: 1.0,
            iterations: 40_000,
            coarse_levels: 0,
            coarse_share: 0.0,
            warmup_iterations: 3000,
            warmup_frames: WarmupFrames::All,
            warmup_cameras: 8,
            window_steps: 1,
            window_interval: 1000,
            slower_growth: 0,
            front_share: 0.0,
            edge_repeats: 1,
            initial_gaussians: 100_000,
            initial_points: InitialPoints::Random,
            initial_half_extent: 1.3,
            near: DEFAULT_NEAR,
            antialias: Antialias::None,
            sh_degree: 3,
            views_per_coefficient: 0.0,
            sh_interval: 1000,
            random_background: 0.0,
            ssim_weight: 0.2,
            deformation: DeformationConfig::paper(),
            velocity: None,
            advection: None,
            nodes: None,
            cameras: CamerasConfig::off(),
            shading: ShadingConfig::default(),
            learning_rates: LearningRates::paper(),
            densify: DensifyConfig::paper(),
            rigidity: RigidityConfig { weight: 0.0, neighbors: 4, robust_scale: 0.1 },
            guide: GuideConfig { weight: 0.0, rotations: false, below_images_per_time: 3.0, flights: false },
            static_regulariser: 0.0,
            static_regulariser_after: 0,
        }
    }

    /// DefGS in minutes on two CPU cores.
    #[must_use]
    pub fn quick() -> Self {
        let iterations = 4000;
        Self {
            kind: SourceKind::Defgs,
            import: String::new(),
            stretch: 0.0,
            iterations,
            coarse_levels: 0,
            coarse_share: 0.0,
            warmup_iterations: 400,
            warmup_frames: WarmupFrames::First,
            warmup_cameras: 4,
            window_steps: 30,
            window_interval: 20,
            slower_growth: 4,
            front_share: 0.5,
            edge_repeats: 2,
            initial_gaussians: 3000,
            initial_points: InitialPoints::Hull,
            initial_half_extent: 0.0,
            near: 0.0,
            antialias: Antialias::None,
            sh_degree: 1,
            views_per_coefficient: 0.0,
            sh_interval: 1000,
            random_background: 0.0,
            ssim_weight: 0.2,
            deformation: DeformationConfig::quick(),
            cameras: CamerasConfig::default(),
            shading: ShadingConfig::tried(iterations),
            learning_rates: LearningRates::quick(),
            densify: DensifyConfig::quick(iterations),
            rigidity: RigidityConfig { weight: 1.0, neighbors: 6, robust_scale: 0.1 },
            guide: GuideConfig { weight: 3.0, rotations: false, below_images_per_time: 3.0, flights: true },
            static_regulariser: 0.05,
            static_regulariser_after: iterations * 2 / 3,
            ..Self::paper()
        }
    }

    /// Control nodes in minutes on two CPU cores; their own priors take the place of that of Gaussians'
    /// neighbours.
    #[must_use]
    pub fn nodes_quick() -> Self {
        let defgs = Self::quick();
        Self {
            kind: SourceKind::Nodes,
            nodes: Some(NodesConfig::quick()),
            rigidity: RigidityConfig { weight: 0.0, ..defgs.rigidity },
            guide: GuideConfig { rotations: true, ..defgs.guide },
            ..defgs
        }
    }

    /// Control nodes with the published network and lengths of DefGS, which SC-GS shares but for its scales.
    #[must_use]
    pub fn nodes_paper() -> Self {
        let defgs = Self::paper();
        let deformation = DeformationConfig { scale_mode: ScaleMode::Fixed, ..defgs.deformation };
        Self { kind: SourceKind::Nodes, nodes: Some(NodesConfig::paper()), deformation, ..defgs }
    }

    /// FreeGave for synthetic objects as published (method §3.2); T* and K of single scenes are
    /// in `configs/freegave`.
    #[must_use]
    pub fn freegave_paper() -> Self {
        let defgs = Self::paper();
        Self {
            kind: SourceKind::Freegave,
            import: String::new(),
            warmup_frames: WarmupFrames::First,
            warmup_cameras: 1,
            window_steps: 8,
            initial_gaussians: 50_000,
            initial_half_extent: 2.0,
            near: FREEGAVE_NEAR,
            deformation: DeformationConfig::freegave_paper(),
            velocity: Some(VelocityConfig::paper()),
            advection: Some(AdvectionConfig::paper()),
            densify: DensifyConfig { min_opacity: 0.05, ..defgs.densify.clone() },
            ..defgs
        }
    }

    /// FreeGave in minutes on two CPU cores.
    #[must_use]
    pub fn freegave_quick() -> Self {
        Self {
            kind: SourceKind::Freegave,
            import: String::new(),
            deformation: DeformationConfig::freegave_quick(),
            velocity: Some(VelocityConfig::quick()),
            advection: Some(AdvectionConfig::quick()),
            ..Self::quick()
        }
    }
}

impl LearningRates {
    /// Values for a training of minutes on two CPU cores.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            position_unit: 0.0,
            position_start: 2e-4,
            position_end: 1e-5,
            position_steps: 0,
            sh: 5e-3,
            sh_rest: 2.5e-4,
            rotation: 2e-3,
            while_growing: 0.3,
            deformation_start: 3e-3,
            deformation_ramp: 100,
            deformation_end: 1e-4,
            deformation_steps: 0,
            ..Self::paper()
        }
    }

    /// The published values.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            position_unit: 1.0,
            position_start: 8e-4,
            position_end: 8e-6,
            position_steps: 30_000,
            sh: 2.5e-3,
            sh_rest: 1.25e-4,
            opacity: 0.05,
            scale: 5e-3,
            rotation: 1e-3,
            while_growing: 1.0,
            deformation_start: 8e-4,
            deformation_ramp: 0,
            deformation_end: 1.6e-6,
            deformation_steps: 40_000,
        }
    }
}

impl DensifyConfig {
    /// Values for a training of `iterations` that takes minutes on two CPU cores.
    #[must_use]
    pub fn quick(iterations: usize) -> Self {
        Self {
            method: DensifyMethod::Classical,
            after: 150,
            before: iterations / 2,
            interval: 100,
            gradient_threshold: 2e-4,
            clone_extent: 0.01,
            min_opacity: 0.01,
            prune_outside: 2.0,
            prune_extent: 0.1,
            prune_large_after: 300,
            opacity_reset_interval: 0,
            white_reset_at: 0,
            opacity_weight: 0.0,
            scale_weight: 0.0,
            per_pixel: 0.0,
            max_gaussians: 4000,
            proposals: 0,
            mcmc: McmcConfig::default(),
        }
    }

    /// The published values.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            method: DensifyMethod::Classical,
            after: 500,
            before: 15_000,
            interval: 100,
            gradient_threshold: 2e-4,
            clone_extent: 0.01,
            min_opacity: 0.005,
            prune_outside: 0.0,
            prune_extent: 0.1,
            prune_large_after: 3000,
            opacity_reset_interval: 3000,
            white_reset_at: 500,
            opacity_weight: 0.0,
            scale_weight: 0.0,
            per_pixel: 0.0,
            max_gaussians: 0,
            proposals: 0,
            mcmc: McmcConfig::default(),
        }
    }
}

impl Default for LearningRates {
    fn default() -> Self {
        SourceConfig::quick().learning_rates
    }
}

impl Default for DensifyConfig {
    fn default() -> Self {
        SourceConfig::quick().densify
    }
}

impl Default for RigidityConfig {
    fn default() -> Self {
        SourceConfig::quick().rigidity
    }
}

impl Default for GuideConfig {
    fn default() -> Self {
        SourceConfig::quick().guide
    }
}
