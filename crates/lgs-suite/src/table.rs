//! A table: rows of summaries, with the paper's numbers beside them.

use serde::Serialize;

use crate::figures::Format;
use crate::results::Summary;

/// A table of summaries.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Name of its files.
    pub id: &'static str,
    /// Title.
    pub title: String,
    /// Titles of the columns of labels.
    pub labels: Vec<&'static str>,
    /// Titles of the columns of figures.
    pub columns: Vec<String>,
    /// Its rows.
    pub rows: Vec<Row>,
    /// Whether any entry has a number of the paper beside it.
    pub published: bool,
    /// Notes below the table.
    pub notes: Vec<String>,
}

/// A row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// One per column of labels.
    pub labels: Vec<String>,
    /// One per column.
    pub entries: Vec<Entry>,
}

/// A figure in a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Our figure.
    #[serde(flatten)]
    pub summary: Summary,
    /// The paper's figure.
    pub paper: Option<f64>,
    /// The format of both.
    pub format: Format,
}

impl Table {
    pub(crate) fn new(
        id: &'static str,
        title: impl Into<String>,
        labels: &[&'static str],
        columns: Vec<String>,
        rows: Vec<Row>,
    ) -> Self {
        let published = rows.iter().flat_map(|row| &row.entries).any(|entry| entry.paper.is_some());
        Self { id, title: title.into(), labels: labels.to_vec(), columns, rows, published, notes: Vec::new() }
    }

    pub(crate) fn noted(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.notes.extend(notes);
        self
    }
}
