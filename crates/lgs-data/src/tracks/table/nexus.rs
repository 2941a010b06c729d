//! Vicon Nexus, ASCII export: sections, of which `Trajectories` has the points: the rate, a row of names, one
//! of axes (`Frame,Sub Frame,X,Y,Z,…`), one of units, then rows of numbers up to a blank one.

use super::super::error::TracksProblem;
use super::super::recording::LengthUnit;
use super::cells::Row;
use super::layout::{Layout, Origin, Times, rate, triples};

/// The layout of a table whose row `section` opens the trajectories.
pub(super) fn layout(rows: &[Row<'_>], section: usize) -> Result<Layout, TracksProblem> {
    let [of_rate, names, axes, units] = [1, 2, 3, 4].map(|step| rows.get(section + step));
    let (Some(of_rate), Some(names), Some(axes), Some(units)) = (of_rate, names, axes, units) else {
        return Err(TracksProblem::Layout("a section `Trajectories` that ends within its head".to_owned()));
    };
    let columns = triples(axes);
    let named = |column: usize| (names.cell(column).to_owned(), column);
    Ok(Layout {
        start: section + 5,
        ends_with_blank: true,
        times: Times::Rate(rate("Trajectories", of_rate.cell(0))?),
        unit: LengthUnit::named(columns.first().map_or("", |&column| units.cell(column))),
        points: columns.into_iter().map(named).collect(),
        origin: Origin::Point,
    })
}
