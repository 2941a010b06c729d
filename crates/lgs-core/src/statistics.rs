//! Statistics of samples.

/// The middle one of some values, the upper of two in an even number; none without values.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The distance within which a share of all lies; infinite without any.
#[must_use]
pub fn holding(share: f64, mut distances: Vec<f64>) -> f64 {
    distances.sort_by(f64::total_cmp);
    let last = distances.len().saturating_sub(1);
    distances.get((share * last as f64).ceil() as usize).copied().unwrap_or(f64::INFINITY)
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

    #[test]
    fn a_share_of_all_lies_within_a_distance() {
        assert_eq!(holding(0.9, (0..=10).rev().map(f64::from).collect()), 9.0);
        assert_eq!(holding(0.9, vec![2.0]), 2.0);
        assert_eq!(holding(0.9, Vec::new()), f64::INFINITY);
    }
}
