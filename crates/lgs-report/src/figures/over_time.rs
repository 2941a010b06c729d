//! Charts over time with the captured window shaded: PSNR of every split, and distance to the true paths.

use std::collections::BTreeMap;
use std::ops::Range;

use lgs_core::Image;
use lgs_eval::{FrameMetrics, FrameModelScore, Metrics};
use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::axis::{Axis, padded};
use crate::canvas::{Area, Drawing, Fault, Figure};
use crate::chart::{Frame, TEXT, border, dots, open, open_with_grid, path, shade, write};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::paths::{Paths, Tracks};
use crate::style::{FAINT, LAGRANGIAN, SOURCE, UNTRUSTED, WINDOW, line};
use crate::untrusted_mark::mark_untrusted;

const SIZE: [f64; 2] = [820.0, 350.0];
const FRAME: Frame = Frame { at: [76.0, 56.0], size: [730.0, 244.0] };

/// Axis label of times.
const TIME: &str = "time t (captured sequence: 0 … 1)";

/// Splits whose images are of the captured window: only the first that a run has is drawn, held-out views
/// before training ones.
const INSIDE: [&str; 2] = ["val", "train"];

/// Rounding of times that is allowed for, units of time.
const ROUNDING: f64 = 1e-4;

/// Points joined by a line.
struct Line {
    colour: RGBColor,
    points: Vec<(f64, f64)>,
    dotted: bool,
}

/// The times that a model knows.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    /// End of the captured window, which begins at 0.
    pub(crate) window: f64,
    /// First and last time of trust in the forecasts of all objects; nothing where nothing moves.
    pub(crate) trusted: Option<[f64; 2]>,
}

impl Span {
    /// Stretches of time before and after those of trust.
    fn untrusted(&self) -> Option<[[f64; 2]; 2]> {
        self.trusted.map(|[from, to]| [[f64::NEG_INFINITY, from], [to, f64::INFINITY]])
    }

    /// An image of a time, marked if the forecast of some object is not trusted then.
    pub(crate) fn marked(&self, time: f64, mut image: Image) -> Image {
        if self.trusted.is_some_and(|[from, to]| time < from - ROUNDING || time > to + ROUNDING) {
            mark_untrusted(&mut image);
        }
        image
    }

    /// A caption, with a word on shaded times beyond trust.
    fn caption(&self, caption: &str) -> String {
        let beyond = " Red: times at which the forecast of some object is not trusted.";
        format!("{caption}{}", if self.trusted.is_some() { beyond } else { "" })
    }
}

/// A stretch of time with a name.
struct Stretch {
    name: String,
    times: Range<f64>,
}

struct OverTime {
    lines: Vec<Line>,
    stretches: Vec<Stretch>,
    axes: [Axis; 2],
    span: Span,
    entries: Vec<(Mark, RGBColor, String)>,
}

/// PSNR by time; nothing without frames of different times.
pub(crate) fn psnr(metrics: &Metrics, span: Span) -> Result<Option<Figure>, ReportError> {
    let mut lines = Vec::new();
    let mut stretches = Vec::new();
    for (name, frames) in drawn_splits(metrics) {
        let times = frames.iter().map(|f| f64::from(f.time));
        if let Some(times) = padded(times, 0.0) {
            stretches.push(Stretch { name: name.to_owned(), times });
        }
        lines.push(Line { colour: SOURCE, points: mean_by_time(frames, |f| f.source), dotted: true });
        lines.push(Line {
            colour: LAGRANGIAN,
            points: mean_by_time(frames, |f| Some(f.lagrangian)),
            dotted: true,
        });
    }
    let mut times = lines.iter().flat_map(|l| &l.points).map(|p| p.0);
    let first = times.next();
    if times.all(|time| Some(time) == first) {
        return Ok(None);
    }
    let caption = "PSNR over all images of a time, by split; shaded: the captured window. Outside of it \
        the source model guesses, and the Lagrangian scene goes on.";
    chart(("psnr", caption), lines, (stretches, span), |values| {
        padded(values, 0.08).map(|v| Axis::linear(v, 6, "PSNR (dB)"))
    })
}

