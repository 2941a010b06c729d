//! Tables as Markdown, CSV, LaTeX and JSON.

use crate::figures::Format;
use crate::tables::{Entry, Table};

/// The text in place of a missing figure.
const MISSING: &str = "n/a";

/// A table as Markdown, with its title above and its notes below.
#[must_use]
pub fn markdown(table: &Table) -> String {
    let head: Vec<String> = heads(table).map(|head| head.replace('|', "\\|")).collect();
    let rule: Vec<&str> =
        table.labels.iter().map(|_| "---").chain((table.labels.len()..head.len()).map(|_| "--:")).collect();
    let mut text = format!("### {}\n\n| {} |\n| {} |\n", table.title, head.join(" | "), rule.join(" | "));
    for row in &table.rows {
        let values = row.entries.iter().flat_map(|entry| printed(table, entry));
        let cells: Vec<String> =
            row.labels.iter().cloned().chain(values).map(|cell| cell.replace('|', "\\|")).collect();
        text.push_str(&format!("| {} |\n", cells.join(" | ")));
    }
    for note in &table.notes {
        text.push_str(&format!("\n{note}\n"));
    }
    text
}

/// A table as CSV: labels, then mean, spread, complete seeds and the paper's number of every column; empty
/// where there is none. Figures are in their own units (fractions, seconds, bytes), with all digits.
#[must_use]
pub fn csv(table: &Table) -> String {
    let mut head: Vec<String> = table.labels.iter().map(|label| (*label).to_owned()).collect();
    for column in &table.columns {
        head.extend(["", " spread", " seeds", " paper"].map(|suffix| format!("{column}{suffix}")));
    }
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    let mut text = line(&head);
    for row in &table.rows {
        let mut cells = row.labels.clone();
        for entry in &row.entries {
            let summary = entry.summary;
            cells.extend([
                number(summary.mean),
                number(summary.spread),
                summary.seeds.to_string(),
                number(entry.paper),
            ]);
        }
        text.push_str(&line(&cells));
    }
    text
}

/// A table as a LaTeX `table` environment that needs no package.
#[must_use]
pub fn latex(table: &Table) -> String {
    let heads: Vec<String> = heads(table).map(|head| escaped(&head)).collect();
    let columns: String = (0..heads.len()).map(|i| if i < table.labels.len() { 'l' } else { 'r' }).collect();
    let mut text = format!(
        "\\begin{{table}}\n\\centering\n\\caption{{{}}}\n\\begin{{tabular}}{{{columns}}}\n\\hline\n",
        escaped(&table.title)
    );
    text.push_str(&format!("{} \\\\\n\\hline\n", heads.join(" & ")));
    for row in &table.rows {
        let values = row.entries.iter().flat_map(|entry| printed(table, entry));
        let cells: Vec<String> =
            row.labels.iter().cloned().chain(values).map(|cell| escaped(&cell)).collect();
        text.push_str(&format!("{} \\\\\n", cells.join(" & ")));
    }
    text.push_str("\\hline\n\\end{tabular}\n\\end{table}\n");
    for note in &table.notes {
        text.push_str(&format!("% {note}\n"));
    }
    text
}

/// All tables as one JSON document: figures in their own units, `null` where there is none.
#[must_use]
pub fn json(suite: &str, tables: &[Table]) -> serde_json::Value {
    serde_json::json!({ "schema": 1, "suite": suite, "tables": tables })
}

/// Heads of all columns.
fn heads(table: &Table) -> impl Iterator<Item = String> {
    let figures = table.columns.iter().flat_map(|column| {
        let paper = table.published.then(|| format!("{column}, paper"));
        [Some(column.clone()), paper].into_iter().flatten()
    });
    table.labels.iter().map(|label| (*label).to_owned()).chain(figures)
}

/// An entry, and the paper's number where the table has such a column.
fn printed(table: &Table, entry: &Entry) -> impl Iterator<Item = String> {
    let number =
        |value: Option<f64>| value.map_or_else(|| MISSING.to_owned(), |v| formatted(v, entry.format));
    let own = match (entry.summary.mean, entry.summary.spread) {
        (Some(mean), Some(spread)) => {
            format!("{} ± {}", formatted(mean, entry.format), formatted(spread, entry.format.unsigned()))
        }
        (mean, _) => number(mean),
    };
    let paper = table.published.then(|| number(entry.paper));
    [Some(own), paper].into_iter().flatten()
}

impl Format {
    /// This format without a sign, for values that are never negative.
    fn unsigned(self) -> Self {
        if let Self::Signed(digits) = self { Self::Number(digits) } else { self }
    }
}

fn formatted(value: f64, format: Format) -> String {
    const MEBIBYTE: f64 = 1024.0 * 1024.0;
    match format {
        Format::Number(digits) => format!("{value:.digits$}"),
        Format::Signed(digits) => format!("{value:+.digits$}"),
        Format::Percent(digits) => format!("{:.digits$} %", 100.0 * value),
        Format::Seconds => format!("{value:.0} s"),
        Format::Bytes => format!("{:.0} MiB", value / MEBIBYTE),
    }
}

/// A line of CSV; fields with commas or quotes are quoted.
fn line(cells: &[String]) -> String {
    let quoted = |cell: &String| {
        if cell.contains([',', '"', '\n']) {
            format!("\"{}\"", cell.replace('"', "\"\""))
        } else {
            cell.clone()
        }
    };
    cells.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n"
}

/// Text that LaTeX prints as it is.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '<' | '>' => out.push_str(&format!("${c}$")),
            '±' => out.push_str("$\\pm$"),
            '−' => out.push_str("$-$"),
            'β' => out.push_str("$\\beta$"),
            'τ' => out.push_str("$\\tau$"),
            _ => out.push(c),
        }
    }
    out
}
