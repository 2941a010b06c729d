//! Ranges of settings.

use std::fmt::Display;

/// Whether values lie between their bounds, each given as (field, value, least, most).
///
/// # Errors
/// The first field out of range, and the reason.
pub(in crate::source) fn within<T: PartialOrd + Display>(
    ranges: &[(&'static str, T, T, T)],
) -> Result<(), (&'static str, String)> {
    match ranges.iter().find(|(_, value, low, high)| !(low <= value && value <= high)) {
        Some((field, value, low, high)) => Err((field, format!("{value} is not between {low} and {high}"))),
        None => Ok(()),
    }
}
