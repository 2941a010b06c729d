//! Distances of samples in time, in units of the usual one, and how well each of them is known.

/// Ascending times at which something is observed, and how well it is known at each of them.
#[derive(Clone, Copy, Debug)]
pub struct SampleTimes<'a> {
    /// Times, units of the track.
    pub times: &'a [f64],
    /// Standard deviation of each sample in units of the usual one; empty where all are alike.
    pub deviations: &'a [f64],
}

impl SampleTimes<'_> {
    /// Standard deviation of a sample in units of the usual one.
    #[must_use]
    pub fn deviation(&self, sample: usize) -> f64 {
        self.deviations.get(sample).copied().unwrap_or(1.0)
    }
}

impl<'a> From<&'a [f64]> for SampleTimes<'a> {
    fn from(times: &'a [f64]) -> Self {
        Self { times, deviations: &[] }
    }
}

impl<'a> From<&'a Vec<f64>> for SampleTimes<'a> {
    fn from(times: &'a Vec<f64>) -> Self {
        times.as_slice().into()
    }
}

/// How far the samples of a track lie apart, and how well each is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampling {
    /// Interval before each sample over the median interval; 0 for the first.
    before: Vec<f64>,
    /// Standard deviation of each sample in units of the usual one.
    deviations: Vec<f64>,
}

impl Sampling {
    /// The sampling of a track.
    #[must_use]
    pub fn of<'a>(samples: impl Into<SampleTimes<'a>>) -> Self {
        let samples = samples.into();
        let times = samples.times;
        let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = gaps.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).map_or(1.0, |gap| gap.max(f64::MIN_POSITIVE));
        Self {
            before: std::iter::once(0.0).chain(gaps.iter().map(|gap| gap / median)).collect(),
            deviations: (0..times.len()).map(|sample| samples.deviation(sample)).collect(),
        }
    }

    /// The sampling of a range of samples.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let mut before = self.before[range.clone()].to_vec();
        before.iter_mut().take(1).for_each(|first| *first = 0.0);
        Self { before, deviations: self.deviations[range].to_vec() }
    }

    /// Standard deviation of each sample in units of the usual one.
    #[must_use]
    pub fn deviations(&self) -> &[f64] {
        &self.deviations
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
