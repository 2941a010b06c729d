//! The figures of the tables: their names, and where they lie in a run's metrics.

use lgs_eval::{Metrics, SplitScore};
use serde::Serialize;

/// One of a run's two models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// The source.
    Source,
    /// The Lagrangian model distilled from it.
    Lagrangian,
}

impl Model {
    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Source => "source",
            Self::Lagrangian => "lagrangian",
        }
    }
}

/// Reads a figure of a model.
pub(crate) type Read = fn(&Metrics, Model) -> Option<f64>;

/// A model's scores on a split.
pub(crate) fn split_score<'a>(metrics: &'a Metrics, split: &str, model: Model) -> Option<&'a SplitScore> {
    let split = metrics.splits.get(split)?;
    match model {
        Model::Source => split.source.as_ref(),
        Model::Lagrangian => split.lagrangian.as_ref(),
    }
}

/// Image scores on the test split: name, title, decimals, reading.
pub(crate) const TEST_SCORES: [(&str, &str, usize, Read); 5] = [
    ("psnr", "PSNR", 3, |m, model| split_score(m, "test", model)?.psnr),
    ("psnr_of_mean_mse", "PSNR of mean MSE", 3, |m, model| split_score(m, "test", model)?.psnr_of_mean_mse),
    ("ssim", "SSIM", 3, |m, model| split_score(m, "test", model)?.ssim),
    ("lpips_vgg", "LPIPS (VGG)", 3, |m, model| split_score(m, "test", model)?.lpips_vgg),
    ("lpips_vgg_unnormalised", "LPIPS (unnormalised VGG)", 3, |m, model| {
        split_score(m, "test", model)?.lpips_vgg_unnormalised
    }),
];

/// Which of the paper's scores each of [`TEST_SCORES`] stands beside: its PSNR is that of the mean squared
/// error, its LPIPS that of inputs in [0, 1] (method §7).
pub(crate) const PUBLISHED_SCORE: [Option<usize>; 5] = [None, Some(0), Some(1), None, Some(2)];

/// The way in which the figures of scenes become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Over {
    /// Mean over all scenes; none may lack the figure.
    Every,
    /// Mean over the scenes that have the figure.
    Having,
    /// Largest figure of the scenes that have it.
    Largest,
}

/// The way in which a number is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "as", content = "digits")]
pub enum Format {
    /// A number with so many decimals.
    Number(usize),
    /// A number with so many decimals and its sign.
    Signed(usize),
    /// A fraction as a percentage with so many decimals.
    Percent(usize),
    /// Seconds.
    Seconds,
    /// Bytes as mebibytes.
    Bytes,
}

/// A figure of the text.
pub(crate) struct TextFigure {
    pub(crate) id: &'static str,
    pub(crate) title: &'static str,
    pub(crate) format: Format,
    pub(crate) over: Over,
    pub(crate) read: Read,
}

/// The stage of a run's cost that trains the source.
const SOURCE_STAGE: &str = "source";

/// The value for the Lagrangian model, nothing for the source.
fn lagrangian(model: Model, value: Option<f64>) -> Option<f64> {
    value.filter(|_| model == Model::Lagrangian)
}

/// The figures of the paper's text, and the errors against the truth that only synthetic scenes have.
pub(crate) const TEXT_FIGURES: [TextFigure; 12] = [
    TextFigure {
        id: "extent_ratio_largest",
        title: "foreground extent relative to t = 0, largest to 3 τ_max and over scenes",
        format: Format::Number(3),
        over: Over::Largest,
        read: |m, model| match model {
            Model::Source => m.physics.source_extent_ratio_max,
            Model::Lagrangian => m.physics.extent_ratio_max,
        },
    },
    TextFigure {
        id: "spread_over_truth_largest",
        title: "size of what moves over the truth's, largest to 3 τ_max and over scenes",
        format: Format::Number(3),
        over: Over::Largest,
        read: |m, model| lagrangian(model, m.physics.extent_against_truth.spread_max),
    },
    TextFigure {
        id: "cycle_error_negated_step",
        title: "cycle error, negated step (the paper's reversal)",
        format: Format::Percent(3),
        over: Over::Having,
        read: |m, model| lagrangian(model, m.physics.cycle_error.negated_step),
    },
    TextFigure {
        id: "cycle_error_exact",
        title: "cycle error, exact inverse",
        format: Format::Percent(3),
        over: Over::Having,
        read: |m, model| lagrangian(model, m.physics.cycle_error.exact),
    },
    TextFigure {
        id: "fall_time_exponent",
        title: "exponent of falling time over β, scenes where something falls from rest",
        format: Format::Number(3),
        over: Over::Having,
        read: |m, model| lagrangian(model, m.physics.fall_time_exponent.slope),
    },
    TextFigure {
        id: "fall_time_correlation",
        title: "correlation of that regression",
        format: Format::Number(4),
        over: Over::Having,
        read: |m, model| lagrangian(model, m.physics.fall_time_exponent.r),
    },
    TextFigure {
        id: "psnr_gap",
        title: "PSNR on test, Lagrangian − source, dB",
        format: Format::Signed(2),
        over: Over::Every,
        read: |m, model| lagrangian(model, gap(m, |score| score.psnr)),
    },
    TextFigure {
        id: "silhouette_gap",
        title: "silhouette PSNR on test, Lagrangian − source, dB",
        format: Format::Signed(2),
        over: Over::Having,
        read: |m, model| lagrangian(model, gap(m, |score| score.psnr_silhouette)),
    },
    TextFigure {
        id: "trajectory_error",
        title: "trajectory error at the last time with a truth, over the path",
        format: Format::Percent(2),
        over: Over::Having,
        read: |m, model| lagrangian(model, last_trajectory_error(m)),
    },
    TextFigure {
        id: "energy_drift",
        title: "energy drift to 3 τ_max without Q",
        format: Format::Percent(2),
        over: Over::Having,
        read: |m, model| lagrangian(model, m.physics.energy_drift),
    },
    TextFigure {
        id: "training_time",
        title: "training time; Lagrangian: source included",
        format: Format::Seconds,
        over: Over::Every,
        read: |m, model| match model {
            Model::Source => m.cost.stages.iter().find(|s| s.stage == SOURCE_STAGE).map(|s| s.secs),
            Model::Lagrangian => m.cost.train_secs,
        },
    },
    TextFigure {
        id: "training_memory",
        title: "largest resident set in training",
        format: Format::Bytes,
        over: Over::Largest,
        read: |m, model| {
            let bytes = match model {
                Model::Source => m.cost.stages.iter().find(|s| s.stage == SOURCE_STAGE)?.peak_rss_bytes,
                Model::Lagrangian => m.cost.peak_rss_bytes,
            };
            bytes.map(|bytes| bytes as f64)
        },
    },
];

/// Lagrangian minus source on the test split.
fn gap(metrics: &Metrics, read: fn(&SplitScore) -> Option<f64>) -> Option<f64> {
    let of = |model| split_score(metrics, "test", model).and_then(read);
    Some(of(Model::Lagrangian)? - of(Model::Source)?)
}

/// The error at the latest time that has one.
pub(crate) fn last_trajectory_error(metrics: &Metrics) -> Option<f64> {
    let timed = metrics
        .physics
        .trajectory_error
        .iter()
        .filter_map(|(time, error)| Some((time.parse::<f64>().ok()?, (*error)?)));
    timed.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, error)| error)
}
