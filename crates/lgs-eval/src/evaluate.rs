//! All metrics of a run in one pass.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use lgs_core::Camera;
use lgs_data::dataset::{Dataset, Frame};
use lgs_data::synth::GroundTruth;
use lgs_dynamics::{Edit, Reversal};
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion};

use crate::image_score::{ForegroundRule, ImageScore, Scoring};
use crate::laws::{BandCoverage, LawOutline, ObjectLaw, band_coverage};
use crate::lpips::Perceptual;
use crate::metrics::{
    ExtentAgainstTruth, Footprint, FrameMetrics, Metrics, ObjectSummary, Physics, Protocol, SCHEMA,
    SplitMetrics,
};
use crate::physics::Truth;
use crate::physics::cycle::cycle_errors;
use crate::physics::edited::edited_trajectory_errors;
use crate::physics::energy::energy_drift;
use crate::physics::extent::{
    pixel_extent, pixel_extent_against_images, reach_against_truth, source_pixel_extent, spread_against_truth,
};
use crate::physics::fall::fall_time_exponent;
use crate::physics::force::forces_and_objects;
use crate::physics::potential::potential_against_truth;
use crate::physics::trajectory::trajectory_errors;
use crate::scales::scales;
use crate::split_score::{FrameRow, aggregate, foreground_rule, score_frames};

/// A run's two models, and the truth that they are compared with.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The Lagrangian scene.
    pub scene: &'a LagrangianScene,
    /// The model it was distilled from.
    pub source: Option<&'a dyn SourceModel>,
    /// True images.
    pub dataset: Option<&'a Dataset>,
    /// True motion.
    pub truth: Option<&'a GroundTruth>,
    /// Laws of the objects, in their order; may be empty.
    pub laws: &'a [Option<ObjectLaw>],
}

/// The choices of an evaluation.
#[derive(Clone, Copy, Debug)]
pub struct EvalOptions<'a> {
    /// The way in which negative times are reached.
    pub reversal: Reversal,
    /// Compare images at half their size, as the published figures of single objects.
    pub half_resolution: bool,
    /// Networks of LPIPS, if there are weights.
    pub perceptual: Option<&'a Perceptual>,
    /// Splits whose images are compared. Default: all. Figures of the motion are those of the whole dataset,
    /// but for pixels against true images.
    pub splits: Option<&'a [String]>,
}

impl EvalOptions<'_> {
    fn includes(&self, split: &str) -> bool {
        self.splits.is_none_or(|splits| splits.iter().any(|name| name == split))
    }
}

impl Default for EvalOptions<'_> {
    fn default() -> Self {
        Self { reversal: Reversal::Exact, half_resolution: false, perceptual: None, splits: None }
    }
}

/// Computes every figure that can be had; `progress` gets frames done and frames in all, from several
/// threads.
#[must_use]
pub fn evaluate(
    subject: &Subject<'_>,
    options: &EvalOptions<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Metrics {
    let scene = subject.scene;
    let mut motion = Motion::new(scene, Edit::default(), options.reversal);
    let rule = subject.dataset.map(foreground_rule);
    let scoring = Scoring {
        background: scene.background,
        rule: rule.unwrap_or(ForegroundRule::Opacity),
        half_resolution: options.half_resolution,
        perceptual: options.perceptual,
    };
    let rows = score_splits(subject, &mut motion, options, &scoring, progress);
    Metrics {
        schema: SCHEMA,
        splits: rows.iter().map(|(name, (_, rows))| (name.clone(), split_metrics(rows))).collect(),
        physics: Physics {
            edited_trajectory_error: edited_errors(subject, options.reversal),
            ..physics(subject, &mut motion, &rows, rule)
        },
        foreground: rule,
        protocol: Protocol {
            half_resolution: options.half_resolution,
            lpips_weights: options.perceptual.map(|p| p.origins.clone()).unwrap_or_default(),
            other_dataset: None,
        },
        footprint: Footprint {
            static_gaussians: scene.static_gaussians.len(),
            moving_gaussians: scene.dynamic_gaussians.len(),
            objects: scene.objects.len(),
        },
        frames: rows
            .iter()
            .map(|(name, (frames, rows))| (name.clone(), frame_metrics(frames, rows)))
            .collect(),
        ..Metrics::default()
    }
}

type ScoredSplits<'a> = BTreeMap<String, (&'a [Frame], Vec<FrameRow>)>;

fn score_splits<'a>(
    subject: &Subject<'a>,
    motion: &mut Motion<'_>,
    options: &EvalOptions<'_>,
    scoring: &Scoring<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> ScoredSplits<'a> {
    let Some(dataset) = subject.dataset else { return BTreeMap::new() };
    let asked = || dataset.splits.iter().filter(|(name, _)| options.includes(name));
    let total = asked().map(|(_, frames)| frames.len()).sum();
    let done = AtomicUsize::new(0);
    let tick = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
    let score = |(name, frames): (&String, &'a Vec<Frame>)| {
        let rows = match dataset.edits.get(name) {
            None => score_frames(subject.source, (subject.scene, &mut *motion), frames, scoring, &tick),
            // A source model knows nothing of edits.
            Some(&edit) => {
                let mut edited = Motion::new(subject.scene, scales(edit), options.reversal);
                score_frames(None, (subject.scene, &mut edited), frames, scoring, &tick)
            }
        };
        (name.clone(), (frames.as_slice(), rows))
    };
    asked().map(score).collect()
}

/// Position errors of every split that shows an edit, under that edit, by time.
fn edited_errors(
    subject: &Subject<'_>,
    reversal: Reversal,
) -> BTreeMap<String, BTreeMap<String, Option<f64>>> {
    let (Some(dataset), Some(truth)) = (subject.dataset, subject.truth) else { return BTreeMap::new() };
    edited_trajectory_errors(subject.scene, reversal, &dataset.edits, &truth.edited)
}

