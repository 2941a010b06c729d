//! Statistics of samples.

/// The middle one of some values, the upper of two in an even number; none without values.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_one_of_the_values() {
        assert_eq!(median([3.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median([3.0, -1.0, 2.0, 7.0]), Some(3.0));
        assert_eq!(median([]), None);
    }
}
