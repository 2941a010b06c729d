//! Settings of source training; their values are in `presets`.

use lgs_model::source::{DeformationConfig, FreeGaveConfig, SourceKind, VelocityConfig};
use serde::{Deserialize, Serialize};

use super::advection::AdvectionConfig;

/// Which frames the static warm-up sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WarmupFrames {
    /// All times: moving parts are blurred until the deformation starts (DefGS).
    All,
    /// The shortest initial window that holds enough viewpoints, so that the canonical Gaussians are the
    /// scene's start (FreeGave).
    First,
}

/// Where the first Gaussians are put if the dataset ships no points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialPoints {
    /// Uniformly in the box.
    Random,
    /// On the surface of the visual hull of the first frames' alpha; uniformly in the box where that says too
    /// little.
    Hull,
}

/// Learning rates of Adam per group (§2.6); positions and the network decay log-linearly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LearningRates {
    /// Positions at the start, world units per step (paper: 8e-4).
    pub position_start: f64,
    /// Positions at the end (paper: 8e-6).
    pub position_end: f64,
    /// Steps over which they decay (paper: 30 000); 0: all iterations.
    pub position_steps: usize,
    /// Colour, constant coefficient (paper: 2.5e-3).
    pub sh: f64,
    /// Colour, other coefficients (paper: 1.25e-4).
    pub sh_rest: f64,
    /// Opacity logits (paper: 0.05).
    pub opacity: f64,
    /// Log scales (paper: 5e-3).
    pub scale: f64,
    /// Quaternions (paper: 1e-3).
    pub rotation: f64,
    /// Deformation network at the start (paper: 8e-4).
    pub deformation_start: f64,
    /// Steps over which the network's rate first rises to its start value (paper: 0). Adam's first steps are
    /// full steps in every weight, whatever the gradient; at high rates they can silence the network.
    pub deformation_ramp: usize,
    /// Deformation network at the end (paper: 1.6e-6).
    pub deformation_end: f64,
    /// Steps over which it decays (paper: 40 000); 0: all iterations.
    pub deformation_steps: usize,
}

impl Default for LearningRates {
    fn default() -> Self {
        SourceConfig::quick().learning_rates
    }
}

/// Densification: where Gaussians are cloned, split and removed (§2.7).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DensifyConfig {
    /// Acts after this iteration (paper: 500).
    pub after: usize,
    /// Acts before this iteration (paper: 15 000).
    pub before: usize,
    /// Acts every so many iterations (paper: 100).
    pub interval: usize,
    /// Mean NDC gradient from which a Gaussian is cloned or split (paper: 2e-4). Lower makes more Gaussians.
    pub gradient_threshold: f32,
    /// Largest standard deviation that is cloned rather than split, as a part of the scene's extent (paper:
    /// 0.01).
    pub clone_extent: f32,
    /// Opacity under which a Gaussian is removed (paper: 0.005).
    pub min_opacity: f32,
    /// Gaussians farther from the centre of the box that the cameras look at than this many of its half sides
    /// are not kept (paper: 0, all are).
    pub prune_outside: f32,
    /// Largest standard deviation, as a part of the scene's extent, that is kept after `prune_large_after`
    /// (paper: 0.1).
    pub prune_extent: f32,
    /// Iteration after which large Gaussians are removed (paper: 3000).
    pub prune_large_after: usize,
    /// Opacities are lowered to 0.01 every so many iterations (paper: 3000); 0: never.
    pub opacity_reset_interval: usize,
    /// Opacities are also lowered once at this iteration if the background is white (paper: 500); 0: never.
    pub white_reset_at: usize,
    /// Most Gaussians; where more qualify, those with the largest gradients are taken. 0: no limit (paper).
    pub max_gaussians: usize,
}

impl Default for DensifyConfig {
    fn default() -> Self {
        SourceConfig::quick().densify
    }
}

/// A pull of neighbouring Gaussians towards constant distances, which keeps what the images cannot see moving
/// with what they can.
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

impl Default for RigidityConfig {
    fn default() -> Self {
        SourceConfig::quick().rigidity
    }
}

/// A pull of what the silhouettes of still cameras show moving towards the paths they tell (`crate::tracks`):
/// for sets with few images of each moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuideConfig {
    /// Weight of the squared distance from the path (paper: 0, none). It fades after the time window has
    /// grown, to 0 at the end.
    pub weight: f32,
    /// Paths are looked for in sets with fewer training images than this per distinct time.
    pub below_images_per_time: f32,
}

