//! Records of laws against a known motion, and motions under edits.

mod common;

use std::collections::BTreeMap;

use common::{GRAVITY, fallen, falling, truth};
use lgs_data::edit::MotionEdit;
use lgs_data::synth::GroundTruth;
use lgs_dynamics::Reversal;
use lgs_eval::laws::{ObjectLaw, PositionBand, edit_rows};
use lgs_eval::physics::edited::edited_trajectory_errors;
use lgs_eval::table::table;
use lgs_eval::{EvalOptions, Metrics, Subject, evaluate};
use lgs_mechanics::Law;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::coordinates::{Coordinates, Port};
use lgs_mechanics::terms::Term;

/// The law of a fall, with a band of this radius at all times.
fn fall(radius: f64) -> ObjectLaw {
    let field = Term::named("uniform-field", Port::Whole).expect("term");
    let values = vec![0.0, 0.0, -f64::from(GRAVITY)];
    let law = Law::new(Coordinates::Point, vec![field], values, 0.01).expect("law");
    let law = Law { deviations: vec![0.001, 0.001, 0.02], ..law };
    let band = PositionBand { times: vec![0.0, 2.25], radius: vec![Some(radius); 2] };
    ObjectLaw {
        forecast_error: Some(0.012),
        trusted: Some([-0.5, 1.5]),
        band: Some(band),
        ..ObjectLaw::describing(&law, Verdict::Explained)
    }
}

fn measured(truth: &GroundTruth, laws: &[Option<ObjectLaw>]) -> Metrics {
    let scene = falling(0);
    let subject = Subject { scene: &scene, source: None, dataset: None, truth: Some(truth), laws };
    evaluate(&subject, &EvalOptions::default(), &|_, _| {})
}

fn known() -> GroundTruth {
    let law = serde_json::json!({ "expected": "explained", "objects": [] });
    GroundTruth { law, ..truth(&falling(0).dynamic_gaussians.means, fallen) }
}

#[test]
fn a_wide_band_contains_the_truth_and_a_narrow_one_part_of_it() {
    let coverage = |radius| {
        let metrics = measured(&known(), &[Some(fall(radius))]);
        let law = metrics.physics.objects[0].law.clone().expect("a record");
        assert_eq!(law.expected, Some(Verdict::Explained));
        law.coverage.expect("a band and a truth")
    };
    assert_eq!(coverage(1.0), 1.0);
    assert_eq!(coverage(1e-6), 0.0);
    // The integrator is ahead by ½ g h t, 0.01 t: within this radius up to t = 1.1, at 22 of 45 times.
    assert!((coverage(0.0112) - 22.0 / 45.0).abs() < 1e-9, "{}", coverage(0.0112));
    let by_time = measured(&known(), &[Some(fall(0.0112))]).physics.bands.coverage_90;
    let at = |time: &str| by_time[time];
    assert_eq!([at("-0.75"), at("1.0"), at("1.5")], [None, Some(1.0), Some(0.0)], "{by_time:?}");
}

#[test]
fn a_record_stands_in_the_metrics_and_on_the_table() {
    let metrics = measured(&known(), &[Some(fall(1.0))]);
    let text = serde_json::to_string(&metrics).expect("text");
    assert_eq!(serde_json::from_str::<Metrics>(&text).expect("again"), metrics);
    let printed = table(&metrics);
    let row = |word: &str| printed.lines().find(|line| line.contains(word)).expect("a row").to_owned();
    assert!(row("uniform-field").starts_with("0       point"), "{printed}");
    let short = &serde_json::from_str::<serde_json::Value>(&text).expect("JSON")["physics"]["objects"][0];
    assert_eq!((&short["coordinates"], &short["verdict"]), (&"rigid".into(), &"explained".into()));
    assert_eq!((&short["trusted_until"], &short["forecast_error"]), (&1.5.into(), &0.012.into()));
    assert_eq!(short["terms"][0]["values"]["field-z"].as_f64(), Some(-f64::from(GRAVITY)));
    let last = row("-2.000 ± 0.020");
    assert!(last.contains("u/t²") && !last.contains("explained"), "once per object: {printed}");
    let first = row("explained");
    assert!(["1.20 %", "-0.50 .. 1.50", "100 %"].iter().all(|cell| first.contains(cell)), "{printed}");
}

#[test]
fn without_records_the_metrics_have_no_word_of_them() {
    let metrics = measured(&known(), &[]);
    let text = serde_json::to_string(&metrics).expect("text");
    assert!(!text.contains("\"law\"") && !table(&metrics).contains("coordinates"), "{text}");
    assert_eq!(serde_json::from_str::<Metrics>(&text).expect("again"), metrics);
}

#[test]
fn a_verdict_that_the_truth_contradicts_says_so() {
    let law = serde_json::json!({ "expected": "outside" });
    let metrics = measured(&GroundTruth { law, ..known() }, &[Some(fall(1.0))]);
    assert!(table(&metrics).contains("explained (expected outside)"));
}

#[test]
fn an_edit_is_compared_with_its_own_truth() {
    // Half a kick behind, the integrator is at rest at t = 0 and on the parabola at every step.
    let mut scene = falling(0);
    scene.velocities.fill([0.0, 0.0, 0.5 * scene.motion.dt * GRAVITY]);
    let start = &scene.dynamic_gaussians.means;
    let half = truth(start, |[x, y, z], t| [x, y, z - 0.25 * GRAVITY * t * t]);
    let edit = MotionEdit { potential_scale: 0.5, ..MotionEdit::default() };
    let edits: BTreeMap<String, MotionEdit> =
        ["edit-known", "edit-unknown"].map(|name| (name.to_owned(), edit)).into();
    let truths = BTreeMap::from([("edit-known".to_owned(), half)]);
    let errors = edited_trajectory_errors(&scene, Reversal::Exact, &edits, &truths);
    assert_eq!(errors.len(), 1, "an edit without truth has no errors");
    let at_one = errors["edit-known"]["1.0"].expect("an error");
    assert!(at_one < 1e-3, "{at_one}");
    let mut metrics = Metrics::default();
    metrics.physics.edited_trajectory_error = errors;
    let rows = edit_rows(&metrics.physics);
    assert_eq!(rows[0], ["edit", "t = -0.75", "t = 0.75", "t = 1.0", "t = 1.5", "t = 2.25"]);
    assert_eq!((rows[1][0].as_str(), rows.len()), ("edit-known", 2));
    assert!(rows[1][3].starts_with("0.0") && rows[1][3].ends_with(" %"), "{rows:?}");
    assert!(edit_rows(&Metrics::default().physics).is_empty());
}
