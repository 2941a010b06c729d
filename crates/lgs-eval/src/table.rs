//! Metrics as aligned text: one line per split and model, then the motion's figures that exist.

use crate::laws::{law_rows, trusted_edit_rows};
use crate::metrics::{Metrics, Physics, PotentialAgainstTruth, SplitScore};

/// Splits in the order of time, then any others by name.
const SPLIT_ORDER: [&str; 5] = ["train", "val", "test", "long", "past"];

/// Which columns of [`law_rows`] are aligned right: numbers.
const LAW_COLUMNS: [bool; 11] = [false, false, false, false, false, true, false, true, true, true, false];

/// The figures of a run, ready to print; every line ends with a newline.
#[must_use]
pub fn table(metrics: &Metrics) -> String {
    let mut text = aligned(&split_rows(metrics), &[false, false]);
    let physics = physics_rows(metrics);
    if !text.is_empty() && !physics.is_empty() {
        text.push('\n');
    }
    text.push_str(&aligned(&physics, &[false]));
    let laws = law_rows(metrics);
    if !text.is_empty() && !laws.is_empty() {
        text.push('\n');
    }
    text.push_str(&aligned(&laws, &LAW_COLUMNS));
    let edits = trusted_edit_rows(metrics);
    if !edits.is_empty() {
        text.push('\n');
    }
    text.push_str(&aligned(&edits, &[false]));
    text
}

/// Image figures: a header, then one row per split and model; empty without images.
#[must_use]
pub fn split_rows(metrics: &Metrics) -> Vec<Vec<String>> {
    let mut names: Vec<&String> = metrics.splits.keys().collect();
    names.sort_by_key(|name| {
        (SPLIT_ORDER.iter().position(|known| known == name).unwrap_or(SPLIT_ORDER.len()), (*name).clone())
    });
    if names.is_empty() {
        return Vec::new();
    }
    let header = [
        "split",
        "model",
        "PSNR",
        "of mean MSE",
        "foreground",
        "content",
        "silhouette",
        "fitted",
        "SSIM",
        "LPIPS vgg",
        "vgg [0,1]",
        "alex",
        "frames",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for name in names {
        let split = &metrics.splits[name];
        rows.extend(split.source.as_ref().map(|score| score_row(name, "source", score)));
        rows.extend(split.lagrangian.as_ref().map(|score| score_row(name, "lagrangian", score)));
    }
    rows
}

fn score_row(split: &str, model: &str, score: &SplitScore) -> Vec<String> {
    let number =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"));
    let lpips = |value: Option<f64>| value.map_or_else(|| "n/a".to_owned(), |v| format!("{v:.4}"));
    vec![
        split.to_owned(),
        model.to_owned(),
        number(score.psnr, 2),
        number(score.psnr_of_mean_mse, 2),
        number(score.psnr_foreground, 2),
        number(score.psnr_content, 2),
        number(score.psnr_silhouette, 2),
        number(score.psnr_fitted, 2),
        number(score.ssim, 4),
        lpips(score.lpips_vgg),
        lpips(score.lpips_vgg_unnormalised),
        lpips(score.lpips_alex),
        score.frames.to_string(),
    ]
}

/// Names and values of the figures that exist.
#[must_use]
pub fn physics_rows(metrics: &Metrics) -> Vec<Vec<String>> {
    let motion = motion_rows(&metrics.physics).map(named);
    let rows = motion
        .into_iter()
        .chain(trajectory_rows(&metrics.physics))
        .chain(metrics.physics.potential.iter().flat_map(potential_rows).map(named))
        .chain(law_and_cost_rows(metrics).map(named));
    rows.filter_map(|(name, value)| value.map(|v| vec![name, v])).collect()
}

/// A figure: its name, and its value as text if it exists.
type Figure<'a> = (&'a str, Option<String>);

fn named((name, value): Figure<'_>) -> (String, Option<String>) {
    (name.to_owned(), value)
}

fn percent(fraction: Option<f64>) -> Option<String> {
    fraction.map(|v| format!("{:.3} %", 100.0 * v))
}

fn plain(value: Option<f64>) -> Option<String> {
    value.map(|v| format!("{v:.3}"))
}

