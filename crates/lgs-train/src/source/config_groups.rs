//! Groups of the settings of source training (method §3.4).

use lgs_core::PixelFilter;
use serde::{Deserialize, Serialize};

/// The frames that the static warm-up sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WarmupFrames {
    /// All times: moving parts are blurred until the deformation starts (DefGS).
    All,
    /// The shortest initial window that holds enough viewpoints, from far enough apart, so that the canonical
    /// Gaussians are the scene's start (FreeGave).
    First,
    /// All times in the first half of the warm-up, for what stands, then that window, for where the rest is
    /// at the start.
    AllThenFirst,
    /// The last, of at least ten viewpoints and with the whole window at once after it, where the camera is
    /// elsewhere at nearly every image: no new moment shows the scene from enough sides then. Else the first
    /// window.
    ByCameras,
}

/// Placement of the first Gaussians if the dataset ships no points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialPoints {
    /// Uniformly distributed in the box.
    Random,
    /// In the visual hull of the first frames' alpha; uniformly in the box where that says too little, as a
    /// camera does that jumps.
    Hull,
    /// On surfaces that images of several cameras agree on, where these are opaque and show enough texture,
    /// as many as were found; else as `hull`.
    Surfaces,
    /// In the hull on which nearly all frames agree, whatever their time; for a camera that jumps.
    HullOfAll,
}

/// What is done about detail finer than the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Antialias {
    /// Nothing: small Gaussians are drawn wider than they are (3D Gaussian splatting).
    None,
    /// The 2D Mip filter: a Gaussian is averaged over a pixel and keeps its energy (Yu et al. 2024).
    Mip,
    /// That and the 3D smoothing filter: no Gaussian of the source model is finer than what the training
    /// images resolve, so that closer views do not thin it out.
    MipSmoothing,
}

impl Antialias {
    /// The filter of all cameras that draw the model, or a scene made from it.
    #[must_use]
    pub fn filter(self) -> PixelFilter {
        match self {
            Self::None => PixelFilter::Dilation,
            Self::Mip | Self::MipSmoothing => PixelFilter::Mip,
        }
    }
}

/// Learning rates of Adam per group; positions and the network decay log-linearly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LearningRates {
    /// World units that rates of positions are in (paper: 1); 0: the cameras' distance from what they look at
    /// over 4, that of the published scenes, so that rates do not depend on the world's scale.
    pub position_unit: f64,
    /// Rate of positions at the start, world units per step (paper: 8e-4).
    pub position_start: f64,
    /// Rate of positions at the end (paper: 8e-6).
    pub position_end: f64,
    /// Steps over which the rate of positions decays (paper: 30 000); 0: all iterations.
    pub position_steps: usize,
    /// Rate of the constant coefficient of colours (paper: 2.5e-3).
    pub sh: f64,
    /// Rate of the other coefficients of colours (paper: 1.25e-4).
    pub sh_rest: f64,
    /// Rate of opacity logits (paper: 0.05).
    pub opacity: f64,
    /// Rate of log scales (paper: 5e-3).
    pub scale: f64,
    /// Rate of quaternions (paper: 1e-3).
    pub rotation: f64,
    /// Share of these rates, those of the Gaussians, while the time window grows (paper: 1). Opacities and
    /// colours learn faster than the network: what begins to move, or crosses its own width between two
    /// moments, would blur or fade before it is followed. 0: the Gaussians keep still meanwhile.
    pub while_growing: f64,
    /// Rate of the deformation network at the start (paper: 8e-4).
    pub deformation_start: f64,
    /// Steps over which the network's rate first rises to its start value (paper: 0). Adam's first steps are
    /// full steps in every weight, whatever the gradient; at high rates they can silence the network.
    pub deformation_ramp: usize,
    /// Rate of the deformation network at the end (paper: 1.6e-6).
    pub deformation_end: f64,
    /// Steps over which the rate of the network decays (paper: 40 000); 0: all iterations.
    pub deformation_steps: usize,
}

/// Brightness of Gaussians over time: shadows that pass, surfaces that turn to a light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShadingConfig {
    /// Number of times at which brightnesses are learned, evenly spaced over the window (paper: 0, none).
    pub times: usize,
    /// Brightness is learned from the iteration after this one on.
    pub after: usize,
    /// Iterations of learning after which brightness is given up, unless it changes smoothly over time;
    /// 0 keeps it whatever it is.
    pub trial: usize,
    /// Weight of the mean squared logarithm of brightness, of the two times around an image's, in the share
    /// of the image that Gaussians cover.
    pub weight: f32,
    /// Weight of the mean squared change between these, likewise.
    pub change_weight: f32,
    /// Learning rate at the start.
    pub rate_start: f64,
    /// Learning rate at the end of the training.
    pub rate_end: f64,
}

impl ShadingConfig {
    /// Brightness from the middle of a schedule on, given up after an eighth of it unless it is that of
    /// light.
    #[must_use]
    pub fn tried(iterations: usize) -> Self {
        Self { times: 16, after: iterations / 2, trial: iterations / 8, ..Self::default() }
    }
}

