//! Tables of hand-made metrics.

use std::path::Path;

use lgs_eval::{Metrics, SplitMetrics, SplitScore};
use lgs_suite::{Cell, Plan, Results, Suite, Table, all_tables, table_text};

const SUITE: &str = "name = \"s\"\ntitle = \"S\"\nscenes = [\"fan\", \"spring\"]\nmethods = [\"defgs\"]\n\
    variants = [\"before-0.5\", \"without-stage-3\"]\nseeds = [0, 1]\n[synthetic]\n";

fn plan(text: &str) -> Plan {
    Plan::new(Suite::parse(text, "s.toml").expect("suite"), Path::new("out"), None).expect("plan")
}

fn score(psnr: f64) -> Option<SplitScore> {
    Some(SplitScore {
        psnr: Some(psnr),
        psnr_of_mean_mse: Some(psnr - 1.0),
        ssim: Some(0.9),
        ..SplitScore::default()
    })
}

/// Sources at 20 dB; Lagrangian models at 30, 1 more on `spring`, 2 more with seed 1, 3 less without stage 3.
fn made(cell: &Cell) -> Metrics {
    let more = if cell.scene == "spring" { 1.0 } else { 0.0 } + if cell.seed == 1 { 2.0 } else { 0.0 };
    let less = if cell.variant == "without-stage-3" { 3.0 } else { 0.0 };
    let mut metrics = Metrics::default();
    metrics
        .splits
        .insert("test".into(), SplitMetrics { source: score(20.0), lagrangian: score(30.0 + more - less) });
    metrics.physics.cycle_error.negated_step = Some(0.013);
    metrics.physics.extent_ratio_max = Some(1.0 + 0.1 * more);
    if cell.scene == "fan" {
        metrics.physics.fall_time_exponent.slope = Some(-0.5);
    }
    metrics.cost.train_secs = Some(60.0);
    metrics
}

fn tables(plan: &Plan, is_done: impl Fn(&Cell) -> bool) -> Vec<Table> {
    all_tables(&Results::new(plan, plan.cells.iter().map(|cell| is_done(cell).then(|| made(cell))).collect()))
}

fn table<'a>(tables: &'a [Table], id: &str) -> &'a Table {
    tables.iter().find(|table| table.id == id).expect(id)
}

fn close(found: Option<f64>, expected: f64) -> bool {
    found.is_some_and(|found| (found - expected).abs() < 1e-9)
}

#[test]
fn means_go_over_scenes_then_seeds() {
    let plan = plan(SUITE);
    let tables = tables(&plan, |_| true);
    assert_eq!(
        tables.iter().map(|t| t.id).collect::<Vec<_>>(),
        ["extrapolation", "windows", "ablations", "figures", "splits", "scenes"]
    );
    let rows = &table(&tables, "extrapolation").rows;
    let labels: Vec<&str> = rows.iter().map(|row| row.labels[0].as_str()).collect();
    assert_eq!(labels, ["DefGS", "Lagrangian (DefGS)", "difference"]);
    let lagrangian = rows[1].entries[0].summary;
    assert!(
        close(lagrangian.mean, 31.5) && close(lagrangian.spread, 2.0_f64.sqrt()) && lagrangian.seeds == 2,
        "{lagrangian:?}"
    );
    assert!(close(rows[2].entries[0].summary.mean, 11.5));
    assert_eq!(rows[1].entries[4].summary.mean, None, "no LPIPS, no number");
    assert_eq!(rows[1].entries[0].paper, None);
    let ablation = &table(&tables, "ablations").rows[1];
    let change = ablation.entries[5].summary;
    assert!(close(change.mean, -3.0) && close(change.spread, 0.0), "paired by scene and seed: {change:?}");
    let figures = table(&tables, "figures");
    let of = |words: &str| {
        figures.rows.iter().find(|row| row.labels[0].contains(words)).expect(words).entries[1].summary
    };
    assert!(close(of("exponent").mean, -0.5), "only scenes that have it");
    assert!(
        close(of("extent").mean, (1.1 + 1.3) / 2.0),
        "largest over scenes, mean over seeds: {:?}",
        of("extent")
    );
    assert_eq!(of("silhouette").mean, None);
}