fn motion_rows(physics: &Physics) -> [Figure<'static>; 7] {
    let (cycle, against) = (&physics.cycle_error, &physics.extent_against_truth);
    let range = |low: Option<f64>, high: Option<f64>| Some(format!("{:.3} .. {:.3}", low?, high?));
    let exact = cycle.exact_without_alignment.map(|v| format!("{:.5} %", 100.0 * v));
    [
        ("cycle error, negated step", percent(cycle.negated_step)),
        ("cycle error, exact inverse", percent(cycle.exact)),
        ("cycle error, exact, no alignment", exact),
        ("extent over t = 0, pixels", range(physics.extent_ratio_min, physics.extent_ratio_max)),
        ("extent over the truth's, pixels", range(against.pixels_min, against.pixels_max)),
        ("extent over the truth's, spread", range(against.spread_min, against.spread_max)),
        ("reach over the truth's", plain(against.reach)),
    ]
}

/// Trajectory errors in the order of time.
fn trajectory_rows(physics: &Physics) -> Vec<(String, Option<String>)> {
    let mut times: Vec<(&String, Option<f64>)> =
        physics.trajectory_error.iter().map(|(t, e)| (t, *e)).collect();
    times.sort_by(|a, b| a.0.parse::<f64>().unwrap_or(0.0).total_cmp(&b.0.parse::<f64>().unwrap_or(0.0)));
    let mut rows: Vec<(String, Option<String>)> = (times.into_iter())
        .map(|(t, error)| (format!("trajectory error at t = {t}"), percent(error)))
        .collect();
    for (split, errors) in &physics.edited_trajectory_error {
        let named =
            |(t, e): (&String, &Option<f64>)| (format!("{split}: trajectory error at t = {t}"), percent(*e));
        rows.extend(errors.iter().map(named));
    }
    rows
}

fn potential_rows(potential: &PotentialAgainstTruth) -> [Figure<'static>; 3] {
    let signed = |error: Option<f64>| error.map(|e| format!("{:+.2} %", 100.0 * e));
    [
        ("size of −∇U against the true", signed(potential.magnitude_error)),
        ("direction of −∇U against the true", potential.direction_error_degrees.map(|d| format!("{d:.2}°"))),
        ("curvature of U against ω²", signed(potential.curvature_error)),
    ]
}

fn law_and_cost_rows(metrics: &Metrics) -> [Figure<'static>; 7] {
    let (physics, fall) = (&metrics.physics, &metrics.physics.fall_time_exponent);
    let fall_text = || Some(format!("{:.4} (r = {:.5})", fall.slope?, fall.r?));
    let memory = metrics.cost.peak_rss_bytes.map(|b| format!("{:.0} MiB", b as f64 / f64::from(1 << 20)));
    [
        ("energy drift, no force", percent(physics.energy_drift)),
        ("fall time exponent", fall_text()),
        ("force over potential gradient", plain(physics.force_ratio)),
        ("corrections of poses", metrics.cameras.map(|sizes| sizes.pose_text())),
        ("corrections of exposures", metrics.cameras.map(|sizes| sizes.exposure_text())),
        ("training", metrics.cost.train_secs.map(|s| format!("{s:.0} s"))),
        ("peak memory", memory),
    ]
}

/// Columns padded to their widest cell, two spaces between; `right` says which are aligned right (default:
/// yes).
#[must_use]
pub fn aligned(rows: &[Vec<String>], right: &[bool]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| {
        rows.iter().filter_map(|row| row.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row
            .iter()
            .enumerate()
            .map(|(c, cell)| {
                let width = widths[c];
                if right.get(c).copied().unwrap_or(true) {
                    format!("{cell:>width$}")
                } else {
                    format!("{cell:<width$}")
                }
            })
            .collect();
        text.push_str(cells.join("  ").trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::SplitMetrics;

    #[test]
    fn splits_come_in_the_order_of_time_and_absent_figures_are_left_out() {
        let mut metrics = Metrics::default();
        let score =
            SplitScore { psnr: Some(31.234), ssim: Some(0.98765), frames: 4, ..SplitScore::default() };
        for name in ["past", "extra", "test", "val"] {
            metrics.splits.insert(name.to_owned(), SplitMetrics { source: None, lagrangian: Some(score) });
        }
        metrics.physics.cycle_error.exact = Some(0.0012);
        let text = table(&metrics);
        let firsts: Vec<&str> = text.lines().filter_map(|line| line.split_whitespace().next()).collect();
        assert_eq!(firsts, ["split", "val", "test", "past", "extra", "cycle"], "{text}");
        assert!(text.contains("31.23") && text.contains("0.9877") && text.contains("0.120 %"), "{text}");
        assert!(
            text.lines().nth(1).is_some_and(|line| line.matches("n/a").count() == 3),
            "no LPIPS without weights: {text}"
        );
    }

    #[test]
    fn columns_line_up() {
        let text = aligned(&[vec!["a".into(), "1".into()], vec!["bbb".into(), "22".into()]], &[false]);
        assert_eq!(text, "a     1\nbbb  22\n");
    }
}
