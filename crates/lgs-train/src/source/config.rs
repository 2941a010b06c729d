//! Settings of source training; their values are in `presets`, groups of them in `config_groups`.

use lgs_model::source::{
    AdvectionConfig, DeformationConfig, MotionConfig, NodesConfig, SourceKind, VelocityConfig,
};
use serde::{Deserialize, Serialize};

use super::config_groups::{
    Antialias, DensifyConfig, GuideConfig, InitialPoints, LearningRates, RigidityConfig, ShadingConfig,
    WarmupFrames,
};
use crate::cameras::CamerasConfig;

/// Training of a source model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SourceConfig {
    /// Kind of the source model, which decides the defaults of everything below.
    pub kind: SourceKind,
    /// File or folder that the source model is taken from instead of being trained: frames for the kind
    /// `frames`, a folder of the authors' program for `defgs`; empty: it is trained.
    pub import: String,
    /// Every count of iterations below is multiplied by this (paper: 1); 0: by the images' width over 160
    /// pixels, between 1 and 3, since larger images have more to learn from.
    pub stretch: f32,
    /// Iterations, one training image each (paper: 40 000).
    pub iterations: usize,
    /// Times that the images' width is halved for the first iterations (paper: 0), as long as 100 pixels are
    /// left. What is coarse is then learned from few pixels.
    pub coarse_levels: usize,
    /// Part of the iterations that these take, every level as many.
    pub coarse_share: f32,
    /// The deformation network is active from this iteration on (paper: 3000).
    pub warmup_iterations: usize,
    /// Frames that the warm-up sees (paper: all).
    pub warmup_frames: WarmupFrames,
    /// Viewpoints that the first frames must show, if the warm-up sees only these.
    pub warmup_cameras: usize,
    /// Steps in which the time window grows to the whole after the warm-up (paper: 1, at once; FreeGave: 8).
    pub window_steps: usize,
    /// Iterations per step of the window (FreeGave: 1000).
    pub window_interval: usize,
    /// Factor by which the window grows more slowly in another attempt, where the images say that the motion
    /// does not follow what moves; 0: there is none (paper).
    pub slower_growth: usize,
    /// While the window grows, frames are drawn one by one, and this share of them from the newest twentieth
    /// of the whole (paper: 0, all frames of the window in turn). Motion is then followed in small steps.
    pub front_share: f32,
    /// How often a round shows the frames of the window's first and last tenth, also when the window is whole
    /// (paper: 1). The ends have neighbours in time on one side only, and would be learned last.
    pub edge_repeats: usize,
    /// Gaussians to start with if the dataset ships no points (paper: 100 000).
    pub initial_gaussians: usize,
    /// Placement of these Gaussians (paper: random).
    pub initial_points: InitialPoints,
    /// Half edge of the initial box, world units (paper: 1.3, around the origin); 0: inferred from the
    /// cameras.
    pub initial_half_extent: f32,
    /// Only Gaussians deeper than this in a view are drawn, by the Lagrangian scene as well, world units
    /// (paper: 0.2; FreeGave: 0.8); 0: a fifth of each camera's own distance from what the training cameras
    /// look at, or less ([`lgs_data::dataset::NearPlanes`]). Nothing can then float close in front of a
    /// training camera, unseen by the others.
    pub near: f32,
    /// What is done about detail finer than the pixels, by the Lagrangian scene as well (paper: nothing).
    pub antialias: Antialias,
    /// Largest degree of spherical harmonics (paper: 3).
    pub sh_degree: usize,
    /// The degree is lowered until there are this many training views per coefficient (paper: 0, never):
    /// colours that change with the direction are else fitted to the few directions that were seen.
    pub views_per_coefficient: f32,
    /// Iterations after which the degree in use rises by one (paper: 1000).
    pub sh_interval: usize,
    /// Share of the iterations that draw a colour for the background, behind the Gaussians and the image, if
    /// images have transparent pixels (paper: 0). What has the background's own colour else hides before it,
    /// and shows from elsewhere.
    pub random_background: f32,
    /// Weight λ of 1 − SSIM in the loss (paper: 0.2).
    pub ssim_weight: f32,
    /// The deformation network.
    pub deformation: DeformationConfig,
    /// The velocity field that goes on where the deformation ends: FreeGave alone has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<VelocityConfig>,
    /// Training of the velocity field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advection: Option<AdvectionConfig>,
    /// The control nodes that the deformation network moves: the kind `nodes` alone has them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<NodesConfig>,
    /// Refinement of the training cameras.
    pub cameras: CamerasConfig,
    /// Brightness of Gaussians over time, learned once densification has ended.
    pub shading: ShadingConfig,
    /// Learning rates of Gaussians and networks.
    pub learning_rates: LearningRates,
    /// Adaptive density.
    pub densify: DensifyConfig,
    /// The prior that neighbours keep their distances.
    pub rigidity: RigidityConfig,
    /// The prior that Gaussians follow the paths of silhouettes.
    pub guide: GuideConfig,
    /// Weight of the mean displacement of Gaussians that hardly move (paper: 0, none), which keeps static
    /// surroundings static.
    pub static_regulariser: f32,
    /// Iteration from which on the static regulariser acts; motion that is not learned by then is suppressed.
    pub static_regulariser_after: usize,
}

impl Default for SourceConfig {
    fn default() -> Self {
        Self::quick()
    }
}

impl SourceConfig {
    /// The settings of the motion.
    pub(super) fn motion(&self) -> MotionConfig<'_> {
        MotionConfig {
            deformation: &self.deformation,
            velocity: self.velocity.as_ref(),
            advection: self.advection.as_ref(),
            nodes: self.nodes.as_ref(),
        }
    }

    /// The settings for a still scene, without a motion to learn: Gaussians, trained as in the warm-up.
    #[must_use]
    pub fn without_motion(&self) -> Self {
        Self {
            kind: SourceKind::Linear,
            warmup_iterations: self.iterations + 1,
            warmup_frames: WarmupFrames::All,
            window_steps: 1,
            velocity: None,
            advection: None,
            nodes: None,
            ..self.clone()
        }
    }
}
