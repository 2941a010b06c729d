//! Point tracks as text: a head that differs by program, then a row per time.

mod cells;
mod layout;
mod motive;
mod nexus;
mod plain;
mod qualisys;

use super::error::TracksProblem;
use super::recording::PointTracks;
use cells::{Row, rows_of};
use layout::{Layout, Times};

/// Reads a table of any known layout.
pub(super) fn parse(bytes: &[u8]) -> Result<PointTracks, TracksProblem> {
    let text = String::from_utf8_lossy(bytes);
    let rows = rows_of(&text);
    let layout = detect(&rows)?;
    let width = layout.width();
    let (mut times, mut points) = (Vec::new(), Vec::new());
    for row in rows[layout.start..].iter().take_while(|row| !(row.is_blank() && layout.ends_with_blank)) {
        if row.is_blank() {
            continue;
        }
        if row.cells.len() < width {
            return Err(TracksProblem::Row { line: row.line, expected: width, found: row.cells.len() });
        }
        times.push(match layout.times {
            Times::Column(column) => row.number(column)?.ok_or_else(|| row.refused(column))?,
            Times::Rate(rate) => times.len() as f64 / rate,
        });
        let point = |(_, column): &(String, usize)| layout.point(row, *column);
        points.push(layout.points.iter().map(point).collect::<Result<Vec<_>, _>>()?);
    }
    let labels = layout.points.into_iter().map(|(label, _)| label).collect();
    Ok(PointTracks { labels, unit: layout.unit, times, points })
}

fn detect(rows: &[Row<'_>]) -> Result<Layout, TracksProblem> {
    let starts = |row: &Row<'_>, word: &str| row.cell(0).eq_ignore_ascii_case(word);
    let at = |word: &str| rows.iter().position(|row| starts(row, word));
    if rows.first().is_some_and(|row| starts(row, "Format Version")) {
        motive::layout(rows)
    } else if let Some(section) = at("Trajectories") {
        nexus::layout(rows, section)
    } else if let Some(names) = at("MARKER_NAMES") {
        qualisys::layout(rows, names)
    } else {
        plain::layout(rows)
    }
}
