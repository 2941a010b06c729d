//! Falling time against the scale of the potential, both logarithmic: from rest, theory says an exponent of
//! −½ (method §7).

use lgs_eval::{FallTime, Physics};
use plotters::style::RGBColor;
use plotters_backend::DrawingBackend;

use crate::axis::{Axis, number, padded};
use crate::canvas::{Area, Drawing, Fault, Figure};
use crate::chart::{Frame, border, dashed, dots, open_with_grid, path};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::style::{LAGRANGIAN, TRUTH, line};
use crate::thresholds::CURVE_PIECES as CURVE;

const SIZE: [f64; 2] = [620.0, 400.0];
const FRAME: Frame = Frame { at: [76.0, 44.0], size: [530.0, 306.0] };

/// Room beyond the first and the last scale, as a factor.
const MARGIN: f64 = 1.15;

struct BetaSweep {
    points: Vec<(f64, f64)>,
    fit: Vec<(f64, f64)>,
    theory: Vec<(f64, f64)>,
    axes: [Axis; 2],
    slope: f64,
}

/// The figure; nothing where the scene does not fall from rest.
pub(crate) fn figure(physics: &Physics) -> Result<Option<Figure>, ReportError> {
    let fall = &physics.fall_time_exponent;
    let points = measured(fall);
    let (Some(slope), Some(r), true) = (fall.slope, fall.r, points.len() > 1) else { return Ok(None) };
    let n = points.len() as f64;
    let center = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0.ln() / n, sum.1 + p.1.ln() / n));
    let (Some(x), Some(y)) =
        (padded(points.iter().map(|p| p.0), 0.0), padded(points.iter().map(|p| p.1), 0.0))
    else {
        return Ok(None);
    };
    let ends = [x.start / MARGIN, x.end * MARGIN];
    let between = |part: f64| ends[0] * (ends[1] / ends[0]).powf(part);
    let power = |exponent: f64| -> Vec<(f64, f64)> {
        let at = |b: f64| (b, (center.1 + exponent * (b.ln() - center.0)).exp());
        (0..=CURVE).map(|i| at(between(i as f64 / CURVE as f64))).collect()
    };
    let scales: Vec<f64> = points.iter().map(|p| p.0).collect();
    let axes = [
        Axis::logarithmic(ends[0]..ends[1], &scales, 2, "scale of the potential β"),
        Axis::decades(y.start / 1.2..y.end * 1.2, "falling time (time units)"),
    ];
    let without = physics
        .fall_time_exponent_without_force
        .slope
        .map_or_else(String::new, |s| format!(" Without the force Q: {}.", number(s, 4)));
    let caption = format!(
        "Time to fall by 70 % of the observed drop against the scale β of the potential: exponent {} (r = \
            {r:.5}), −0.5 in theory.{without}",
        number(slope, 4)
    );
    let drawing = BetaSweep { fit: power(slope), theory: power(-0.5), points, axes, slope };
    Figure::of(("beta-sweep", &caption), SIZE, &drawing).map(Some)
}

/// Scales and times, by scale.
fn measured(fall: &FallTime) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = fall
        .times
        .iter()
        .filter_map(|(beta, time)| Some((beta.parse().ok()?, (*time)?)))
        .filter(|&(b, t)| b > 0.0 && t > 0.0)
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

impl Drawing for BetaSweep {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let [x, y] = &self.axes;
        let chart = open_with_grid(area, FRAME, [x, y])?;
        path(&chart, &self.fit, line(LAGRANGIAN, 1.6))?;
        dashed(&chart, (FRAME, [x, y]), &self.theory, (line(TRUTH, 1.6), 6.0))?;
        dots(&chart, &self.points, 4.0, LAGRANGIAN)?;
        border(area, FRAME, [x, y], [x.ticks(), y.ticks()])?;
        let entry = |mark, colour: RGBColor, text: String| (mark, colour, text);
        let entries = [
            entry(Mark::Dot, LAGRANGIAN, "measured".to_owned()),
            entry(Mark::Line(1.6), LAGRANGIAN, format!("fit, exponent {}", number(self.slope, 3))),
            entry(Mark::Dashed, TRUTH, "theory, exponent −0.5".to_owned()),
        ];
        legend(area, [FRAME.at[0], 18.0], &entries)
    }
}