impl Default for GuideConfig {
    fn default() -> Self {
        SourceConfig::quick().guide
    }
}

/// Image width that the quick preset's iterations are for, pixels.
const REFERENCE_WIDTH: f32 = 160.0;
/// Largest factor that larger images bring.
const MOST_STRETCH: f32 = 3.0;

/// What counts of iterations are multiplied by: the factor given, or if that is 0, one by the images' width.
#[must_use]
pub(crate) fn stretch_factor(given: f32, width: u32) -> f64 {
    f64::from(if given > 0.0 { given } else { (width as f32 / REFERENCE_WIDTH).clamp(1.0, MOST_STRETCH) })
}

/// Training of a source model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SourceConfig {
    /// What the source model is. It decides the defaults of everything below.
    pub kind: SourceKind,
    /// File or folder that the source model is taken from instead of being trained: frames for the kind
    /// `frames`, a folder of the authors' program for `defgs`; empty: it is trained.
    pub import: String,
    /// Every count of iterations below is multiplied by this (paper: 1); 0: by the images' width over 160
    /// pixels, between 1 and 3, since larger images have more to learn from.
    pub stretch: f32,
    /// Iterations, one training image each (paper: 40 000).
    pub iterations: usize,
    /// The deformation network is active from this iteration on (paper: 3000).
    pub warmup_iterations: usize,
    /// What the warm-up sees (paper: all).
    pub warmup_frames: WarmupFrames,
    /// Viewpoints that the first frames must hold, if the warm-up sees only these.
    pub warmup_cameras: usize,
    /// Steps in which the time window grows to the whole after the warm-up (paper: 1, at once; FreeGave: 8).
    pub window_steps: usize,
    /// Iterations per step of the window (FreeGave: 1000).
    pub window_interval: usize,
    /// While the window grows, frames are drawn one by one, and this share of them from the newest twentieth
    /// of the whole (paper: 0, all frames of the window in turn). Motion is then followed in small steps.
    pub front_share: f32,
    /// How often a round shows the frames of the window's first and last tenth, also when the window is whole
    /// (paper: 1). The ends have neighbours in time on one side only, and would be learned last.
    pub edge_repeats: usize,
    /// Gaussians to start with if the dataset ships no points (paper: 100 000).
    pub initial_gaussians: usize,
    /// Where they are put (paper: random).
    pub initial_points: InitialPoints,
    /// Half edge of the initial box, world units (paper: 1.3, around the origin); 0: inferred from the
    /// cameras.
    pub initial_half_extent: f32,
    /// Only Gaussians deeper than this in a view are drawn, by the Lagrangian scene as well, world units
    /// (paper: 0.2; FreeGave: 0.8). Nothing can then float close in front of a training camera, unseen by the
    /// others.
    pub near: f32,
    /// Largest degree of spherical harmonics (paper: 3).
    pub sh_degree: usize,
    /// Iterations after which the degree in use rises by one (paper: 1000).
    pub sh_interval: usize,
    /// Weight λ of 1 − SSIM in the loss (paper: 0.2).
    pub ssim_weight: f32,
    /// The deformation network.
    pub deformation: DeformationConfig,
    /// The velocity field that goes on where the deformation ends: FreeGave alone has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<VelocityConfig>,
    /// How it is trained.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advection: Option<AdvectionConfig>,
    /// Learning rates.
    pub learning_rates: LearningRates,
    /// Densification.
    pub densify: DensifyConfig,
    /// Rigidity of neighbours.
    pub rigidity: RigidityConfig,
    /// Guidance by silhouettes.
    pub guide: GuideConfig,
    /// Weight of the mean displacement of what hardly moves (paper: 0, none): keeps static surroundings
    /// static.
    pub static_regulariser: f32,
    /// Iteration from which on it acts: what moves must have been found by then, or it is held back.
    pub static_regulariser_after: usize,
}

impl Default for SourceConfig {
    fn default() -> Self {
        Self::quick()
    }
}

impl SourceConfig {
    /// The configuration for images of a width, with every count of iterations multiplied out.
    #[must_use]
    pub fn stretched(&self, width: u32) -> Self {
        let factor = stretch_factor(self.stretch, width);
        let mut stretched = Self { stretch: 1.0, ..self.clone() };
        let (rates, densify) = (&mut stretched.learning_rates, &mut stretched.densify);
        for count in [
            &mut stretched.iterations,
            &mut stretched.warmup_iterations,
            &mut stretched.window_interval,
            &mut stretched.sh_interval,
            &mut stretched.static_regulariser_after,
            &mut rates.position_steps,
            &mut rates.deformation_ramp,
            &mut rates.deformation_steps,
            &mut densify.after,
            &mut densify.before,
            &mut densify.prune_large_after,
        ] {
            *count = (*count as f64 * factor).round() as usize;
        }
        stretched
    }