#[test]
fn an_incomplete_set_is_missing_and_says_so() {
    let plan = plan(SUITE);
    let without_one = tables(&plan, |cell| cell.name() != "spring/defgs/full/seed-1");
    let extrapolation = table(&without_one, "extrapolation");
    let found = extrapolation.rows[1].entries[0].summary;
    assert!(
        close(found.mean, 30.5) && found.spread.is_none() && found.seeds == 1,
        "seed 0 alone is complete: {found:?}"
    );
    assert!(extrapolation.notes.iter().any(|note| note.contains("11 of 12")), "{:?}", extrapolation.notes);
    let none = tables(&plan, |_| false);
    assert!(
        table_text::markdown(table(&none, "extrapolation"))
            .contains("| DefGS | n/a | n/a | n/a | n/a | n/a |")
    );
    assert!(none.iter().all(|table| table.id != "scenes"), "no split was scored");
}

#[test]
fn published_suites_have_the_papers_numbers_beside() {
    let text = SUITE.replace("seeds", "published = \"objects\"\nseeds");
    let plan = plan(&text);
    let tables = tables(&plan, |_| true);
    let extrapolation = table(&tables, "extrapolation");
    assert!(extrapolation.published);
    let row = |label: &str| extrapolation.rows.iter().find(|row| row.labels[0] == label).expect(label);
    assert_eq!(row("NVFi").entries[1].paper, Some(27.594));
    assert_eq!(row("NVFi").entries[1].summary.mean, None);
    assert_eq!(row("Lagrangian (DefGS)").entries[2].paper, Some(0.965));
    assert!(close(row("difference").entries[1].paper, 5.051));
    assert!(!table(&tables, "splits").published, "the paper has no such table");
}

#[test]
fn every_format_holds_the_numbers() {
    let plan = plan(SUITE);
    let tables = tables(&plan, |_| true);
    let extrapolation = table(&tables, "extrapolation");
    let markdown = table_text::markdown(extrapolation);
    assert!(
        markdown
            .contains("| Lagrangian (DefGS) | 31.500 ± 1.414 | 30.500 ± 1.414 | 0.900 ± 0.000 | n/a | n/a |"),
        "{markdown}"
    );
    let widths: Vec<usize> =
        markdown.lines().filter(|line| line.starts_with('|')).map(|line| line.matches('|').count()).collect();
    assert!(widths.iter().all(|w| *w == widths[0]), "{widths:?}");
    let csv = table_text::csv(extrapolation);
    assert!(csv.starts_with("method,PSNR,PSNR spread,PSNR seeds,PSNR paper,"), "{csv}");
    let commas: Vec<usize> = csv.lines().map(|line| line.matches(',').count()).collect();
    assert!(commas.iter().all(|c| *c == commas[0]), "{commas:?}");
    let latex = table_text::latex(table(&tables, "windows"));
    assert!(latex.contains("t $<$ 0.5 & Lagrangian (DefGS) & 31.500 $\\pm$ 1.414"), "{latex}");
    let json = table_text::json("s", &tables);
    let first = &json["tables"][0]["rows"][1]["entries"];
    assert_eq!(first[0]["mean"], 31.5);
    assert!(first[3]["mean"].is_null() && first[0]["paper"].is_null());
}

#[test]
fn published_figures_stand_beside_ours_with_the_protocol_of_both() {
    let field = "[field]\nprotocol = \"160², white\"\nsplit = \"val\"\nsplits = { spring = \"test\" }\n\
        [[field.quoted]]\nmethod = \"NeRF\"\nprotocol = \"800², white\"\npsnr = { fan = 30.5 }\n";
    let plan = plan(&format!("{SUITE}{field}"));
    let tables = tables(&plan, |cell| cell.variant == "full");
    let table = table(&tables, "field");
    assert_eq!(table.columns, ["fan", "spring", "mean"]);
    let mean = |row: usize, column: usize| table.rows[row].entries[column].summary.mean;
    assert_eq!(table.rows[0].labels, ["NeRF, published", "800², white"]);
    assert_eq!([0, 1, 2].map(|column| mean(0, column)), [Some(30.5), None, None], "no mean of a part");
    assert_eq!(table.rows[2].labels, ["Lagrangian (DefGS)", "160², white"]);
    assert_eq!(mean(2, 0), None, "`fan` was not scored on `val`");
    assert!(close(mean(2, 1), 32.0));
    assert!(table_text::markdown(table).contains("`spring` is measured on its split `test`"));
    let error = Suite::parse(&format!("{SUITE}{}", field.replace("fan", "fans")), "s.toml");
    assert!(error.expect_err("unknown").to_string().contains("`fans`"));
}
