//! Medians of repeated measurements.

use std::time::Instant;

/// Measurements that a median is taken of.
pub const REPEATS: usize = 7;

/// The median over `repeats` (odd) runs of the wall time of `run`, seconds, after one run that is not
/// counted.
pub fn median_secs<T>(repeats: usize, mut run: impl FnMut() -> T) -> f64 {
    let [secs] = medians_in_turns(repeats, [&mut || drop(std::hint::black_box(run()))]);
    secs
}

/// The medians of several operations that take turns, so that what else the machine does in the meantime
/// meets all of them.
pub fn medians_in_turns<const N: usize>(repeats: usize, mut runs: [&mut dyn FnMut(); N]) -> [f64; N] {
    runs.iter_mut().for_each(|run| run());
    let mut times = [const { Vec::new() }; N];
    for _ in 0..repeats {
        for (run, times) in runs.iter_mut().zip(&mut times) {
            let start = Instant::now();
            run();
            times.push(start.elapsed().as_secs_f64());
        }
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[repeats / 2]
    })
}

/// Number of runs in a turn of at least some seconds, by measuring one.
pub fn times_in_turn(secs: f64, run: impl FnMut()) -> usize {
    (secs / median_secs(1, run)).ceil().max(1.0) as usize
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
