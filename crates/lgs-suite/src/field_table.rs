//! A suite's PSNR beside that of the field, scene by scene, with the protocol of every row.

use crate::field::{Field, Quoted};
use crate::figures::{Format, Model, split_score};
use crate::methods::Method;
use crate::results::{Results, Summary};
use crate::rows::{Side, common_notes};
use crate::table::{Entry, Row, Table};
use crate::variants::FULL;

/// Decimals of PSNR, as published.
const DIGITS: usize = 2;

/// The table; without rows where the suite quotes nobody.
pub(crate) fn field_table(results: &Results<'_>) -> Table {
    let suite = &results.plan().suite;
    let columns = suite.scenes.iter().cloned().chain(["mean".to_owned()]).collect();
    let mut rows = Vec::new();
    let mut notes = Vec::new();
    if let Some(field) = &suite.field {
        rows.extend(field.quoted.iter().map(|quoted| quoted_row(quoted, &suite.scenes)));
        for method in &suite.methods {
            rows.extend(
                [Model::Source, Model::Lagrangian].map(|model| own_row((results, field), method, model)),
            );
        }
        notes.push("PSNR in dB, mean over the images of a scene.".to_owned());
        notes.extend(
            field
                .splits
                .iter()
                .map(|(scene, split)| format!("`{scene}` is measured on its split `{split}`.")),
        );
    }
    let title = format!("{}: beside the field", suite.title);
    Table::new("field", title, &["method", "protocol"], columns, rows)
        .noted(notes)
        .noted(common_notes(results))
}

fn quoted_row(quoted: &Quoted, scenes: &[String]) -> Row {
    let known = scenes.iter().map(|scene| quoted.psnr.get(scene).copied()).collect();
    Row {
        labels: vec![format!("{}, published", quoted.method), quoted.protocol.clone()],
        entries: with_mean(known),
    }
}

/// Figures of all scenes, and their mean if none is missing.
fn with_mean(figures: Vec<Option<f64>>) -> Vec<Entry> {
    let all: Option<Vec<f64>> = figures.iter().copied().collect();
    let mean = all.map(|all| all.iter().sum::<f64>() / all.len().max(1) as f64);
    let entry = |mean| Entry {
        summary: Summary { mean, ..Summary::default() },
        paper: None,
        format: Format::Number(DIGITS),
    };
    figures.into_iter().chain([mean]).map(entry).collect()
}

fn own_row((results, field): (&Results<'_>, &Field), method: &Method, model: Model) -> Row {
    let of_scene = |scene: &String| {
        let split = field.split_of(scene);
        results.of_scene(scene, method.name, FULL, |m| split_score(m, split, model)?.psnr).mean
    };
    Row {
        labels: vec![Side::Of(model).label(method.title), field.protocol.clone()],
        entries: with_mean(results.plan().suite.scenes.iter().map(of_scene).collect()),
    }
}