fn split_metrics(rows: &[FrameRow]) -> SplitMetrics {
    let lagrangian: Vec<ImageScore> = rows.iter().map(|r| r.lagrangian).collect();
    let source: Option<Vec<ImageScore>> = rows.iter().map(|r| r.source).collect();
    SplitMetrics { source: source.and_then(|s| aggregate(&s)), lagrangian: aggregate(&lagrangian) }
}

fn frame_metrics(frames: &[Frame], rows: &[FrameRow]) -> Vec<FrameMetrics> {
    let one = |row: &FrameRow| {
        let frame = &frames[row.index];
        FrameMetrics {
            name: frame.name.clone(),
            time: frame.time,
            camera: frame.camera_id,
            source: row.source.as_ref().map(Into::into),
            lagrangian: (&row.lagrangian).into(),
        }
    };
    rows.iter().map(one).collect()
}

fn physics(
    subject: &Subject<'_>,
    motion: &mut Motion<'_>,
    rows: &ScoredSplits<'_>,
    rule: Option<ForegroundRule>,
) -> Physics {
    let scene = subject.scene;
    let truth = subject.truth.and_then(Truth::new);
    let (force_ratio, mut objects) = forces_and_objects(scene, motion);
    judge(&mut objects, subject, motion, truth.as_ref());
    let bands = truth.as_ref().map(|truth| BandCoverage::of((scene, &objects), motion, truth));
    let (trajectory_error, trajectory_detail) = trajectory_errors(scene, motion, truth.as_ref());
    // What has no object keeps its size.
    let cameras =
        subject.dataset.filter(|_| !scene.objects.is_empty()).map(distinct_cameras).unwrap_or_default();
    let extent =
        (!cameras.is_empty()).then(|| pixel_extent(scene, motion, &cameras, scene.background)).flatten();
    let of_source =
        |source| source_pixel_extent(source, scene.motion.time_window, &cameras, scene.background);
    let source_extent = subject.source.filter(|_| !cameras.is_empty()).and_then(of_source);
    Physics {
        cycle_error: cycle_errors(scene),
        extent_ratio_max: extent.map(|r| r.max),
        extent_ratio_min: extent.map(|r| r.min),
        source_extent_ratio_max: source_extent.map(|r| r.max),
        extent_against_truth: extent_against_truth(subject, motion, rows, (rule, truth.as_ref())),
        trajectory_error,
        trajectory_detail,
        edited_trajectory_error: BTreeMap::new(),
        energy_drift: energy_drift(scene, 0.0),
        energy_change_with_force: energy_drift(scene, 1.0),
        fall_time_exponent: fall_time_exponent(scene, 1.0),
        fall_time_exponent_without_force: fall_time_exponent(scene, 0.0),
        force_ratio,
        potential: truth.as_ref().and_then(|truth| potential_against_truth(scene, motion, truth)),
        objects,
        bands: bands.unwrap_or_default(),
    }
}

/// Gives objects the records of their laws, with what the truth says of them.
fn judge(
    objects: &mut [ObjectSummary],
    subject: &Subject<'_>,
    motion: &mut Motion<'_>,
    truth: Option<&Truth<'_>>,
) {
    for (index, (object, law)) in objects.iter_mut().zip(subject.laws).enumerate() {
        object.law = law.as_ref().map(|law| judged(law, index, motion, (subject.scene, truth)));
        if let Some(law) = &object.law {
            object.outline = LawOutline::of(law, object.outline.networks);
        }
    }
}

/// The record of an object's law with what the truth says of it.
fn judged(
    law: &ObjectLaw,
    object: usize,
    motion: &mut Motion<'_>,
    (scene, truth): (&LagrangianScene, Option<&Truth<'_>>),
) -> ObjectLaw {
    let Some(truth) = truth else { return law.clone() };
    let band = law.band.as_ref();
    let coverage = band.and_then(|band| band_coverage((scene, object), motion, truth, band));
    ObjectLaw { coverage, expected: truth.expected_verdict(), ..law.clone() }
}

fn extent_against_truth(
    subject: &Subject<'_>,
    motion: &mut Motion<'_>,
    rows: &ScoredSplits<'_>,
    (rule, truth): (Option<ForegroundRule>, Option<&Truth<'_>>),
) -> ExtentAgainstTruth {
    let window = subject.scene.motion.time_window;
    let own = rows.iter().filter(|(name, _)| !subject.dataset.is_some_and(|d| d.edits.contains_key(*name)));
    let beyond = own
        .map(|(_, split)| split)
        .flat_map(|(frames, rows)| rows.iter().map(|row| (frames[row.index].time, &row.lagrangian)));
    let pixels = pixel_extent_against_images(
        beyond.filter(|&(t, _)| rule == Some(ForegroundRule::Opacity) && t > window),
    );
    let spread = truth.and_then(|truth| spread_against_truth(subject.scene, motion, truth));
    let reach = truth.and_then(|truth| reach_against_truth(subject.scene, motion, truth));
    ExtentAgainstTruth {
        pixels_max: pixels.map(|r| r.max),
        pixels_min: pixels.map(|r| r.min),
        spread_max: spread.map(|r| r.max),
        spread_min: spread.map(|r| r.min),
        reach: reach.map(|(reach, _)| reach),
        reach_p99: reach.map(|(_, p99)| p99),
    }
}

/// Every camera of a dataset once, by its number.
fn distinct_cameras(dataset: &Dataset) -> Vec<Camera> {
    let by_number: BTreeMap<usize, Camera> =
        dataset.splits.values().flatten().map(|f| (f.camera_id, f.camera)).collect();
    by_number.into_values().collect()
}
