//! Parts of charts: frame and axes, lines that are clipped to it, arrows and shaded spans.

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::cartesian::Cartesian2d;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, RGBColor, ShapeStyle};
use plotters_backend::DrawingBackend;

use crate::axis::Axis;
use crate::canvas::{Area, Fault};
use crate::clip::clipped;
use crate::style::{FAINT, GRID, INK, filled, letters, line, px};

/// A chart on two [`Axis`].
pub(crate) type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<Axis, Axis>>;

/// Letters of axes and legends, shown pixels.
pub(crate) const TEXT: f64 = 12.0;
/// Letters of titles.
pub(crate) const TITLE: f64 = 13.0;

/// Where a chart's plot lies: upper left corner, width and height, shown pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) at: [f64; 2],
    pub(crate) size: [f64; 2],
}

impl Frame {
    /// The place of a point of a chart with these axes, shown pixels.
    pub(crate) fn place(&self, x: &Axis, y: &Axis, point: [f64; 2]) -> [f64; 2] {
        [
            self.at[0] + x.fraction(point[0]) * self.size[0],
            self.at[1] + (1.0 - y.fraction(point[1])) * self.size[1],
        ]
    }
}

/// Opens a chart whose plot fills a frame; nothing is drawn yet.
pub(crate) fn open<'a, B: DrawingBackend>(
    area: &'a Area<B>,
    frame: Frame,
    axes: [&Axis; 2],
) -> Result<Chart<'a, B>, Fault<B>> {
    let (width, height) = area.dim_in_pixel();
    let [left, top] = frame.at.map(px);
    let [right, bottom] = [width as i32 - left - px(frame.size[0]), height as i32 - top - px(frame.size[1])];
    ChartBuilder::on(area)
        .margin_top(top)
        .margin_right(right.max(0))
        .x_label_area_size(bottom.max(0))
        .y_label_area_size(left)
        .build_cartesian_2d(axes[0].clone(), axes[1].clone())
}

/// Opens a chart and draws its grid.
pub(crate) fn open_with_grid<'a, B: DrawingBackend>(
    area: &'a Area<B>,
    frame: Frame,
    axes: [&Axis; 2],
) -> Result<Chart<'a, B>, Fault<B>> {
    let mut chart = open(area, frame, axes)?;
    chart.configure_mesh().disable_axes().bold_line_style(line(GRID, 0.75)).max_light_lines(0).draw()?;
    Ok(chart)
}

/// Draws the frame's border, ticks, numbers and labels; after everything that lies in the plot.
pub(crate) fn border<B: DrawingBackend>(
    area: &Area<B>,
    frame: Frame,
    [x, y]: [&Axis; 2],
    ticks: [&[f64]; 2],
) -> Result<(), Fault<B>> {
    let [[left, top], [width, height]] = [frame.at, frame.size];
    let corners =
        [[left, top], [left + width, top], [left + width, top + height], [left, top + height], [left, top]];
    area.draw(&PathElement::new(corners.map(canvas).to_vec(), line(FAINT, 0.75)))?;
    for &tick in ticks[0] {
        let at = left + x.fraction(tick) * width;
        segment(area, [[at, top + height], [at, top + height + 4.0]], line(FAINT, 0.75))?;
        write(area, &x.written(tick), [at, top + height + 7.0], (TEXT, INK), (HPos::Center, VPos::Top))?;
    }
    for &tick in ticks[1] {
        let at = top + (1.0 - y.fraction(tick)) * height;
        segment(area, [[left - 4.0, at], [left, at]], line(FAINT, 0.75))?;
        write(area, &y.written(tick), [left - 7.0, at], (TEXT, INK), (HPos::Right, VPos::Center))?;
    }
    write(area, &x.label, [left + 0.5 * width, top + height + 25.0], (TEXT, INK), (HPos::Center, VPos::Top))?;
    if !y.label.is_empty() {
        let style =
            letters(TEXT, INK).transform(FontTransform::Rotate270).pos(Pos::new(HPos::Center, VPos::Center));
        area.draw(&Text::new(y.label.clone(), canvas([left - 60.0, top + 0.5 * height]), style))?;
    }
    Ok(())
}

/// Shown pixels as a place on the canvas.
pub(crate) fn canvas(shown: [f64; 2]) -> (i32, i32) {
    (px(shown[0]), px(shown[1]))
}

