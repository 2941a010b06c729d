//! OptiTrack Motive, CSV export: a row of keys and values (`Length Units`, …), rows with the type, name and
//! measure of each column, a row `Frame,Time (Seconds),X,Y,Z,…`, then rows of numbers. Of the kinds of points
//! in a file the first of [`KINDS`] is taken: measured markers, else what was solved from them.

use super::super::error::TracksProblem;
use super::super::recording::LengthUnit;
use super::cells::Row;
use super::layout::{Layout, Origin, Times, triples};

/// Types of columns that have positions, the best first.
const KINDS: [&str; 5] = ["Marker", "Rigid Body Marker", "Bone Marker", "Rigid Body", "Bone"];

/// The layout of a table that begins with `Format Version`.
pub(super) fn layout(rows: &[Row<'_>]) -> Result<Layout, TracksProblem> {
    let head = rows.iter().position(|row| row.cell(0).eq_ignore_ascii_case("Frame"));
    let head =
        head.ok_or_else(|| TracksProblem::Layout("a Motive export without a row `Frame`".to_owned()))?;
    let described = |word: &str| rows[..head].iter().find(|row| row.cell(1).eq_ignore_ascii_case(word));
    let (kinds, names) = (described("Type"), described("Name"));
    let measures = &rows[head.saturating_sub(1)];
    let is_position = |column: usize| measures.cell(column).eq_ignore_ascii_case("Position");
    let columns: Vec<usize> = triples(&rows[head]).into_iter().filter(|&c| is_position(c)).collect();
    let of_kind =
        |kind: &str, column: usize| kinds.is_none_or(|row| row.cell(column).eq_ignore_ascii_case(kind));
    let kind = KINDS.into_iter().find(|kind| columns.iter().any(|&column| of_kind(kind, column)));
    let kept = columns.into_iter().filter(|&column| kind.is_some_and(|kind| of_kind(kind, column)));
    let named = |column: usize| (names.map_or("", |row| row.cell(column)).to_owned(), column);
    let unit = rows[0].cells.windows(2).find(|pair| pair[0].eq_ignore_ascii_case("Length Units"));
    Ok(Layout {
        start: head + 1,
        ends_with_blank: false,
        times: Times::Column(1),
        points: kept.map(named).collect(),
        unit: LengthUnit::named(unit.map_or("", |pair| pair[1])),
        origin: Origin::Point,
    })
}
