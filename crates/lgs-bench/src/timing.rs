//! Medians of repeated measurements.

use std::time::Instant;

/// Measurements that a median is taken of.
pub const REPEATS: usize = 7;

/// The median over `repeats` (odd) runs of the wall time of `run`, seconds, after one run that is not counted.
pub fn median_secs<T>(repeats: usize, mut run: impl FnMut() -> T) -> f64 {
    std::hint::black_box(run());
    let mut times: Vec<f64> = (0..repeats)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(run());
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[repeats / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_of_the_counted_runs() {
        let mut runs = 0;
        let secs = median_secs(5, || runs += 1);
        assert!(secs >= 0.0);
        assert_eq!(runs, 6);
    }
}