/// A straight line between places in shown pixels.
pub(crate) fn segment<B: DrawingBackend>(
    area: &Area<B>,
    ends: [[f64; 2]; 2],
    style: ShapeStyle,
) -> Result<(), Fault<B>> {
    area.draw(&PathElement::new(ends.map(canvas).to_vec(), style))
}

/// Text of a size and colour at a place in shown pixels, aligned to it.
pub(crate) fn write<B: DrawingBackend>(
    area: &Area<B>,
    text: &str,
    at: [f64; 2],
    (size, colour): (f64, RGBColor),
    (horizontal, vertical): (HPos, VPos),
) -> Result<(), Fault<B>> {
    area.draw(&Text::new(
        text.to_owned(),
        canvas(at),
        letters(size, colour).pos(Pos::new(horizontal, vertical)),
    ))
}

/// A line through points of the chart, cut where it leaves the plot and where a point is missing.
pub(crate) fn path<B: DrawingBackend>(
    chart: &Chart<'_, B>,
    points: &[(f64, f64)],
    style: ShapeStyle,
) -> Result<(), Fault<B>> {
    let plot = chart.plotting_area();
    let (x, y) = (chart.x_range(), chart.y_range());
    for piece in clipped(points, [x.start, y.start], [x.end, y.end]) {
        plot.draw(&PathElement::new(piece, style))?;
    }
    Ok(())
}

/// A line through points of the chart with gaps: `dash` shown pixels on and off.
pub(crate) fn dashed<B: DrawingBackend>(
    chart: &Chart<'_, B>,
    (frame, axes): (Frame, [&Axis; 2]),
    points: &[(f64, f64)],
    (style, dash): (ShapeStyle, f64),
) -> Result<(), Fault<B>> {
    let mut travelled = 0.0;
    for pair in points.windows(2) {
        let ends = [pair[0], pair[1]].map(|p| frame.place(axes[0], axes[1], [p.0, p.1]));
        let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
        let along = |s: f64| {
            let part = if length > 0.0 { s / length } else { 0.0 };
            (pair[0].0 + part * (pair[1].0 - pair[0].0), pair[0].1 + part * (pair[1].1 - pair[0].1))
        };
        let mut at = 0.0;
        while at < length && length.is_finite() {
            let phase = (travelled + at).rem_euclid(2.0 * dash);
            let next = (at + if phase < dash { dash - phase } else { 2.0 * dash - phase })
                .max(at + 1e-6)
                .min(length);
            if phase < dash {
                path(chart, &[along(at), along(next)], style)?;
            }
            at = next;
        }
        travelled += length;
    }
    Ok(())
}

/// Discs at points of the chart that lie in the plot.
pub(crate) fn dots<B: DrawingBackend>(
    chart: &Chart<'_, B>,
    points: &[(f64, f64)],
    radius: f64,
    colour: RGBColor,
) -> Result<(), Fault<B>> {
    let (x, y) = (chart.x_range(), chart.y_range());
    for &point in
        points.iter().filter(|p| (x.start..=x.end).contains(&p.0) && (y.start..=y.end).contains(&p.1))
    {
        chart.plotting_area().draw(&Circle::new(point, px(radius), filled(colour)))?;
    }
    Ok(())
}

/// An arrow between places in shown pixels; shorter than two pixels it is left out.
pub(crate) fn arrow<B: DrawingBackend>(
    area: &Area<B>,
    [from, to]: [[f64; 2]; 2],
    width: f64,
    colour: RGBColor,
) -> Result<(), Fault<B>> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if !length.is_finite() || length < 2.0 {
        return Ok(());
    }
    let head = (4.0 + width).min(0.7 * length);
    let (ux, uy) = (dx / length, dy / length);
    let neck = [to[0] - head * ux, to[1] - head * uy];
    let side = |s: f64| canvas([neck[0] - s * 0.5 * head * uy, neck[1] + s * 0.5 * head * ux]);
    segment(area, [from, neck], line(colour, width))?;
    area.draw(&Polygon::new(vec![canvas(to), side(1.0), side(-1.0)], filled(colour)))
}

/// Shades a stretch of time of a chart, as far as the chart shows it.
pub(crate) fn shade<B: DrawingBackend>(
    chart: &Chart<'_, B>,
    [from, to]: [f64; 2],
    colour: RGBColor,
) -> Result<(), Fault<B>> {
    let (x, y) = (chart.x_range(), chart.y_range());
    if to <= x.start || from >= x.end {
        return Ok(());
    }
    let corners = [(from.max(x.start), y.start), (to.min(x.end), y.end)];
    chart.plotting_area().draw(&Rectangle::new(corners, filled(colour)))
}
