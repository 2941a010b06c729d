//! Counts of steps, distances and means that several figures need.

use std::collections::BTreeMap;

use lgs_model::MotionConfig;

use crate::thresholds::STEP_TOLERANCE;

/// Number of whole steps to the end of the captured window.
pub(crate) fn window_steps(motion: &MotionConfig) -> usize {
    (f64::from(motion.time_window) / f64::from(motion.dt) + STEP_TOLERANCE).floor() as usize
}

/// Number of whole steps to the end of the long extrapolation, 3 τ_max.
pub(crate) fn long_steps(motion: &MotionConfig) -> usize {
    (3.0 * f64::from(motion.time_window) / f64::from(motion.dt) + STEP_TOLERANCE).floor() as usize
}

/// Distance of two points, in f64.
pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|c| (f64::from(a[c]) - f64::from(b[c])).powi(2)).sum::<f64>().sqrt()
}

/// Length of a vector, in f64.
pub(crate) fn length(a: [f32; 3]) -> f64 {
    distance(a, [0.0; 3])
}

/// Mean of points, in f64; the origin for none.
pub(crate) fn centroid(points: &[[f32; 3]]) -> [f64; 3] {
    let n = points.len().max(1) as f64;
    std::array::from_fn(|c| points.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
}

/// Mean of numbers; nothing for none.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The value below which a fraction `p` of the numbers lies (nearest rank); nothing for none.
pub(crate) fn percentile(mut values: Vec<f64>, p: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = ((values.len() as f64 * p).ceil() as usize).clamp(1, values.len().max(1));
    values.get(rank - 1).copied()
}

/// The label that occurs most often, the smallest of several; nothing for none.
pub(crate) fn most_common(labels: impl Iterator<Item = i32>) -> Option<i32> {
    let mut counts: BTreeMap<i32, usize> = BTreeMap::new();
    for label in labels {
        *counts.entry(label).or_default() += 1;
    }
    counts.into_iter().max_by_key(|&(label, count)| (count, std::cmp::Reverse(label))).map(|(label, _)| label)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_take_the_nearest_rank() {
        let values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!(percentile(values.clone(), 0.5), Some(50.0));
        assert_eq!(percentile(values.clone(), 0.99), Some(99.0));
        assert_eq!(percentile(values, 1.0), Some(100.0));
        assert_eq!(percentile(Vec::new(), 0.5), None);
    }
}