impl Default for ShadingConfig {
    fn default() -> Self {
        Self {
            times: 0,
            after: 0,
            trial: 0,
            weight: 0.2,
            change_weight: 0.2,
            rate_start: 0.01,
            rate_end: 3e-4,
        }
    }
}

/// How the number and the places of Gaussians adapt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DensifyMethod {
    /// Gaussians with large gradients are cloned or split, faint and large ones removed (3D Gaussian
    /// splatting).
    Classical,
    /// Faint Gaussians are moved onto opaque ones, and the number grows to a fixed budget (Kheradmand et al.
    /// 2024). Of the settings of [`DensifyConfig`] it has `after`, `before`, `interval`, `min_opacity`,
    /// `prune_outside`, `max_gaussians`, its budget, and those in `mcmc`.
    Mcmc,
}

/// Densification as Markov chain Monte Carlo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct McmcConfig {
    /// Part by which the number of Gaussians grows in an interval, up to the budget (published: 0.05).
    pub growth: f32,
    /// Factor of the noise of positions, with lengths in units of the scene's extent: a faint Gaussian moves
    /// by this times the learning rate times its covariance times a normal draw (published: 5e5 with lengths
    /// in world units, for scenes with an extent of 4.4, hence 1e7).
    pub noise: f32,
}

impl Default for McmcConfig {
    fn default() -> Self {
        Self { growth: 0.05, noise: 1e7 }
    }
}

/// Densification: where Gaussians are cloned, split, removed or moved to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DensifyConfig {
    /// How Gaussians adapt; settings that only one way has say so.
    pub method: DensifyMethod,
    /// Densification acts after this iteration (paper: 500).
    pub after: usize,
    /// Densification acts before this iteration (paper: 15 000).
    pub before: usize,
    /// Iterations between two densifications (paper: 100).
    pub interval: usize,
    /// Mean NDC gradient from which a Gaussian is cloned or split (paper: 2e-4). Lower makes more Gaussians.
    pub gradient_threshold: f32,
    /// Largest standard deviation that is cloned rather than split, as a part of the scene's extent (paper:
    /// 0.01).
    pub clone_extent: f32,
    /// Opacity under which a Gaussian is removed or moved (paper: 0.005).
    pub min_opacity: f32,
    /// Gaussians farther from the centre of the box that the cameras look at than this many of its half sides
    /// are not kept (paper: 0, all are).
    pub prune_outside: f32,
    /// Largest standard deviation, as a part of the scene's extent, that is kept after `prune_large_after`
    /// (paper: 0.1); 0: any. Surroundings have large faces without texture.
    pub prune_extent: f32,
    /// Iteration after which large Gaussians are removed (paper: 3000).
    pub prune_large_after: usize,
    /// Opacities are lowered to 0.01 every so many iterations (paper: 3000); 0: never.
    pub opacity_reset_interval: usize,
    /// Opacities are also lowered once at this iteration if the background is white (paper: 500); 0: never.
    pub white_reset_at: usize,
    /// Weight of the mean opacity in the loss (paper: 0; `mcmc` as published: 0.01): what images do not hold
    /// fades, and is removed or moved.
    pub opacity_weight: f32,
    /// Weight of the mean standard deviation in the loss, in units of the scene's extent (paper: 0; `mcmc` as
    /// published: 0.01 in world units of scenes with an extent of 4.4, hence 0.044).
    pub scale_weight: f32,
    /// Gaussians per pixel of an image, if `max_gaussians` is 0 (paper: 0): the largest number is then this
    /// many, but at least 4000 and at most 40 000, and first points beyond it are thinned out.
    pub per_pixel: f32,
    /// Largest number of Gaussians; where more qualify, those with the largest gradients are taken. 0: no
    /// limit (paper), which `mcmc` must have.
    pub max_gaussians: usize,
    /// Most Gaussians that are proposed in an interval for what some image shows and the model lacks (paper:
    /// 0, none). In a full budget the faintest give way to them.
    pub proposals: usize,
    /// Settings of the method `mcmc`.
    pub mcmc: McmcConfig,
}

/// A prior that neighbouring Gaussians keep their distances, so that those that no image shows move with
/// those that images show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigidityConfig {
    /// Weight of the mean squared relative change of neighbour distances (paper: 0, none).
    pub weight: f32,
    /// Neighbours per Gaussian.
    pub neighbors: usize,
    /// Relative stretch beyond which an edge is taken to join two bodies and pulls less and less.
    pub robust_scale: f32,
}

/// A prior for sets with few images of each moment: Gaussians follow the paths that the silhouettes of still
/// cameras give (`crate::tracks`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuideConfig {
    /// Weight of the squared distance from the path (paper: 0, none). It fades after the time window has
    /// grown, to 0 at the end.
    pub weight: f32,
    /// Whether each Gaussian of a ball is led by the rotation that the ball's texture tells, and not their
    /// mean alone. Control nodes carry rotations; a small network of every Gaussian's position takes them up
    /// at the expense of the path. A ball that turns once or more in the window is carried either way.
    pub rotations: bool,
    /// Paths are looked for in sets with fewer training images than this per distinct time.
    pub below_images_per_time: f32,
    /// Whether, in sets with as many or more, Gaussians of what flies apart from everything else, and far for
    /// its size, are carried along its path.
    pub flights: bool,
}
