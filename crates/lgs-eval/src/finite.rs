//! Numbers that a file can hold.

/// The number, or nothing if it is NaN or infinite.
pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
