//! Systems side by side: source, the variants that are systems of their own, and the full method.

use lgs_eval::Metrics;

use crate::figures::{Format, Model, Over, Read, last_trajectory_error, split_score};
use crate::results::{Results, Summary};
use crate::table::{Entry, Row, Table};
use crate::variants::{FULL, VariantTable};

/// Figures of a system: title, format, reading. Times are of the stages after the source.
const SYSTEM_FIGURES: [(&str, Format, Read); 7] = [
    ("PSNR val", Format::Number(2), |m, model| split_score(m, "val", model)?.psnr),
    ("PSNR test", Format::Number(2), |m, model| split_score(m, "test", model)?.psnr),
    ("PSNR long", Format::Number(2), |m, model| split_score(m, "long", model)?.psnr),
    ("trajectory error", Format::Percent(2), |m, model| {
        last_trajectory_error(m).filter(|_| model == Model::Lagrangian)
    }),
    ("stage 1", Format::Seconds, |m, model| secs(m, model, &["distill"])),
    ("stage 2", Format::Seconds, |m, model| secs(m, model, &["fit-dynamics", "tune-dynamics"])),
    ("stage 3", Format::Seconds, |m, model| secs(m, model, &["refine-gaussians", "tune-gaussians"])),
];

/// Seconds of some stages of the Lagrangian model, 0 where none of them ran; nothing without a record.
fn secs(metrics: &Metrics, model: Model, names: &[&str]) -> Option<f64> {
    let stages = &metrics.cost.stages;
    let own = stages.iter().filter(|stage| names.contains(&stage.stage.as_str()));
    let sum = own.map(|stage| stage.secs).sum();
    (model == Model::Lagrangian && !stages.is_empty()).then_some(sum)
}

/// A system: title, variant, model.
type System<'a> = (&'a str, &'a str, Model);

/// The systems of a suite: source, those of its variants that are some, then the full method; none without
/// such a variant.
fn listed<'a>(results: &Results<'a>) -> Vec<System<'a>> {
    let variants = &results.plan().suite.variants;
    let systems = || variants.iter().filter(|v| v.table == VariantTable::Systems);
    let full = variants.iter().filter(|v| v.name == FULL && systems().next().is_some());
    let source = full.clone().map(|_| ("source", FULL, Model::Source));
    let system = |v: &'a crate::variants::Variant| (v.title.as_str(), v.name.as_str(), Model::Lagrangian);
    source.chain(systems().chain(full).map(system)).collect()
}

fn entries(of: impl Fn(Read) -> Summary) -> Vec<Entry> {
    SYSTEM_FIGURES.map(|(_, format, read)| Entry { summary: of(read), paper: None, format }).to_vec()
}

/// Means over scenes, and every scene by itself.
pub(crate) fn system_tables(results: &Results<'_>) -> [Table; 2] {
    let suite = &results.plan().suite;
    let (mut means, mut scenes) = (Vec::new(), Vec::new());
    for method in &suite.methods {
        for (title, variant, model) in listed(results) {
            let over =
                |read: Read| results.over_scenes(method.name, variant, Over::Having, |m| read(m, model));
            let labels = vec![title.to_owned(), method.title.to_owned()];
            means.push(Row { labels, entries: entries(over) });
        }
    }
    for scene in &suite.scenes {
        for method in &suite.methods {
            for (title, variant, model) in listed(results) {
                let of = |read: Read| results.of_scene(scene, method.name, variant, |m| read(m, model));
                let labels = vec![scene.clone(), title.to_owned(), method.title.to_owned()];
                scenes.push(Row { labels, entries: entries(of) });
            }
        }
    }
    let columns = || SYSTEM_FIGURES.map(|(title, ..)| title.to_owned()).to_vec();
    let title = |words: &str| format!("{}: systems side by side{words}", suite.title);
    let note =
        "Trajectory error: at the last time with a truth, over the path. Stages: seconds after the source.";
    let labels = ["scene", "system", "source"];
    [
        Table::new("systems", title(""), &labels[1..], columns(), means).noted([note.to_owned()]),
        Table::new("systems-by-scene", title(", by scene"), &labels, columns(), scenes),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;
    use crate::suite::Suite;
    use lgs_eval::StageCost;
    use std::path::Path;

    const SUITE: &str = "name = \"s\"\ntitle = \"S\"\nscenes = [\"fan\", \"spring\"]\n\
        methods = [\"defgs\"]\nvariants = [\"networks\", \"terms\"]\nseeds = [0]\n[synthetic]\n";

    #[test]
    fn systems_stand_side_by_side_with_what_their_stages_cost() {
        let suite = Suite::parse(SUITE, "s.toml").expect("suite");
        let plan = Plan::new(suite, Path::new("out"), None).expect("plan");
        let made = |cell: &crate::plan::Cell| {
            let mut metrics = Metrics::default();
            let secs = if cell.variant == "networks" { 90.0 } else { 2.0 };
            metrics.cost.stages = vec![StageCost { stage: "distill".into(), secs, ..StageCost::default() }];
            Some(metrics)
        };
        let results = Results::new(&plan, plan.cells.iter().map(made).collect());
        let [means, scenes] = system_tables(&results);
        let rows: Vec<&str> = means.rows.iter().map(|row| row.labels[0].as_str()).collect();
        assert_eq!(rows, ["source", "networks as published", "terms", "full"]);
        let seconds = |row: usize, column: usize| means.rows[row].entries[column].summary.mean;
        assert_eq!((seconds(0, 4), seconds(1, 4), seconds(1, 5)), (None, Some(90.0), Some(0.0)));
        assert_eq!(
            (scenes.rows.len(), scenes.rows[5].labels[..2].join(" ")),
            (8, "spring networks as published".into())
        );
    }

    #[test]
    fn a_suite_without_other_systems_has_no_such_table() {
        let text = SUITE.replace("variants = [\"networks\", \"terms\"]\n", "");
        let plan =
            Plan::new(Suite::parse(&text, "s.toml").expect("suite"), Path::new("out"), None).expect("plan");
        let results = Results::new(&plan, plan.cells.iter().map(|_| None).collect());
        assert!(system_tables(&results).iter().all(|table| table.rows.is_empty()));
    }
}
