//! `times.csv`: the times of images or moments, in any unit. A row is `KEY,TIME` or just `TIME`; a first row
//! without a number is a heading.

use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::times;
use crate::files;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The file of a set, which need not be there.
pub(super) fn file_of(root: &Path) -> PathBuf {
    root.join("times.csv")
}

/// Rows with their keys, which may be empty.
fn rows(path: &Path) -> Result<Vec<(String, f64)>, DatasetError> {
    let text = String::from_utf8_lossy(&files::read_bytes(path)?).into_owned();
    let mut rows = Vec::new();
    for (line, row) in (1..).zip(text.lines()).filter(|(_, row)| !row.trim().is_empty()) {
        let (key, time) = row.rsplit_once(',').unwrap_or(("", row));
        match time.trim().parse::<f64>() {
            Ok(time) if time.is_finite() => rows.push((key.trim().trim_matches('"').to_owned(), time)),
            Err(_) if line == 1 => {}
            _ => {
                let reason = format!("line {line}: expected a finite time, found `{}`", time.trim());
                return Err(DatasetError::new(path, Problem::Malformed(reason)));
            }
        }
    }
    Ok(rows)
}

/// Times of named images, of a sequence that spans [0, 1); each must have a row.
pub(super) fn of_names(root: &Path, names: &[&str]) -> Result<Vec<f64>, DatasetError> {
    let path = file_of(root);
    let found: BTreeMap<String, f64> = rows(&path)?.into_iter().collect();
    let time = |name: &&str| {
        let bare = name.trim_start_matches("images/");
        let absent = || Problem::Malformed(format!("image `{name}` has no time: expected a row for it"));
        found.get(bare).copied().ok_or_else(|| DatasetError::new(&path, absent()))
    };
    let times = names.iter().map(time).collect::<Result<Vec<f64>, _>>()?;
    Ok(times::spanning(&times))
}

/// Times of so many moments in their order, of a sequence that spans [0, 1); nothing without a file. They
/// must rise.
pub(super) fn of_moments(root: &Path, count: usize) -> Result<Option<Vec<f64>>, DatasetError> {
    let path = file_of(root);
    if !path.exists() {
        return Ok(None);
    }
    let found: Vec<f64> = rows(&path)?.into_iter().map(|(_, time)| time).collect();
    let wrong = |reason| Err(DatasetError::new(&path, Problem::Malformed(reason)));
    if found.len() != count {
        return wrong(format!("expected {count} times, one for every moment, found {}", found.len()));
    }
    if let Some(at) = (1..count).find(|&i| found[i] <= found[i - 1]) {
        let [before, time] = [found[at - 1], found[at]];
        return wrong(format!("time {at} should be above the one before, {before}, found {time}"));
    }
    Ok(Some(times::spanning(&found)))
}
