//! Tables of what each part of a system brings: the paper's Table 3, of the full method and of the paper's
//! networks.

use crate::figures::{Format, Model, TEST_SCORES};
use crate::results::{Results, Summary};
use crate::rows::{Side, common_notes, test_columns, test_entries};
use crate::table::{Entry, Row, Table};
use crate::thresholds::NO_CHANGE;
use crate::variants::{FULL, PUBLISHED, Variant, VariantTable};

/// The paper's Table 3 of the full method.
pub(crate) fn ablations(results: &Results<'_>) -> Table {
    let words = ("ablations", "ablations of the Lagrangian model");
    without_parts(results, (VariantTable::Ablations, FULL), words)
}

/// The paper's Table 3 to the letter: parts left out of its networks.
pub(crate) fn parts_of_networks(results: &Results<'_>) -> Table {
    let words = ("networks", "parts of the networks as published");
    without_parts(results, (VariantTable::Networks, PUBLISHED), words)
}

/// Variants of a table that leave out parts of a system, below that system; none if it has no variants.
fn without_parts(
    results: &Results<'_>,
    (table, whole): (VariantTable, &str),
    (id, words): (&'static str, &str),
) -> Table {
    let suite = &results.plan().suite;
    let (_, _, _, psnr) = TEST_SCORES[0];
    let belongs = |v: &&Variant| v.table == table && v.name != whole;
    let parts: Vec<&Variant> = suite.variants.iter().filter(belongs).collect();
    let shown = suite.variants.iter().filter(|v| v.name == whole && !parts.is_empty());
    let variants: Vec<&Variant> = shown.chain(parts.iter().copied()).collect();
    let (mut rows, mut notes) = (Vec::new(), common_notes(results));
    for method in &suite.methods {
        for variant in &variants {
            let mut entries = test_entries(results, method.name, &variant.name, Side::Of(Model::Lagrangian));
            let pair = (variant.name.as_str(), whole);
            let change = results.difference(method.name, pair, |m| psnr(m, Model::Lagrangian));
            entries.push(Entry { summary: change, paper: None, format: Format::Signed(3) });
            notes.extend(if variant.name == whole { None } else { remark(variant, method.title, change) });
            rows.push(Row {
                labels: vec![variant.title.clone(), format!("Lagrangian ({})", method.title)],
                entries,
            });
        }
    }
    let mut columns = test_columns();
    columns.push("PSNR − full".to_owned());
    let title = format!("{}: {words}", suite.title);
    Table::new(id, title, &["variant", "method"], columns, rows).noted(notes)
}

/// Says where a variant costs nothing, and why that may be.
fn remark(variant: &Variant, method: &str, change: Summary) -> Option<String> {
    let loss = -change.mean?;
    let within = change.spread.unwrap_or(0.0).max(NO_CHANGE);
    let why = if variant.remark.is_empty() { String::new() } else { format!(": {}", variant.remark) };
    (loss <= within)
        .then(|| format!("{} ({method}): no loss beyond the spread of seeds{why}.", variant.title))
}
