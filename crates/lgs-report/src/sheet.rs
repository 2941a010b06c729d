//! Contact sheets: frames in a grid, a label over every column and a title before every row, as one image.
//!
//! Letters have a size that suits the frames.

use lgs_core::Image;
use plotters::style::{FontDesc, FontFamily, FontStyle};

use crate::style::{LOWER, load_letters};
use crate::thresholds::LARGE_FRAME;

/// Height of a line of letters, pixels, beside small and large frames.
const LETTERS: [usize; 2] = [13, 22];

/// Space around frames and letters, pixels.
const MARGIN: usize = 4;

const PAPER: [f32; 3] = [1.0; 3];
const INK: [f32; 3] = [0.1; 3];

/// A row of frames.
#[derive(Clone, Debug)]
pub struct Row {
    /// Written before the frames.
    pub title: String,
    /// The frames; fewer than the sheet has columns leave blanks. All of a sheet should have one size;
    /// smaller ones are centred.
    pub frames: Vec<Image>,
}

/// A grid of frames under column labels.
#[must_use]
pub fn contact_sheet(labels: &[String], rows: &[Row]) -> Image {
    let columns = rows.iter().map(|row| row.frames.len()).max().unwrap_or(0).max(labels.len());
    let frames = || rows.iter().flat_map(|row| &row.frames);
    let (width, height) =
        (frames().map(|f| f.width).max().unwrap_or(1), frames().map(|f| f.height).max().unwrap_or(1));
    // Without letters, which are part of the program, labels would be left out.
    let _ = load_letters();
    let letter = LETTERS[usize::from(width >= LARGE_FRAME)];
    let title_width = rows.iter().map(|row| width_of(&row.title, letter)).max().unwrap_or(0);
    let left = if title_width > 0 { title_width + 2 * MARGIN } else { MARGIN };
    let top = letter + 2 * MARGIN;
    let cell = [width as usize + MARGIN, height as usize + MARGIN];
    let mut sheet =
        Image::filled((left + columns * cell[0]) as u32, (top + rows.len() * cell[1]) as u32, PAPER);
    for (c, label) in labels.iter().enumerate() {
        let room = cell[0].saturating_sub(width_of(label, letter)) / 2;
        write(&mut sheet, label, [left + c * cell[0] + room, MARGIN], letter);
    }
    for (r, row) in rows.iter().enumerate() {
        let y = top + r * cell[1];
        write(&mut sheet, &row.title, [MARGIN, y + (height as usize).saturating_sub(letter) / 2], letter);
        for (c, frame) in row.frames.iter().enumerate() {
            let inset = [(width - frame.width) as usize / 2, (height - frame.height) as usize / 2];
            paste(&mut sheet, frame, [left + c * cell[0] + inset[0], y + inset[1]]);
        }
    }
    sheet
}

/// Indices of at most `count` of `total` items, evenly spaced, first and last among them.
#[must_use]
pub fn evenly(total: usize, count: usize) -> Vec<usize> {
    match (total, count) {
        (0, _) | (_, 0) => Vec::new(),
        (_, 1) => vec![0],
        _ if total <= count => (0..total).collect(),
        _ => (0..count).map(|i| (i * (total - 1) + (count - 1) / 2) / (count - 1)).collect(),
    }
}

fn paste(sheet: &mut Image, frame: &Image, at: [usize; 2]) {
    let (wide, width) = (sheet.width as usize, frame.width as usize);
    for (y, line) in frame.pixels.chunks_exact(width.max(1)).enumerate() {
        let start = (at[1] + y) * wide + at[0];
        sheet.pixels[start..start + width].copy_from_slice(line);
    }
}

/// Writes text with its upper left corner at a pixel; what does not fit is cut off.
fn write(sheet: &mut Image, text: &str, at: [usize; 2], size: usize) {
    let (width, height) = (sheet.width as usize, sheet.height as usize);
    let letters = letters_of(size);
    let pixels = &mut sheet.pixels;
    // Letters that cannot be drawn are left out: a sheet is worth more than its labels.
    let lower = (LOWER * size as f64).round() as i32;
    let _ = letters.draw(text, (at[0] as i32, at[1] as i32 + lower), |x, y, coverage| {
        let (x, y) = (usize::try_from(x).unwrap_or(usize::MAX), usize::try_from(y).unwrap_or(usize::MAX));
        if x < width && y < height {
            let pixel = &mut pixels[y * width + x];
            *pixel = std::array::from_fn(|c| pixel[c] + coverage * (INK[c] - pixel[c]));
        }
        Ok::<(), std::convert::Infallible>(())
    });
}

/// Letters whose lines are `size` pixels high.
fn letters_of(size: usize) -> FontDesc<'static> {
    FontDesc::new(FontFamily::Name("sans-serif"), size as f64, FontStyle::Normal)
}

/// Width of a text, pixels.
fn width_of(text: &str, size: usize) -> usize {
    letters_of(size).box_size(text).map_or(0, |(width, _)| width as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(title: &str, count: usize) -> Row {
        Row { title: title.to_owned(), frames: vec![Image::filled(20, 10, [0.5; 3]); count] }
    }

    #[test]
    fn frames_keep_their_pixels_and_places() {
        let labels: Vec<String> = ["0.00", "0.75", "2.25"].map(str::to_owned).to_vec();
        let sheet = contact_sheet(&labels, &[row("truth", 3), row("model", 2)]);
        assert_eq!(sheet.pixels.len(), sheet.width as usize * sheet.height as usize);
        let grey = sheet.pixels.iter().filter(|p| **p == [0.5; 3]).count();
        assert_eq!(grey, 5 * 200);
        assert!(sheet.pixels.iter().any(|p| p[0] < 0.3), "there are letters");
    }

    #[test]
    fn frames_of_other_sizes_and_no_frames_are_no_panic() {
        let mixed = Row {
            title: String::new(),
            frames: vec![Image::filled(5, 3, [0.0; 3]), Image::filled(9, 30, [0.0; 3])],
        };
        assert!(contact_sheet(&[], &[mixed]).width > 18);
        assert!(contact_sheet(&[], &[]).height > 0);
        assert!(contact_sheet(&["β × ∞ much longer than its frame".to_owned()], &[row("a", 1)]).width > 0);
    }

    #[test]
    fn chosen_frames_include_both_ends() {
        assert_eq!(evenly(100, 4), [0, 33, 66, 99]);
        assert_eq!(evenly(3, 8), [0, 1, 2]);
        assert_eq!(evenly(5, 1), [0]);
        assert!(evenly(0, 3).is_empty());
    }
}
