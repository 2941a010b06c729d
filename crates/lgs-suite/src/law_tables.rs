//! Tables of the laws that scenes found: verdicts, bands and edits by scene.

use lgs_eval::laws::{ObjectLaw, is_right};
use lgs_eval::{Metrics, Verdict};

use crate::figures::{Format, Over, last_trajectory_error};
use crate::results::Results;
use crate::table::{Entry, Row, Table};
use crate::variants::FULL;

/// Reads a figure of a run's laws.
type ReadLaw = fn(&Metrics) -> Option<f64>;

/// Figures of a run's laws: title, decimals of a percentage, reading.
const LAW_FIGURES: [(&str, usize, ReadLaw); 6] = [
    ("right verdicts", 0, |m| share(laws(m), |law| Some(is_right(law.verdict, law.expected?)))),
    ("explained", 0, |m| share(laws(m), |law| Some(law.verdict == Verdict::Explained))),
    ("forecast error", 2, |m| mean(laws(m).filter_map(|law| law.forecast_error))),
    ("in 90 % band", 0, |m| mean(laws(m).filter_map(|law| law.coverage))),
    ("trajectory error", 2, last_trajectory_error),
    ("edits, t = 1", 2, |m| {
        mean(m.physics.edited_trajectory_error.values().filter_map(|by_time| *by_time.get("1.0")?))
    }),
];

fn laws(metrics: &Metrics) -> impl Iterator<Item = &ObjectLaw> {
    metrics.physics.objects.iter().filter_map(|object| object.law.as_ref())
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Fraction of the laws of which something holds, among those of which it is known.
fn share<'a>(
    laws: impl Iterator<Item = &'a ObjectLaw>,
    holds: impl Fn(&ObjectLaw) -> Option<bool>,
) -> Option<f64> {
    mean(laws.filter_map(holds).map(|yes| f64::from(u8::from(yes))))
}

/// Whether the scene of a run is expected to have a law; nothing without a record or without a truth.
fn is_in_class(metrics: &Metrics) -> Option<bool> {
    laws(metrics).find_map(|law| law.expected).map(|expected| expected == Verdict::Explained)
}

/// The laws of scenes that have one, and of those that have none.
pub(crate) fn law_tables(results: &Results<'_>) -> [Table; 2] {
    [
        of_class(results, ("laws", "laws of scenes that have one"), |in_class| in_class != Some(false)),
        of_class(results, ("no-laws", "scenes that no law explains"), |in_class| in_class == Some(false)),
    ]
}

fn of_class(
    results: &Results<'_>,
    (id, title): (&'static str, &str),
    belongs: fn(Option<bool>) -> bool,
) -> Table {
    let suite = &results.plan().suite;
    let of = |read: ReadLaw| {
        move |m: &Metrics| (laws(m).next().is_some() && belongs(is_in_class(m))).then(|| read(m)).flatten()
    };
    let mut rows = Vec::new();
    for method in &suite.methods {
        let all = LAW_FIGURES.map(|(_, digits, read)| {
            (results.over_scenes(method.name, FULL, Over::Having, of(read)), digits)
        });
        let by_scene = suite.scenes.iter().map(|scene| {
            let one = |(_, digits, read)| (results.of_scene(scene, method.name, FULL, of(read)), digits);
            (scene.clone(), LAW_FIGURES.map(one))
        });
        let named = std::iter::once(("all".to_owned(), all)).chain(by_scene);
        let known = named.filter(|(_, figures)| figures.iter().any(|(summary, _)| summary.mean.is_some()));
        rows.extend(known.map(|(scene, figures)| {
            Row {
                labels: vec![scene, method.title.to_owned()],
                entries: figures
                    .map(|(summary, digits)| Entry { summary, paper: None, format: Format::Percent(digits) })
                    .to_vec(),
            }
        }));
    }
    let columns = LAW_FIGURES.map(|(title, ..)| title.to_owned()).to_vec();
    let note = "Verdicts: fractions of objects. Errors over displacement or path: of blocked forecasts, at \
        the last time with a truth, and under edits.";
    Table::new(id, format!("{}: {title}", suite.title), &["scene", "source"], columns, rows)
        .noted([note.to_owned()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;
    use crate::suite::Suite;
    use lgs_eval::ObjectSummary;
    use std::path::Path;

    const SUITE: &str = "name = \"s\"\ntitle = \"S\"\nscenes = [\"kepler\", \"led\"]\nmethods = [\"defgs\"]\n\
        seeds = [0]\n[synthetic]\n";

    fn run(expected: Verdict, coverage: f64) -> Metrics {
        let law = ObjectLaw {
            verdict: Verdict::Explained,
            expected: Some(expected),
            coverage: Some(coverage),
            ..ObjectLaw::default()
        };
        let mut metrics = Metrics::default();
        metrics.physics.objects = vec![ObjectSummary { law: Some(law), ..ObjectSummary::default() }];
        metrics.physics.trajectory_error.insert("2.25".into(), Some(0.02));
        metrics
    }

    fn plan() -> Plan {
        Plan::new(Suite::parse(SUITE, "s.toml").expect("suite"), Path::new("out"), None).expect("plan")
    }

    #[test]
    fn scenes_with_and_without_a_law_stand_apart() {
        let plan = plan();
        let made = |cell: &crate::plan::Cell| match cell.scene.as_str() {
            "kepler" => run(Verdict::Explained, 0.9),
            _ => run(Verdict::Outside, 0.5),
        };
        let results = Results::new(&plan, plan.cells.iter().map(|cell| Some(made(cell))).collect());
        let [with, without] = law_tables(&results);
        let labels = |t: &Table| t.rows.iter().map(|row| row.labels[0].clone()).collect::<Vec<_>>();
        assert_eq!(
            (labels(&with), labels(&without)),
            (vec!["all".into(), "kepler".into()], vec!["all".into(), "led".into()])
        );
        let right = |t: &Table| t.rows[0].entries[0].summary.mean;
        assert_eq!((right(&with), right(&without)), (Some(1.0), Some(0.0)));
        assert_eq!(
            (with.rows[0].entries[3].summary.mean, with.rows[1].entries[4].summary.mean),
            (Some(0.9), Some(0.02))
        );
    }

    #[test]
    fn without_records_there_are_no_rows() {
        let plan = plan();
        let results = Results::new(&plan, plan.cells.iter().map(|_| Some(Metrics::default())).collect());
        assert!(law_tables(&results).iter().all(|table| table.rows.is_empty()));
    }
}
