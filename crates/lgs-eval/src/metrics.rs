//! The contents of `metrics.json`, schema 1, and of `eval --json`.
//!
//! PSNR in dB; errors and ratios are fractions; times in units of the captured sequence; `null` where a
//! figure can't be had.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::corrections::CameraCorrections;
use crate::cost::Cost;
use crate::image_score::{ForegroundRule, ImageScore};
use crate::lpips::store::Origin;
use crate::object_law::{BandCoverage, LawOutline, ObjectLaw};

/// Version of the layout.
pub(crate) const SCHEMA: u32 = 1;

/// All figures of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Version of the layout.
    pub schema: u32,
    /// Image figures by split.
    pub splits: BTreeMap<String, SplitMetrics>,
    /// Figures of the motion.
    pub physics: Physics,
    /// Time and memory of training.
    pub cost: Cost,
    /// The rule by which foreground was told from background; nothing without images.
    pub foreground: Option<ForegroundRule>,
    /// The conditions under which images were compared.
    #[serde(default)]
    pub protocol: Protocol,
    /// Numbers of Gaussians and objects.
    pub footprint: Footprint,
    /// Sizes of the corrections of the training cameras; nothing where they were taken as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cameras: Option<CameraCorrections>,
    /// Image figures of every frame, by split, in the order of the dataset.
    pub frames: BTreeMap<String, Vec<FrameMetrics>>,
}

/// The conditions under which images were compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Protocol {
    /// Whether images were compared at half their size (2 × 2 pixels averaged), as the published figures.
    pub half_resolution: bool,
    /// Weights of LPIPS; empty without.
    pub lpips_weights: Vec<Origin>,
    /// Fingerprint of the dataset, where it is another one than that of training.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_dataset: Option<String>,
}

/// Scores of both models on one split.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SplitMetrics {
    /// Score of the source model.
    pub source: Option<SplitScore>,
    /// Score of the Lagrangian scene.
    pub lagrangian: Option<SplitScore>,
}

/// Scores of one model on one split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SplitScore {
    /// Mean over images of PSNR.
    pub psnr: Option<f64>,
    /// PSNR of the mean squared error over all images: `−10 log10(meanᵢ 10^(−PSNRᵢ/10))`, the "MAEPSNR" of
    /// the published tables.
    pub psnr_of_mean_mse: Option<f64>,
    /// Mean over images of PSNR over the union of true and predicted foreground.
    pub psnr_foreground: Option<f64>,
    /// Mean over images of PSNR over the pixels that differ from the background colour in either image.
    pub psnr_content: Option<f64>,
    /// Mean over images of PSNR of true and predicted foreground as binary images; nothing for opaque images.
    pub psnr_silhouette: Option<f64>,
    /// Mean over images of PSNR once every channel of the prediction is fitted to the truth by a gain and an
    /// offset: what is left if the camera's exposure were known.
    pub psnr_fitted: Option<f64>,
    /// Mean over images of SSIM.
    pub ssim: Option<f64>,
    /// Mean over images of LPIPS with VGG-16, inputs in [−1, 1] as it expects; nothing without weights.
    pub lpips_vgg: Option<f64>,
    /// Mean over images of LPIPS with VGG-16, inputs in [0, 1] as in the published tables of FreeGave and
    /// DefGS.
    pub lpips_vgg_unnormalised: Option<f64>,
    /// Mean over images of LPIPS with AlexNet, inputs in [−1, 1].
    pub lpips_alex: Option<f64>,
    /// Number of images.
    pub frames: usize,
}

/// Scores of both models on one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameMetrics {
    /// Name of the image in the dataset.
    pub name: String,
    /// Time of the image.
    pub time: f32,
    /// Number of its camera.
    pub camera: usize,
    /// Scores of the source model, if it covers the time.
    pub source: Option<FrameModelScore>,
    /// Scores of the Lagrangian scene.
    pub lagrangian: FrameModelScore,
}

/// Scores of one model on one image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameModelScore {
    /// PSNR over all pixels.
    pub psnr: Option<f64>,
    /// PSNR over the foreground.
    pub psnr_foreground: Option<f64>,
    /// SSIM.
    pub ssim: Option<f64>,
    /// Foreground pixels, predicted over true; nothing where the truth shows none.
    pub foreground_ratio: Option<f64>,
}

impl From<&ImageScore> for FrameModelScore {
    fn from(score: &ImageScore) -> Self {
        Self {
            psnr: crate::finite::finite(score.psnr),
            psnr_foreground: score.psnr_foreground.and_then(crate::finite::finite),
            ssim: crate::finite::finite(score.ssim),
            foreground_ratio: (score.true_pixels > 0)
                .then(|| score.predicted_pixels as f64 / score.true_pixels as f64),
        }
    }
}

