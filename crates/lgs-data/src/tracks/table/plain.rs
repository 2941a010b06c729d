//! A plain table: a column of times, then x, y and z of each point. A first row may name the columns
//! (`time,x1,y1,z1`, `frame,time,head_x,head_y,head_z`), with a unit of length in brackets.

use super::super::error::TracksProblem;
use super::super::recording::LengthUnit;
use super::cells::Row;
use super::layout::{Layout, Origin, Times};

/// Names of a column of times, in small letters and without a unit.
const TIME: [&str; 5] = ["time", "t", "times", "seconds", "timestamp"];

/// The layout of a table of no program's.
pub(super) fn layout(rows: &[Row<'_>]) -> Result<Layout, TracksProblem> {
    let start = rows.iter().position(|row| !row.is_blank()).ok_or(TracksProblem::Empty("rows"))?;
    let head = &rows[start];
    if head.cell(0).parse::<f64>().is_ok() {
        return Ok(Layout {
            start,
            ends_with_blank: false,
            times: Times::Column(0),
            points: (0..whole_points(head, 1)?).map(|i| (format!("{}", i + 1), 1 + 3 * i)).collect(),
            unit: LengthUnit::named(""),
            origin: Origin::Point,
        });
    }
    let names: Vec<(String, &str)> = head.cells.iter().map(|cell| name_and_unit(cell)).collect();
    let is_time = |(name, _): &(String, &str)| TIME.contains(&name.as_str());
    let found = || head.cells.join(",").chars().take(60).collect::<String>();
    let time = names.iter().take(2).position(is_time);
    let time = time.ok_or_else(|| TracksProblem::Layout(format!("a first row `{}`", found())))?;
    let first = time + 1;
    let point = |i: usize| {
        let column = first + 3 * i;
        let label = label_of([0, 1, 2].map(|axis| names[column + axis].0.as_str()));
        label.map(|label| (label, column)).ok_or_else(|| TracksProblem::Field {
            field: head.cells[column..column + 3].join(","),
            expected: "names of x, y and z of one point, in that order",
            found: "others".to_owned(),
        })
    };
    let points = (0..whole_points(head, first)?).map(point).collect::<Result<Vec<_>, _>>()?;
    Ok(Layout {
        start: start + 1,
        ends_with_blank: false,
        times: Times::Column(time),
        unit: LengthUnit::named(names.get(first).map_or("", |(_, unit)| unit)),
        points,
        origin: Origin::Point,
    })
}

/// Number of points in the columns from `first` on; a blank one at the end is none.
fn whole_points(head: &Row<'_>, first: usize) -> Result<usize, TracksProblem> {
    let filled = head.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    let columns = filled.saturating_sub(first);
    if columns % 3 == 0 {
        return Ok(columns / 3);
    }
    Err(TracksProblem::Field {
        field: format!("line {}", head.line),
        expected: "three columns for each point after the time",
        found: format!("{columns} columns"),
    })
}

/// A column's name in small letters, and the unit that stands behind it in brackets.
fn name_and_unit(cell: &str) -> (String, &str) {
    let (name, unit) = cell.split_once(['(', '[']).unwrap_or((cell, ""));
    (name.trim().to_ascii_lowercase(), unit.trim_end_matches([')', ']']).trim())
}

/// A point's name: what the names of its columns share beside x, y and z at their end or beginning.
fn label_of(names: [&str; 3]) -> Option<String> {
    const SEPARATORS: [char; 5] = ['_', '.', ' ', '-', ':'];
    let axes = ["x", "y", "z"];
    let shared = |rest: &dyn Fn(&str, &str) -> Option<String>| {
        let labels = [0, 1, 2].map(|i| rest(names[i], axes[i]));
        labels[0].clone().filter(|label| labels.iter().all(|other| other.as_ref() == Some(label)))
    };
    let bare = |text: &str| text.trim_matches(SEPARATORS).to_owned();
    shared(&|name, axis| name.strip_suffix(axis).map(bare))
        .or_else(|| shared(&|name, axis| name.strip_prefix(axis).map(bare)))
}
