//! Legendre polynomials and their derivatives over the window of a track.

/// Times of a track as places in [−1, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    middle: f64,
    half: f64,
}

impl Window {
    pub(super) fn of(times: &[f64]) -> Self {
        let (first, last) = (times[0], times[times.len() - 1]);
        Self { middle: 0.5 * (first + last), half: (0.5 * (last - first)).max(f64::MIN_POSITIVE) }
    }

    /// Values, first and second derivatives by time of the first `count` polynomials.
    pub(super) fn polynomials(&self, time: f64, count: usize) -> [Vec<f64>; 3] {
        let s = (time - self.middle) / self.half;
        let mut found = [vec![1.0, s], vec![0.0, 1.0], vec![0.0, 0.0]];
        for k in 1..count.max(2) {
            let (a, b) = ((2 * k + 1) as f64 / (k + 1) as f64, k as f64 / (k + 1) as f64);
            let value = a * s * found[0][k] - b * found[0][k - 1];
            let first = a * (found[0][k] + s * found[1][k]) - b * found[1][k - 1];
            let second = a * (2.0 * found[1][k] + s * found[2][k]) - b * found[2][k - 1];
            found.iter_mut().zip([value, first, second]).for_each(|(list, value)| list.push(value));
        }
        for (order, list) in found.iter_mut().enumerate() {
            list.truncate(count);
            list.iter_mut().for_each(|value| *value /= self.half.powi(order as i32));
        }
        found
    }
}
