//! Legends of charts.

use plotters::element::{Circle, Rectangle};
use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::canvas::{Area, Fault};
use crate::chart::{TEXT, arrow, canvas, segment, write};
use crate::style::{INK, UNIT, filled, letters, line, px};

/// The mark of a series in a legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mark {
    /// A line of a width.
    Line(f64),
    /// A dashed line.
    Dashed,
    /// A disc.
    Dot,
    /// An arrow.
    Arrow,
    /// A square.
    Square,
}

/// One line of entries, from a place to the right.
pub(crate) fn legend<B: DrawingBackend>(
    area: &Area<B>,
    at: [f64; 2],
    entries: &[(Mark, RGBColor, String)],
) -> Result<(), Fault<B>> {
    const SWATCH: f64 = 22.0;
    let mut x = at[0];
    let y = at[1];
    for (mark, colour, text) in entries {
        match mark {
            Mark::Line(width) => segment(area, [[x, y], [x + SWATCH, y]], line(*colour, *width))?,
            Mark::Dashed => {
                for i in 0..3 {
                    let from = x + 8.0 * f64::from(i);
                    segment(area, [[from, y], [from + 5.0, y]], line(*colour, 1.75))?;
                }
            }
            Mark::Dot => area.draw(&Circle::new(canvas([x + 0.5 * SWATCH, y]), px(3.5), filled(*colour)))?,
            Mark::Arrow => arrow(area, [[x, y], [x + SWATCH, y]], 1.5, *colour)?,
            Mark::Square => area.draw(&Rectangle::new(
                [canvas([x + 6.0, y - 5.0]), canvas([x + 16.0, y + 5.0])],
                filled(*colour),
            ))?,
        }
        write(area, text, [x + SWATCH + 5.0, y], (TEXT, INK), (HPos::Left, VPos::Center))?;
        let (width, _) = area.estimate_text_size(text, &letters(TEXT, INK))?;
        x += SWATCH + 5.0 + f64::from(width) / UNIT + 16.0;
    }
    Ok(())
}
