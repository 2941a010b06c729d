//! Axes: a range, the places of its labels, and how they are written.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// One axis of a chart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    digits: usize,
    logarithmic: bool,
    /// The quantity along it, with its unit.
    pub(crate) label: String,
}

impl Axis {
    /// A linear axis with about so many labels at round numbers.
    pub(crate) fn linear(range: Range<f64>, about: usize, label: &str) -> Self {
        let (low, high) = if range.end > range.start {
            (range.start, range.end)
        } else {
            (range.start - 0.5, range.start + 0.5)
        };
        let step = round_step((high - low) / about.max(1) as f64);
        let first = (low / step - 1e-9).ceil() as i64;
        let ticks = (first..).map(|i| i as f64 * step).take_while(|&t| t <= high + 1e-9 * step).collect();
        let digits = (-step.log10().floor()).max(0.0) as usize;
        Self { low, high, ticks, digits, logarithmic: false, label: label.to_owned() }
    }

    /// This axis without its label.
    pub(crate) fn unnamed(mut self) -> Self {
        self.label.clear();
        self
    }

    /// This axis without numbers.
    pub(crate) fn unnumbered(mut self) -> Self {
        self.ticks.clear();
        self
    }

    /// Values at which its numbers stand.
    pub(crate) fn ticks(&self) -> &[f64] {
        &self.ticks
    }

    /// A logarithmic axis with labels at these places.
    pub(crate) fn logarithmic(range: Range<f64>, ticks: &[f64], digits: usize, label: &str) -> Self {
        Self {
            low: range.start,
            high: range.end,
            ticks: ticks.to_vec(),
            digits,
            logarithmic: true,
            label: label.to_owned(),
        }
    }

    /// A logarithmic axis with labels at powers of ten, and between them where there is room.
    pub(crate) fn decades(range: Range<f64>, label: &str) -> Self {
        let exponents = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
        let wide = range.end > 100.0 * range.start;
        let narrow = range.end < 10.0 * range.start;
        let factors: &[f64] = if wide {
            &[1.0]
        } else if narrow {
            &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]
        } else {
            &[1.0, 2.0, 5.0]
        };
        let all = exponents.flat_map(|e| factors.iter().map(move |f| f * 10.0_f64.powi(e)));
        let ticks: Vec<f64> = all.filter(|t| (range.start * 0.999..=range.end * 1.001).contains(t)).collect();
        let digits = ticks.first().map_or(1, |t| (1.0 - t.log10().floor()).max(0.0) as usize);
        Self { low: range.start, high: range.end, ticks, digits, logarithmic: true, label: label.to_owned() }
    }

    /// Position of a value along the axis, 0 at the low end and 1 at the high one.
    pub(crate) fn fraction(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// A number as this axis writes it, with a true minus sign.
    pub(crate) fn written(&self, value: f64) -> String {
        number(value, if self.logarithmic { needed_digits(value, self.digits) } else { self.digits })
    }
}

/// A number with so many digits behind the point and a true minus sign.
pub(crate) fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

/// Digits behind the point without trailing zeros, at most `most`.
fn needed_digits(value: f64, most: usize) -> usize {
    (0..most)
        .find(|&d| ((value * 10.0_f64.powi(d as i32)).round() / 10.0_f64.powi(d as i32) - value).abs() < 1e-9)
        .unwrap_or(most)
}

/// 1, 2 or 5 times a power of ten, not below `step`.
fn round_step(step: f64) -> f64 {
    let power = 10.0_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|f| f * power).into_iter().find(|&s| s >= step * 0.7).unwrap_or(10.0 * power)
}

/// The range of values, with a part of its width added on both sides.
pub(crate) fn padded(values: impl Iterator<Item = f64>, padding: f64) -> Option<Range<f64>> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    (low <= high).then(|| {
        let extra = padding * if high > low { high - low } else { 1.0 };
        low - extra..high + extra
    })
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        (f64::from(limit.0) + self.fraction(*value) * f64::from(limit.1 - limit.0)).round().clamp(-1e6, 1e6)
            as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.written(*value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_stand_at_round_numbers_inside_the_range() {
        let axis = Axis::linear(-0.75..2.25, 6, "time");
        assert_eq!(axis.ticks, [-0.5, 0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(axis.written(-0.5), "−0.5");
        assert_eq!(Axis::linear(12.3..47.0, 5, "dB").ticks, [15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0]);
        assert_eq!(Axis::linear(3.0..3.0, 5, "flat").range(), 2.5..3.5);
        assert_eq!(number(-0.001, 1), "0.0");
    }

    #[test]
    fn equal_ratios_are_equally_far_apart_on_a_logarithmic_axis() {
        let axis = Axis::logarithmic(0.25..4.0, &[0.25, 0.5, 1.0], 2, "β");
        assert!((axis.fraction(0.5) - 0.25).abs() < 1e-12 && (axis.fraction(1.0) - 0.5).abs() < 1e-12);
        assert_eq!([0.25, 0.5, 1.0].map(|v| axis.written(v)), ["0.25", "0.5", "1"]);
        assert_eq!(Axis::decades(0.3..6.0, "s").ticks, [0.5, 1.0, 2.0, 5.0]);
        assert_eq!(Axis::decades(0.02..3.0, "s").ticks, [0.1, 1.0]);
    }
}
