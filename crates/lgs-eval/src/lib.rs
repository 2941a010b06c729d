//! How good a trained scene is: images against images, and motion against the laws that it should follow.
//!
//! [`evaluate`] takes a run's two models and what is known of the truth and returns [`Metrics`], the contents
//! of `metrics.json`; [`table`] prints them; figures and pages are `lgs_report`'s. One definition per metric,
//! all of it on the same [`lgs_model::Motion`] and the same rasterizer as training: nothing is scored that is
//! not also what a user renders.
//!
//! A figure that can't be had (no ground truth, no LPIPS weights, a rollout that left the numbers) is `None`
//! and becomes `null`; no figure is made up.

mod corrections;
mod cost;
mod evaluate;
mod finite;
mod fitted;
pub mod half_size;
pub mod image_score;
pub mod laws;
pub mod lpips;
pub mod memory;
mod metrics;
mod object_law;
pub mod physics;
mod render;
mod scales;
mod split_score;
pub mod table;
mod thresholds;

pub use corrections::CameraCorrections;
pub use cost::{Cost, StageCost};
pub use evaluate::{EvalOptions, Subject, evaluate};
pub use lgs_mechanics::bands::Verdict;
pub use metrics::{
    CycleError, ExtentAgainstTruth, FallTime, Footprint, FrameMetrics, FrameModelScore, Metrics,
    ObjectPotential, ObjectSummary, Physics, PotentialAgainstTruth, Protocol, SplitMetrics, SplitScore,
    TrajectoryDetail,
};
pub use render::{Rendered, render};
pub use split_score::{FrameRow, aggregate, foreground_rule, score_frames};
