//! Qualisys Track Manager, TSV export: rows of a key and its value (`FREQUENCY`, `MARKER_NAMES` …), perhaps a
//! row of column names that begins with `Frame` and `Time`, then rows of numbers in millimetres. A point that
//! is not seen stands at the origin, or its cells are empty.

use super::super::error::TracksProblem;
use super::super::recording::LengthUnit;
use super::cells::Row;
use super::layout::{Layout, Origin, Times, rate};

/// The layout of a table whose row `names` lists the markers.
pub(super) fn layout(rows: &[Row<'_>], names: usize) -> Result<Layout, TracksProblem> {
    let labels: Vec<&str> = rows[names].cells[1..].iter().copied().filter(|name| !name.is_empty()).collect();
    // Later versions add further keys after the names.
    let is_head = |row: &Row<'_>| row.cell(0).parse::<f64>().is_err() && !row.cell(0).is_empty();
    let heads = rows[names..].iter().take_while(|row| is_head(row)).count();
    let last = &rows[names + heads - 1];
    let has_times = last.cell(0).eq_ignore_ascii_case("Frame");
    let times = if has_times {
        Times::Column(1)
    } else {
        let frequency = rows[..names + heads].iter().find(|row| row.cell(0) == "FREQUENCY");
        Times::Rate(rate("FREQUENCY", frequency.map_or("", |row| row.cell(1)))?)
    };
    let first = if has_times { 2 } else { 0 };
    let points = labels.iter().enumerate().map(|(i, name)| ((*name).to_owned(), first + 3 * i));
    Ok(Layout {
        start: names + heads,
        ends_with_blank: false,
        times,
        points: points.collect(),
        unit: LengthUnit::named("mm"),
        origin: Origin::Gap,
    })
}
