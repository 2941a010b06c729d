//! What the head of a table says: where its numbers are.

use super::super::error::TracksProblem;
use super::super::recording::LengthUnit;
use super::cells::Row;

/// Where times come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Times {
    /// A column, from 0.
    Column(usize),
    /// The number of the row over a rate.
    Rate(f64),
}

/// Whether a point at the origin is one that was not seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    Point,
    Gap,
}

/// Where the numbers of a table are.
pub(super) struct Layout {
    /// First row of numbers.
    pub(super) start: usize,
    /// Whether a blank row ends them, as sections do.
    pub(super) ends_with_blank: bool,
    pub(super) times: Times,
    /// Names of points, and the column of x, which y and z follow.
    pub(super) points: Vec<(String, usize)>,
    pub(super) unit: LengthUnit,
    pub(super) origin: Origin,
}

impl Layout {
    /// Fewest cells of a row.
    pub(super) fn width(&self) -> usize {
        let points = self.points.iter().map(|(_, column)| column + 3).max().unwrap_or(0);
        match self.times {
            Times::Column(column) => points.max(column + 1),
            Times::Rate(_) => points,
        }
    }

    /// The point whose x stands in a column; nothing if a coordinate is missing.
    pub(super) fn point(&self, row: &Row<'_>, column: usize) -> Result<Option<[f32; 3]>, TracksProblem> {
        let [x, y, z] = [row.number(column)?, row.number(column + 1)?, row.number(column + 2)?];
        let point = x.zip(y).zip(z).map(|((x, y), z)| [x, y, z].map(|v| v as f32));
        let is_gap = |point: &[f32; 3]| self.origin == Origin::Gap && point.iter().all(|v| *v == 0.0);
        match point.filter(|point| !is_gap(point)) {
            Some(point) if point.iter().any(|v| v.is_infinite()) => Err(row.refused(column)),
            point => Ok(point),
        }
    }
}

/// Columns at which X, Y and Z follow each other in a row of axes.
pub(super) fn triples(axes: &Row<'_>) -> Vec<usize> {
    let is = |column: usize, axis: &str| axes.cell(column).eq_ignore_ascii_case(axis);
    let starts = |&column: &usize| is(column, "x") && is(column + 1, "y") && is(column + 2, "z");
    (0..axes.cells.len()).filter(starts).collect()
}

/// A rate in a cell of the head.
pub(super) fn rate(field: &str, text: &str) -> Result<f64, TracksProblem> {
    let rate = text.parse::<f64>().ok().filter(|rate| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| TracksProblem::Field {
        field: field.to_owned(),
        expected: "a number of frames per second",
        found: format!("`{}`", text.chars().take(40).collect::<String>()),
    })
}