/// Mean distance of particles to where the truth has them; nothing without a truth.
pub(crate) fn position_error(paths: &Paths, span: Span) -> Result<Option<Figure>, ReportError> {
    let Some(truth) = paths.truth.as_ref() else { return Ok(None) };
    let of = |tracks: &Tracks, colour| Line { colour, points: distances(tracks, truth), dotted: false };
    let mut lines: Vec<Line> = paths.source.iter().map(|tracks| of(tracks, SOURCE)).collect();
    lines.push(of(&paths.lagrangian, LAGRANGIAN));
    let caption = "Mean distance of the followed particles to where the truth has them, matched at t = 0; \
        shaded: the captured window.";
    let axis = |values: &mut dyn Iterator<Item = f64>| {
        padded(values, 0.0).map(|v| Axis::decades(v.start / 1.5..v.end * 1.5, "distance (world units)"))
    };
    chart(("position-error", caption), lines, (Vec::new(), span), axis)
}

fn chart(
    (name, caption): (&str, &str),
    lines: Vec<Line>,
    (stretches, span): (Vec<Stretch>, Span),
    axis: impl Fn(&mut dyn Iterator<Item = f64>) -> Option<Axis>,
) -> Result<Option<Figure>, ReportError> {
    let lines: Vec<Line> = lines.into_iter().filter(|l| !l.points.is_empty()).collect();
    let all = || lines.iter().flat_map(|l| &l.points);
    let times = padded(all().map(|p| p.0), 0.02);
    let (Some(times), Some(y)) = (times, axis(&mut all().map(|p| p.1))) else { return Ok(None) };
    let named = |colour: RGBColor, text: &str| (Mark::Line(2.0), colour, text.to_owned());
    let mut entries = Vec::new();
    if lines.iter().any(|l| l.colour == SOURCE) {
        entries.push(named(SOURCE, "source"));
    }
    entries.push(named(LAGRANGIAN, "Lagrangian"));
    let axes = [Axis::linear(times, 10, TIME), y];
    let caption = span.caption(caption);
    Figure::of((name, &caption), SIZE, &OverTime { lines, stretches, axes, span, entries }).map(Some)
}

/// Splits in the order of time, one of those inside the window.
fn drawn_splits(metrics: &Metrics) -> Vec<(&str, &[FrameMetrics])> {
    let inside = INSIDE.iter().find(|name| metrics.frames.get(**name).is_some_and(|f| !f.is_empty()));
    // Edited splits show another motion at the same times.
    let drawn = |name: &&str| (!INSIDE.contains(name) || Some(name) == inside) && !name.starts_with("edit-");
    let mut splits: Vec<(&str, &[FrameMetrics])> = metrics
        .frames
        .iter()
        .map(|(name, frames)| (name.as_str(), frames.as_slice()))
        .filter(|(name, _)| drawn(name))
        .collect();
    let start = |frames: &[FrameMetrics]| frames.iter().map(|f| f.time).fold(f32::INFINITY, f32::min);
    splits.sort_by(|a, b| start(a.1).total_cmp(&start(b.1)));
    splits
}

/// Mean PSNR over all images of a time.
fn mean_by_time(
    frames: &[FrameMetrics],
    pick: impl Fn(&FrameMetrics) -> Option<FrameModelScore>,
) -> Vec<(f64, f64)> {
    let mut by_time: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    for frame in frames {
        let Some(psnr) = pick(frame).and_then(|score| score.psnr) else { continue };
        // A key in millionths, because floats have no order of their own.
        let sums = by_time.entry((f64::from(frame.time) * 1e6).round() as i64).or_default();
        *sums = (sums.0 + psnr, sums.1 + 1.0);
    }
    by_time.into_iter().map(|(t, (sum, n))| (t as f64 / 1e6, sum / n)).collect()
}

/// Mean distance over particles at every time that both know.
fn distances(tracks: &Tracks, truth: &Tracks) -> Vec<(f64, f64)> {
    let at = |row: usize| {
        // At the start both agree by construction.
        let (before, weight) =
            place(&truth.times, tracks.times[row]).filter(|_| tracks.times[row].abs() > 1e-6)?;
        let particles = tracks.positions.iter().zip(&truth.positions);
        let sum: f64 = particles
            .map(|(own, real)| {
                let real = |c: usize| {
                    f64::from(real[before][c]) + weight * f64::from(real[before + 1][c] - real[before][c])
                };
                (0..3).map(|c| (f64::from(own[row][c]) - real(c)).powi(2)).sum::<f64>().sqrt()
            })
            .sum();
        let mean = sum / tracks.positions.len().max(1) as f64;
        mean.is_finite().then_some((tracks.times[row], mean.max(1e-6)))
    };
    (0..tracks.times.len()).filter_map(at).collect()
}