/// Figures of the motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Physics {
    /// Position error after rolling out to τ_max and back again.
    pub cycle_error: CycleError,
    /// Foreground pixels relative to t = 0, mean over views, maximum over (0, 3 τ_max].
    pub extent_ratio_max: Option<f64>,
    /// Foreground pixels relative to t = 0, mean over views, minimum over (0, 3 τ_max].
    pub extent_ratio_min: Option<f64>,
    /// Foreground pixels of the source model relative to t = 0, mean over views, maximum over the same times.
    pub source_extent_ratio_max: Option<f64>,
    /// Extent of the moving objects and of their paths, over the truth's.
    pub extent_against_truth: ExtentAgainstTruth,
    /// Mean position error over the truth's mean path length, by time.
    pub trajectory_error: BTreeMap<String, Option<f64>>,
    /// Further position errors, by time.
    pub trajectory_detail: BTreeMap<String, TrajectoryDetail>,
    /// Mean position error under the edit of every split that shows an edited motion, over the mean path
    /// length of the edited truth, by split and time.
    #[serde(default)]
    pub edited_trajectory_error: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Largest change of the mean U + T over [0, 3 τ_max] without Q, over the largest mean T.
    pub energy_drift: Option<f64>,
    /// Largest change of the mean U + T over [0, 3 τ_max] with Q, which may dissipate, over the largest mean
    /// T.
    pub energy_change_with_force: Option<f64>,
    /// Falling time ∝ β^slope; empty where nothing falls from rest.
    pub fall_time_exponent: FallTime,
    /// Falling time ∝ β^slope without Q (γ = 0); empty where nothing falls from rest.
    pub fall_time_exponent_without_force: FallTime,
    /// Mean ‖Q‖ over mean ‖∇U‖ at the states visited in [0, τ_max].
    pub force_ratio: Option<f64>,
    /// The learned potential against the true one; nothing where the truth has none or is not known.
    #[serde(default)]
    pub potential: Option<PotentialAgainstTruth>,
    /// Summary of every object.
    pub objects: Vec<ObjectSummary>,
    /// How often the truth lies inside of the bands of the objects' forecasts.
    #[serde(default)]
    pub bands: BandCoverage,
}

/// Learned potentials against true ones: the errors of the worst object, and every object whose law has a
/// potential.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PotentialAgainstTruth {
    /// Length of the mean −∇U at visited states over that of the true field, minus 1, where that is uniform
    /// (gravity).
    pub magnitude_error: Option<f64>,
    /// Angle between the mean −∇U and the true field, degrees.
    pub direction_error_degrees: Option<f64>,
    /// Curvature of U across the directions of motion over ω², minus 1, for springs and uniform rotations.
    pub curvature_error: Option<f64>,
    /// Errors of every object whose law has a potential.
    pub objects: Vec<ObjectPotential>,
}

/// One object's learned potential against the true one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectPotential {
    /// Label of the true object.
    pub object: i32,
    /// Mean ∇U at visited states, world units per squared unit of time, where the true field is uniform.
    pub gradient: Option<[f64; 3]>,
    /// Length of that gradient over the true field's, minus 1.
    pub magnitude_error: Option<f64>,
    /// Angle between −∇U and the true field, degrees.
    pub direction_error_degrees: Option<f64>,
    /// Mean curvature of U across the directions of motion, per squared unit of time, where the law is
    /// harmonic.
    pub curvature: Option<f64>,
    /// That curvature over ω², minus 1.
    pub curvature_error: Option<f64>,
    /// Error of the curvature if all of the acceleration −∇U + Q is counted: small where the motion is right
    /// whatever the split into U and Q.
    pub net_error: Option<f64>,
}

/// Cycle errors: Σ‖q₀ − q̂₀‖ / Σ path length, over moving Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CycleError {
    /// The paper's reversal (Eq. 8), alignment as the scene has it.
    pub negated_step: Option<f64>,
    /// The inverse of the forward step, alignment as the scene has it.
    pub exact: Option<f64>,
    /// The paper's reversal, alignment off both ways.
    pub negated_step_without_alignment: Option<f64>,
    /// The inverse of the forward step, alignment off both ways.
    pub exact_without_alignment: Option<f64>,
}

/// Extents relative to the ground truth's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExtentAgainstTruth {
    /// Foreground pixels over those of the true images that were compared, mean over views, maximum over
    /// times beyond the captured window.
    pub pixels_max: Option<f64>,
    /// That ratio's minimum over the same times.
    pub pixels_min: Option<f64>,
    /// Root-mean-square spread of an object around its centroid, relative to t = 0, over the same of the true
    /// object it matches; maximum over objects and [0, 3 τ_max].
    pub spread_max: Option<f64>,
    /// That ratio of spreads, minimum over objects and [0, 3 τ_max].
    pub spread_min: Option<f64>,
    /// Farthest that any moving Gaussian gets from the centre of the true paths' box in [−τ_max, 3 τ_max],
    /// over the true points'.
    pub reach: Option<f64>,
    /// 99th percentile over dynamic Gaussians of that distance, over the true points' farthest.
    pub reach_p99: Option<f64>,
}

/// Position errors at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryDetail {
    /// Median position error over Gaussians, over the mean path length.
    pub median: f64,
    /// Mean distance to the matched point itself, over the mean path length: contains the distance at t = 0.
    pub to_nearest_point: f64,
    /// Mean path length of the matched points from t = 0, world units.
    pub path: f64,
    /// Number of Gaussians compared.
    pub gaussians: usize,
}

/// Regression of falling times on β.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FallTime {
    /// Exponent: slope of log time over log β; −0.5 for a fall from rest.
    pub slope: Option<f64>,
    /// Correlation of the logarithms, as a magnitude.
    pub r: Option<f64>,
    /// Falling time by β.
    pub times: BTreeMap<String, Option<f64>>,
}

/// Summary of one object of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectSummary {
    /// Number of its Gaussians.
    pub gaussians: usize,
    /// Their centroid at t = 0, world units.
    pub center: [f32; 3],
    /// Displacement of the centroid over the captured window, per unit of time.
    pub mean_velocity: [f32; 3],
    /// Mean ‖Q‖ over mean ‖∇U‖ on its path.
    pub force_ratio: Option<f64>,
    /// Law of its motion in short.
    #[serde(flatten)]
    pub outline: LawOutline,
    /// Law of its motion; absent without one in generalised coordinates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<ObjectLaw>,
}

/// Size of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Footprint {
    /// Number of static Gaussians.
    pub static_gaussians: usize,
    /// Number of dynamic Gaussians.
    pub moving_gaussians: usize,
    /// Number of objects.
    pub objects: usize,
}
