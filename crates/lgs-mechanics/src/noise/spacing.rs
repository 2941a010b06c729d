//! Distances of samples in time, in units of the usual one.

/// How far the samples of a track lie apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Spacing {
    /// Interval before each sample over the median interval; 0 for the first.
    before: Vec<f64>,
}

impl Spacing {
    /// Spacing of ascending times.
    #[must_use]
    pub fn of(times: &[f64]) -> Self {
        let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = gaps.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).map_or(1.0, |gap| gap.max(f64::MIN_POSITIVE));
        Self { before: std::iter::once(0.0).chain(gaps.iter().map(|gap| gap / median)).collect() }
    }

    /// The spacing of a range of samples.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let mut before = self.before[range].to_vec();
        before.iter_mut().take(1).for_each(|first| *first = 0.0);
        Self { before }
    }

    /// Share of each sample that counts as independent where neighbours at the usual distance are correlated
    /// by ρ: `(1 − ρ)/(1 + ρ)`, or `tanh(h/2τ)` for a sample that stands for a time `h` in a noise of
    /// correlation time `τ`.
    #[must_use]
    pub fn shares(&self, correlation: f64) -> Vec<f64> {
        let count = self.before.len();
        let share = |k: usize| {
            let after = self.before.get(k + 1).copied();
            let before = (k > 0).then(|| self.before[k]);
            let own = match (before, after) {
                (Some(before), Some(after)) => 0.5 * (before + after),
                (before, after) => before.or(after).unwrap_or(1.0),
            };
            let power = correlation.powf(own);
            (1.0 - power) / (1.0 + power)
        };
        (0..count).map(share).collect()
    }

    /// `1/√(1 − ρ²)` and ρ of each sample with the one before; 1 and 0 for the first.
    pub(super) fn innovations(&self, correlation: f64) -> Vec<[f64; 2]> {
        let one = |(k, gap): (usize, &f64)| {
            let power = if k == 0 { 0.0 } else { correlation.powf(*gap) };
            [1.0 / (1.0 - power * power).sqrt(), power]
        };
        self.before.iter().enumerate().map(one).collect()
    }
}
