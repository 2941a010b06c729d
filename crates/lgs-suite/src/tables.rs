//! The tables of a suite: the paper's Tables 1, 2 and 3, the figures of its text, and every split and scene.

use lgs_eval::Metrics;

pub use crate::figures::Format;
pub use crate::table::{Entry, Row, Table};

use crate::field_table::field_table;
use crate::figures::{Model, Over, PUBLISHED_SCORE, TEST_SCORES, TEXT_FIGURES, split_score};
use crate::law_tables::law_tables;
use crate::part_tables::{ablations, parts_of_networks};
use crate::published;
use crate::results::{Results, Summary};
use crate::rows::{Side, common_notes, test_columns, test_entries};
use crate::system_tables::system_tables;
use crate::variants::{FULL, Variant, VariantTable};

/// All tables of a suite that have rows.
#[must_use]
pub fn all_tables(results: &Results<'_>) -> Vec<Table> {
    let [laws, no_laws] = law_tables(results);
    let [systems, systems_by_scene] = system_tables(results);
    let tables = [
        field_table(results),
        extrapolation(results),
        windows(results),
        ablations(results),
        systems,
        systems_by_scene,
        parts_of_networks(results),
        figures(results),
        splits(results),
        scenes(results),
        laws,
        no_laws,
    ];
    tables.into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// The paper's Table 1.
fn extrapolation(results: &Results<'_>) -> Table {
    let suite = &results.plan().suite;
    let quoted = suite.published.into_iter().flat_map(published::others).map(|(name, scores)| Row {
        labels: vec![name.to_owned()],
        entries: (PUBLISHED_SCORE.iter().zip(&TEST_SCORES))
            .map(|(score, &(_, _, digits, _))| Entry {
                summary: Summary::default(),
                paper: score.map(|score| scores[score]),
                format: Format::Number(digits),
            })
            .collect(),
    });
    let own = suite.methods.iter().flat_map(|method| {
        Side::ALL.map(|side| Row {
            labels: vec![side.label(method.title)],
            entries: test_entries(results, method.name, FULL, side),
        })
    });
    let rows = quoted.chain(own).collect();
    let title = format!("{}: short-term extrapolation (test, after the captured window)", suite.title);
    Table::new("extrapolation", title, &["method"], test_columns(), rows).noted(common_notes(results))
}

/// The paper's Table 2.
fn windows(results: &Results<'_>) -> Table {
    let suite = &results.plan().suite;
    let variants: Vec<&Variant> =
        suite.variants.iter().filter(|v| v.table == VariantTable::Windows).collect();
    let full = suite.variants.iter().find(|v| v.name == FULL).filter(|_| !variants.is_empty());
    let rows = full.into_iter().chain(variants).flat_map(|variant| {
        suite.methods.iter().flat_map(move |method| {
            Side::ALL.map(|side| Row {
                labels: vec![variant.title.clone(), side.label(method.title)],
                entries: test_entries(results, method.name, &variant.name, side),
            })
        })
    });
    let title = format!("{}: truncated training windows, same test split", suite.title);
    Table::new("windows", title, &["window", "method"], test_columns(), rows.collect())
        .noted(common_notes(results))
}

/// The figures of the paper's text.
fn figures(results: &Results<'_>) -> Table {
    let suite = &results.plan().suite;
    let models = [Model::Source, Model::Lagrangian];
    let columns = suite
        .methods
        .iter()
        .flat_map(|method| models.map(|model| Side::Of(model).label(method.title)))
        .collect();
    let row = |figure: &crate::figures::TextFigure| Row {
        labels: vec![figure.title.to_owned()],
        entries: (suite.methods.iter().flat_map(|method| models.map(|model| (method, model))))
            .map(|(method, model)| Entry {
                summary: results.over_scenes(method.name, FULL, figure.over, |m| (figure.read)(m, model)),
                paper: suite
                    .published
                    .and_then(|column| published::text_figure(column, method.name, figure.id, model)),
                format: figure.format,
            })
            .collect(),
    };
    let title = format!("{}: figures of the motion and of training", suite.title);
    Table::new("figures", title, &["figure"], columns, TEXT_FIGURES.iter().map(row).collect())
        .noted(common_notes(results))
}

/// Splits that a dataset may have, in the order of time.
const SPLITS: [&str; 4] = ["val", "test", "long", "past"];

/// The splits that were scored.
fn known_splits(results: &Results<'_>) -> Vec<&'static str> {
    SPLITS.into_iter().filter(|split| results.has_split(split)).collect()
}

/// A table with a column per split; none without a split.
fn by_split(
    id: &'static str,
    title: String,
    labels: &[&'static str],
    splits: &[&str],
    rows: Vec<Row>,
) -> Table {
    let rows = if splits.is_empty() { Vec::new() } else { rows };
    Table::new(id, title, labels, splits.iter().map(|split| (*split).to_owned()).collect(), rows)
}

/// PSNR on every split.
fn splits(results: &Results<'_>) -> Table {
    let (suite, known) = (&results.plan().suite, known_splits(results));
    let of = |method: &str, side: Side, split: &&str| {
        let summary = results.over_scenes(method, FULL, Over::Every, split_psnr(split, side));
        Entry { summary, paper: None, format: side.format(2) }
    };
    let mut rows = Vec::new();
    for method in &suite.methods {
        for side in Side::ALL {
            let entries = known.iter().map(|split| of(method.name, side, split)).collect();
            rows.push(Row { labels: vec![side.label(method.title)], entries });
        }
    }
    by_split("splits", format!("{}: PSNR by split, dB", suite.title), &["method"], &known, rows)
        .noted(common_notes(results))
}

/// PSNR of every scene.
fn scenes(results: &Results<'_>) -> Table {
    let (suite, known) = (&results.plan().suite, known_splits(results));
    let of = |scene: &str, method: &str, side: Side, split: &&str| {
        let summary = results.of_scene(scene, method, FULL, split_psnr(split, side));
        Entry { summary, paper: None, format: side.format(2) }
    };
    let mut rows = Vec::new();
    for scene in &suite.scenes {
        for method in &suite.methods {
            for side in [Model::Source, Model::Lagrangian].map(Side::Of) {
                let entries = known.iter().map(|split| of(scene, method.name, side, split)).collect();
                rows.push(Row { labels: vec![scene.clone(), side.label(method.title)], entries });
            }
        }
    }
    by_split(
        "scenes",
        format!("{}: PSNR by scene and split, dB", suite.title),
        &["scene", "method"],
        &known,
        rows,
    )
}

/// PSNR of one side on a split.
fn split_psnr(split: &str, side: Side) -> impl Fn(&Metrics) -> Option<f64> {
    move |metrics| {
        let of = |model| split_score(metrics, split, model)?.psnr;
        match side {
            Side::Of(model) => of(model),
            Side::Difference => Some(of(Model::Lagrangian)? - of(Model::Source)?),
        }
    }
}
