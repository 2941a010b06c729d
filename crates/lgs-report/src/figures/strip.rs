//! Rows of images over time: the grid that the figures of images share.

use lgs_core::Image;
use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::canvas::{Area, Drawing, Fault, Picture};
use crate::chart::{TEXT, TITLE, arrow, segment, write};
use crate::style::{FAINT, INK, PAPER, line};

const WIDTH: f64 = 820.0;
const LEFT: f64 = 92.0;
const GAP: f64 = 3.0;
/// Space under a row for a note on every image.
const NOTES: f64 = 15.0;
/// Space above the images: labels, and groups over them.
const TOP: [f64; 2] = [24.0, 46.0];

/// One image with what is drawn on and under it.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    pub(crate) image: Image,
    /// Written below it.
    pub(crate) note: String,
    /// From and to, as parts of the image's width and height.
    pub(crate) arrows: Vec<[[f64; 2]; 2]>,
}

/// A row of cells; blanks where there is no image.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) title: String,
    pub(crate) colour: RGBColor,
    pub(crate) cells: Vec<Option<Cell>>,
}

/// Neighbouring columns with a name.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub(crate) name: String,
    pub(crate) columns: std::ops::Range<usize>,
    pub(crate) strong: bool,
}

/// Rows under column labels.
#[derive(Clone, Debug)]
pub(crate) struct Strip {
    pub(crate) labels: Vec<String>,
    pub(crate) groups: Vec<Group>,
    pub(crate) rows: Vec<Row>,
    /// Height of the images over their width.
    pub(crate) aspect: f64,
}

/// Width of an image in a strip of so many columns, shown pixels.
fn cell_width(columns: usize) -> f64 {
    ((WIDTH - LEFT) / columns.max(1) as f64 - GAP).clamp(20.0, 150.0).floor()
}

/// Width of the images that such a strip shows, in their own pixels: two per shown pixel.
pub(crate) fn image_width(columns: usize) -> u32 {
    2 * cell_width(columns) as u32
}

impl Strip {
    /// Width and height, shown pixels.
    pub(crate) fn size(&self) -> [f64; 2] {
        let [_, bottom] = self.at(self.rows.len(), 0);
        let [right, _] = self.at(0, self.labels.len());
        [right + 8.0, bottom + 3.0]
    }

    fn top(&self) -> f64 {
        TOP[usize::from(!self.groups.is_empty())]
    }

    fn cell(&self) -> [f64; 2] {
        let width = cell_width(self.labels.len());
        [width, (width * self.aspect).round()]
    }

    fn at(&self, row: usize, column: usize) -> [f64; 2] {
        let [width, height] = self.cell();
        let noted =
            self.rows[..row].iter().filter(|r| r.cells.iter().flatten().any(|c| !c.note.is_empty())).count();
        [
            LEFT + column as f64 * (width + GAP),
            self.top() + row as f64 * (height + GAP) + noted as f64 * NOTES,
        ]
    }

    fn cells(&self) -> impl Iterator<Item = ([f64; 2], &Row, &Cell)> {
        let in_row =
            |(r, row): (usize, &'_ Row)| (0..row.cells.len()).map(move |c| (r, c)).collect::<Vec<_>>();
        let places: Vec<(usize, usize)> = self.rows.iter().enumerate().flat_map(in_row).collect();
        places
            .into_iter()
            .filter_map(|(r, c)| Some((self.at(r, c), &self.rows[r], self.rows[r].cells[c].as_ref()?)))
    }
}

impl Drawing for Strip {
    fn pictures(&self) -> Vec<Picture> {
        self.cells()
            .map(|(at, _, cell)| Picture { at, size: self.cell(), image: cell.image.clone() })
            .collect()
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let [width, height] = self.cell();
        for (column, label) in self.labels.iter().enumerate() {
            let [x, y] = self.at(0, column);
            write(area, label, [x + 0.5 * width, y - 5.0], (TEXT - 1.0, INK), (HPos::Center, VPos::Bottom))?;
        }
        for group in &self.groups {
            self.draw_group(area, group)?;
        }
        for (row, content) in self.rows.iter().enumerate() {
            let [x, y] = self.at(row, 0);
            let at = [x - 8.0, y + 0.5 * height];
            write(area, &content.title, at, (TITLE, content.colour), (HPos::Right, VPos::Center))?;
        }
        for (at, row, cell) in self.cells() {
            self.draw_cell(area, at, (row, cell))?;
        }
        Ok(())
    }
}

impl Strip {
    /// The line over neighbouring columns, with their name.
    fn draw_group<B: DrawingBackend>(&self, area: &Area<B>, group: &Group) -> Result<(), Fault<B>> {
        let ([from, _], [to, _]) = (self.at(0, group.columns.start), self.at(0, group.columns.end));
        let (y, colour) = (self.top() - 22.0, if group.strong { INK } else { FAINT });
        segment(area, [[from, y], [to - GAP, y]], line(colour, if group.strong { 2.5 } else { 1.0 }))?;
        let at = [0.5 * (from + to - GAP), y - 5.0];
        write(area, &group.name, at, (TEXT, colour), (HPos::Center, VPos::Bottom))
    }

    /// Border, arrows and note of an image at a place.
    fn draw_cell<B: DrawingBackend>(
        &self,
        area: &Area<B>,
        [x, y]: [f64; 2],
        (row, cell): (&Row, &Cell),
    ) -> Result<(), Fault<B>> {
        let [width, height] = self.cell();
        let corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height], [x, y]];
        for pair in corners.windows(2) {
            segment(area, [pair[0], pair[1]], line(FAINT, 0.5))?;
        }
        for ends in &cell.arrows {
            let place = |p: [f64; 2]| [x + p[0] * width, y + p[1] * height];
            arrow(area, ends.map(place), 3.2, PAPER)?;
            arrow(area, ends.map(place), 1.7, row.colour)?;
        }
        let below = [x + 0.5 * width, y + height + 2.0];
        write(area, &cell.note, below, (TEXT - 2.0, FAINT), (HPos::Center, VPos::Top))
    }
}
