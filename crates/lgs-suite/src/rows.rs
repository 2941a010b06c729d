//! What rows of tables share: the models that they are about, their scores, and the notes below.

use lgs_eval::Metrics;

use crate::figures::{Format, Model, Over, PUBLISHED_SCORE, Read, TEST_SCORES};
use crate::published::{self, Published};
use crate::results::Results;
use crate::table::Entry;

/// The subject of a row: one of the two models, or their difference.
#[derive(Clone, Copy)]
pub(crate) enum Side {
    Of(Model),
    Difference,
}

impl Side {
    pub(crate) const ALL: [Self; 3] =
        [Self::Of(Model::Source), Self::Of(Model::Lagrangian), Self::Difference];

    /// Its label for a method.
    pub(crate) fn label(self, method: &str) -> String {
        match self {
            Self::Of(Model::Source) => method.to_owned(),
            Self::Of(Model::Lagrangian) => format!("Lagrangian ({method})"),
            Self::Difference => "difference".to_owned(),
        }
    }

    /// The format of its figures.
    pub(crate) fn format(self, digits: usize) -> Format {
        match self {
            Self::Of(_) => Format::Number(digits),
            Self::Difference => Format::Signed(digits),
        }
    }

    pub(crate) fn read(self, metrics: &Metrics, read: Read) -> Option<f64> {
        match self {
            Self::Of(model) => read(metrics, model),
            Self::Difference => Some(read(metrics, Model::Lagrangian)? - read(metrics, Model::Source)?),
        }
    }

    /// The paper's scores.
    fn published(self, column: Published, method: &str, variant: &str) -> Option<published::Scores> {
        let of = |model| published::scores(column, method, variant, model);
        match self {
            Self::Of(model) => of(model),
            Self::Difference => {
                let (lagrangian, source) = (of(Model::Lagrangian)?, of(Model::Source)?);
                Some(std::array::from_fn(|i| lagrangian[i] - source[i]))
            }
        }
    }
}

/// Scores on the test split of one side of a method's variant.
pub(crate) fn test_entries(results: &Results<'_>, method: &str, variant: &str, side: Side) -> Vec<Entry> {
    let scores = results.plan().suite.published.and_then(|column| side.published(column, method, variant));
    let entry = |(i, &(_, _, digits, read)): (usize, &(&str, &str, usize, Read))| Entry {
        summary: results.over_scenes(method, variant, Over::Every, |m| side.read(m, read)),
        paper: PUBLISHED_SCORE[i].and_then(|score| scores.map(|scores| scores[score])),
        format: side.format(digits),
    };
    TEST_SCORES.iter().enumerate().map(entry).collect()
}

pub(crate) fn test_columns() -> Vec<String> {
    TEST_SCORES.iter().map(|(_, title, _, _)| (*title).to_owned()).collect()
}

/// The notes that belong below every table.
pub(crate) fn common_notes(results: &Results<'_>) -> Vec<String> {
    let plan = results.plan();
    let (done, all, seeds) = (results.done(), plan.cells.len(), plan.suite.seeds.len());
    let mut notes = vec![match seeds {
        1 => "Mean over scenes; one seed, so no spread.".to_owned(),
        _ => format!(
            "Mean over scenes, then over {seeds} seeds; ± is the sample standard deviation over seeds."
        ),
    }];
    let scored_otherwise = results.scored_otherwise();
    if scored_otherwise > 0 {
        notes.push(format!(
            "{scored_otherwise} runs were measured at another resolution than the suite's: \
            remove their metrics.json."
        ));
    }
    if done < all {
        notes.push(format!("{done} of {all} runs are done; n/a where a scene or a seed is missing."));
    }
    notes
}