    /// What is wrong with the values, as (key below `source`, reason).
    ///
    /// # Errors
    /// The first value out of range.
    pub fn validate(&self) -> Result<(), (String, String)> {
        self.validate_motion()?;
        let rates = &self.learning_rates;
        let positive = [
            ("learning_rates.position_start", rates.position_start),
            ("learning_rates.position_end", rates.position_end),
            ("learning_rates.deformation_start", rates.deformation_start),
            ("learning_rates.deformation_end", rates.deformation_end),
            ("rigidity.robust_scale", f64::from(self.rigidity.robust_scale)),
        ];
        let not_negative = [
            ("learning_rates.sh", rates.sh),
            ("learning_rates.sh_rest", rates.sh_rest),
            ("learning_rates.opacity", rates.opacity),
            ("learning_rates.scale", rates.scale),
            ("learning_rates.rotation", rates.rotation),
            ("initial_half_extent", f64::from(self.initial_half_extent)),
            ("near", f64::from(self.near)),
            ("densify.gradient_threshold", f64::from(self.densify.gradient_threshold)),
            ("rigidity.weight", f64::from(self.rigidity.weight)),
            ("guide.weight", f64::from(self.guide.weight)),
            ("guide.below_images_per_time", f64::from(self.guide.below_images_per_time)),
            ("stretch", f64::from(self.stretch)),
            ("static_regulariser", f64::from(self.static_regulariser)),
            ("densify.prune_outside", f64::from(self.densify.prune_outside)),
        ];
        for (key, value) in positive {
            require(value > 0.0 && value.is_finite(), key, format_args!("{value} is not a positive number"))?;
        }
        for (key, value) in not_negative {
            require(
                value >= 0.0 && value.is_finite(),
                key,
                format_args!("{value} is negative or not finite"),
            )?;
        }
        require(self.iterations >= 1, "iterations", format_args!("0 iterations train nothing"))?;
        require(
            (1..=2_000_000).contains(&self.initial_gaussians),
            "initial_gaussians",
            format_args!("not between 1 and 2 000 000"),
        )?;
        require(self.sh_degree <= 3, "sh_degree", format_args!("{} is above 3", self.sh_degree))?;
        require(
            (0.0..=1.0).contains(&self.front_share),
            "front_share",
            format_args!("{} is not in [0, 1]", self.front_share),
        )?;
        require(
            (0.0..=1.0).contains(&self.ssim_weight),
            "ssim_weight",
            format_args!("{} is not in [0, 1]", self.ssim_weight),
        )?;
        require(self.densify.interval >= 1, "densify.interval", format_args!("0 is not an interval"))?;
        require(
            (1..=64).contains(&self.rigidity.neighbors),
            "rigidity.neighbors",
            format_args!("not between 1 and 64"),
        )
    }
}

impl SourceConfig {
    /// What moves the Gaussians.
    fn validate_motion(&self) -> Result<(), (String, String)> {
        let deformation = self.deformation.clone();
        let imported = !self.import.is_empty();
        match (self.kind, &self.velocity, &self.advection) {
            (SourceKind::Defgs, None, None) => {
                deformation.validate().map_err(|(field, reason)| (format!("deformation.{field}"), reason))?;
                require(
                    deformation.code == 0,
                    "deformation.code",
                    format_args!("the source `defgs` has no code"),
                )
            }
            (SourceKind::Frames, None, None) => {
                require(imported, "import", format_args!("the source `frames` needs a file or folder"))
            }
            (SourceKind::Freegave, Some(velocity), Some(advection)) => {
                require(!imported, "import", format_args!("a source `freegave` can only be trained"))?;
                FreeGaveConfig { deformation, velocity: velocity.clone() }.validate()?;
                advection.validate().map_err(|(field, reason)| (format!("advection.{field}"), reason))
            }
            _ => Err((
                "kind".to_owned(),
                "`velocity` and `advection` belong to the source `freegave`, and to no other".to_owned(),
            )),
        }
    }
}

fn require(holds: bool, key: &str, reason: std::fmt::Arguments<'_>) -> Result<(), (String, String)> {
    if holds { Ok(()) } else { Err((key.to_owned(), reason.to_string())) }
}