/// The interval of a sorted list that holds a value, and where in it.
fn place(sorted: &[f64], value: f64) -> Option<(usize, f64)> {
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    if sorted.len() < 2 || value < first - 1e-6 || value > last + 1e-6 {
        return None;
    }
    let before = sorted.partition_point(|&t| t <= value).clamp(1, sorted.len() - 1) - 1;
    Some((before, ((value - sorted[before]) / (sorted[before + 1] - sorted[before])).clamp(0.0, 1.0)))
}

impl Drawing for OverTime {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let [x, y] = &self.axes;
        let chart = open(area, FRAME, [x, y])?;
        shade(&chart, [0.0, self.span.window], WINDOW)?;
        for stretch in self.span.untrusted().into_iter().flatten() {
            shade(&chart, stretch, UNTRUSTED)?;
        }
        let chart = open_with_grid(area, FRAME, [x, y])?;
        for series in &self.lines {
            path(&chart, &series.points, line(series.colour, 2.0))?;
            if series.dotted {
                dots(&chart, &series.points, 2.2, series.colour)?;
            }
        }
        border(area, FRAME, [x, y], [x.ticks(), y.ticks()])?;
        for stretch in &self.stretches {
            let middle =
                FRAME.at[0] + FRAME.size[0] * x.fraction(0.5 * (stretch.times.start + stretch.times.end));
            write(
                area,
                &stretch.name,
                [middle, FRAME.at[1] - 6.0],
                (TEXT, FAINT),
                (HPos::Center, VPos::Bottom),
            )?;
        }
        legend(area, [FRAME.at[0], 16.0], &self.entries)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: f32, psnr: f64) -> FrameMetrics {
        let score =
            FrameModelScore { psnr: Some(psnr), psnr_foreground: None, ssim: None, foreground_ratio: None };
        FrameMetrics { name: "a".into(), time, camera: 0, source: None, lagrangian: score }
    }

    #[test]
    fn times_beyond_trust_are_shaded_and_named_where_a_scene_says_some() {
        let mut metrics = Metrics::default();
        metrics.frames.insert("long".to_owned(), vec![frame(0.5, 30.0), frame(2.0, 20.0)]);
        let drawn = |trusted| psnr(&metrics, Span { window: 0.75, trusted }).expect("drawn").expect("frames");
        let (silent, known) = (drawn(None), drawn(Some([-0.5, 1.5])));
        assert!(!silent.caption.contains("trusted") && known.caption.contains("not trusted"));
        let red = format!("#{:02X}{:02X}{:02X}", UNTRUSTED.0, UNTRUSTED.1, UNTRUSTED.2);
        assert!(
            !silent.svg.contains(&red) && known.svg.matches(&red).count() == 1,
            "only after: {}",
            known.svg
        );
    }

    #[test]
    fn held_out_views_stand_for_the_window_and_splits_come_in_the_order_of_time() {
        let mut metrics = Metrics::default();
        for (name, time) in [("test", 0.8), ("train", 0.1), ("val", 0.2), ("past", -0.5)] {
            metrics.frames.insert(name.to_owned(), vec![frame(time, 30.0), frame(time, 32.0)]);
        }
        let names: Vec<&str> = drawn_splits(&metrics).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["past", "val", "test"]);
        assert_eq!(mean_by_time(&metrics.frames["test"], |f| Some(f.lagrangian)), [(0.8, 31.0)]);
        assert!(mean_by_time(&metrics.frames["test"], |f| f.source).is_empty());
    }

    #[test]
    fn distances_are_taken_between_samples_and_not_beyond_them() {
        let truth = Tracks { times: vec![0.0, 1.0], positions: vec![vec![[0.0; 3], [2.0, 0.0, 0.0]]] };
        let own = Tracks {
            times: vec![-1.0, 0.5, 1.0],
            positions: vec![vec![[9.0; 3], [1.0, 3.0, 4.0], [2.0, 1.0, 0.0]]],
        };
        assert_eq!(distances(&own, &truth), [(0.5, 5.0), (1.0, 1.0)]);
    }
}
