//! `report.html`: the figures of a run on one page that needs nothing else, with charts drawn as SVG.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::metrics::{FrameMetrics, FrameModelScore, Metrics};
use crate::table::{physics_rows, split_rows};

/// Width and height of a chart, pixels.
const SIZE: [f64; 2] = [640.0, 260.0];

/// Space for the labels left of and below a chart.
const LABELS: [f64; 2] = [48.0, 36.0];

/// Labelled positions on an axis.
const TICKS: usize = 5;

/// Colours of series, in order.
const COLOURS: [&str; 4] = ["#b3541e", "#1f5fa8", "#3a7d44", "#7a4fa0"];

/// A line of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Points `(x, y)` in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
}

/// The page; `training` is PSNR by step of every stage that renders.
#[must_use]
pub fn html(title: &str, metrics: &Metrics, training: &[Series]) -> String {
    let style = "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}table{border-collapse:collapse}\
                 td,th{padding:.2em .8em;text-align:right;border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}\
                 svg{display:block;margin:1em 0;font:12px sans-serif}";
    let title = escaped(title);
    let mut page = format!("<!doctype html>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n<style>{style}</style>\n<h1>{title}</h1>\n");
    page.push_str(&table(&split_rows(metrics), true));
    page.push_str(&chart("PSNR by time, all splits (dB)", &psnr_by_time(metrics)));
    page.push_str("<h2>Motion</h2>\n");
    page.push_str(&table(&physics_rows(metrics), false));
    page.push_str(&chart("PSNR of training images by step (dB)", training));
    page
}

fn table(rows: &[Vec<String>], header: bool) -> String {
    let mut text = String::from("<table>\n");
    for (index, row) in rows.iter().enumerate() {
        let tag = if header && index == 0 { "th" } else { "td" };
        let cells: String = row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
        text.push_str(&format!("<tr>{cells}</tr>\n"));
    }
    text + "</table>\n"
}

/// Mean PSNR over all images of a time, for both models.
fn psnr_by_time(metrics: &Metrics) -> Vec<Series> {
    let series = |name: &str, pick: &dyn Fn(&FrameMetrics) -> Option<FrameModelScore>| {
        let mut by_time: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
        for frame in metrics.frames.values().flatten() {
            let Some(psnr) = pick(frame).and_then(|score| score.psnr) else { continue };
            // A key in millionths, because floats have no order of their own.
            let sums = by_time.entry((f64::from(frame.time) * 1e6).round() as i64).or_default();
            *sums = (sums.0 + psnr, sums.1 + 1.0);
        }
        Series { name: name.to_owned(), points: by_time.into_iter().map(|(t, (sum, n))| (t as f64 / 1e6, sum / n)).collect() }
    };
    vec![series("source", &|f| f.source), series("lagrangian", &|f| Some(f.lagrangian))]
}

/// A line chart; empty without two finite points.
fn chart(title: &str, series: &[Series]) -> String {
    let points = || series.iter().flat_map(|s| &s.points).filter(|(x, y)| x.is_finite() && y.is_finite());
    if points().count() < 2 {
        return String::new();
    }
    let x = Axis::over(points().map(|p| p.0), LABELS[0], SIZE[0] - 12.0);
    let y = Axis::over(points().map(|p| p.1), SIZE[1] - LABELS[1], 12.0);
    let mut svg = format!("<h2>{}</h2>\n<svg width=\"{}\" height=\"{}\" role=\"img\">\n", escaped(title), SIZE[0], SIZE[1]);
    for i in 0..=TICKS {
        let (tx, ty) = (x.tick(i), y.tick(i));
        let (px, py) = (x.pixel(tx), y.pixel(ty));
        // Writing into a string does not fail.
        let _ = writeln!(svg, "<text x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>", SIZE[1] - 18.0, x.label(tx));
        let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", LABELS[0] - 6.0, py + 4.0, y.label(ty));
        let _ = writeln!(svg, "<line x1=\"{}\" x2=\"{}\" y1=\"{py:.1}\" y2=\"{py:.1}\" stroke=\"#ddd\"/>", LABELS[0], SIZE[0] - 12.0);
    }
    for (index, line) in series.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let finite = line.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        let path: String = finite.map(|&(px, py)| format!("{:.1},{:.1} ", x.pixel(px), y.pixel(py))).collect();
        let _ = writeln!(svg, "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"/>", path.trim_end());
        let at = LABELS[0] + 130.0 * index as f64;
        let _ = writeln!(svg, "<text x=\"{at}\" y=\"{}\" fill=\"{colour}\">{}</text>", SIZE[1] - 2.0, escaped(&line.name));
    }
    svg + "</svg>\n"
}

/// Values along one side of a chart.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if high > low { Self { low, high, from, to } } else { Self { low: low - 0.5, high: high + 0.5, from, to } }
    }

    fn pixel(&self, value: f64) -> f64 {
        self.from + (self.to - self.from) * (value - self.low) / (self.high - self.low)
    }

    fn tick(&self, index: usize) -> f64 {
        self.low + (self.high - self.low) * index as f64 / TICKS as f64
    }

    /// Enough digits to tell neighbours apart.
    fn label(&self, value: f64) -> String {
        let digits = if self.high - self.low < 10.0 { 2 } else { 0 };
        format!("{value:.digits$}")
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_figures_charts_and_no_markup_of_the_title() {
        let frame = |time, psnr| FrameMetrics {
            name: "a".into(),
            time,
            camera: 0,
            source: None,
            lagrangian: FrameModelScore { psnr: Some(psnr), psnr_foreground: None, ssim: None, foreground_ratio: None },
        };
        let mut metrics = Metrics::default();
        metrics.frames.insert("test".into(), vec![frame(0.8, 30.0), frame(0.8, 32.0), frame(0.9, 28.0)]);
        metrics.physics.cycle_error.exact = Some(0.001);
        assert_eq!(psnr_by_time(&metrics)[1].points, [(0.8, 31.0), (0.9, 28.0)]);
        let page = html("a <b> run", &metrics, &[]);
        assert!(page.contains("a &lt;b&gt; run") && page.contains("0.100 %") && page.matches("<svg").count() == 1, "{page}");
    }

    #[test]
    fn a_chart_of_one_value_or_of_nothing_is_no_panic() {
        assert_eq!(chart("x", &[]), "");
        let flat = Series { name: "flat".into(), points: vec![(0.0, 3.0), (1.0, 3.0), (2.0, f64::NAN)] };
        let svg = chart("x", &[flat]);
        assert!(svg.contains("polyline") && !svg.contains("NaN"), "{svg}");
    }
}
