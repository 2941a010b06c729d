//! Rows and cells of a table.

use super::super::error::TracksProblem;

/// Separators of cells.
const SEPARATORS: [char; 3] = ['\t', ';', ','];
/// Words that stand for a missing number, in small letters.
const MISSING: [&str; 5] = ["", "nan", "null", "none", "n/a"];

/// A line of a table.
pub(super) struct Row<'a> {
    /// Its number, from 1.
    pub(super) line: usize,
    /// Cells without surrounding blanks and quotes.
    pub(super) cells: Vec<&'a str>,
}

impl<'a> Row<'a> {
    /// A cell; empty beyond the last.
    pub(super) fn cell(&self, column: usize) -> &'a str {
        self.cells.get(column).copied().unwrap_or_default()
    }

    pub(super) fn is_blank(&self) -> bool {
        self.cells.iter().all(|cell| cell.is_empty())
    }

    /// The number in a cell; nothing where it says that there is none.
    pub(super) fn number(&self, column: usize) -> Result<Option<f64>, TracksProblem> {
        let cell = self.cell(column);
        if MISSING.contains(&cell.to_ascii_lowercase().as_str()) {
            return Ok(None);
        }
        let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
        number.map(Some).ok_or_else(|| self.refused(column))
    }

    /// The error that a cell holds no number.
    pub(super) fn refused(&self, column: usize) -> TracksProblem {
        let found = self.cell(column).chars().take(40).collect();
        TracksProblem::Cell { line: self.line, column: column + 1, found }
    }
}

/// All lines of a text but comments, separated by whichever separator it has most of.
pub(super) fn rows_of(text: &str) -> Vec<Row<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let count = |separator: &char| text.matches(*separator).count();
    let separator = SEPARATORS.into_iter().max_by_key(count).unwrap_or(',');
    let lines = text.lines().enumerate().filter(|(_, line)| !line.starts_with('#'));
    lines.map(|(index, line)| Row { line: index + 1, cells: split(line, separator) }).collect()
}

/// Cells of a line; separators within quotes separate nothing.
fn split(line: &str, separator: char) -> Vec<&str> {
    let mut is_quoted = false;
    let parts = line.split(|letter: char| {
        is_quoted ^= letter == '"';
        letter == separator && !is_quoted
    });
    parts.map(|cell| cell.trim().trim_matches('"').trim()).collect()
}
