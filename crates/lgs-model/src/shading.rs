//! Light and shadow on Gaussians over time: a factor of each one's colour, which changes as it is lit
//! differently, by a shadow that passes over it or as it turns to a light. It multiplies colours, moves
//! nothing, and is no part of the mechanics.

use lgs_core::{GaussianCloud, SH_C0};

use crate::tensor_file::{TensorFile, TensorFileError};

/// Name of the logarithms in a file.
const LOG_GAINS: &str = "shading.log_gains";
/// Name of the first and the last time in a file.
const SPAN: &str = "shading.span";

/// The times at which brightnesses are known: evenly spaced, linear in between, constant beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingTimes {
    /// First and last time.
    pub span: [f32; 2],
    /// Number of times, two at least.
    pub count: usize,
}

impl ShadingTimes {
    /// The known times.
    pub fn all(self) -> impl Iterator<Item = f32> {
        let [first, last] = self.span;
        (0..self.count).map(move |index| first + (last - first) * index as f32 / (self.count - 1) as f32)
    }

    /// The index of the known time before a time, and the weight of the one after it, from 0 to 1.
    #[must_use]
    pub fn at(self, time: f32) -> (usize, f32) {
        let [first, last] = self.span;
        let steps = (self.count - 1) as f32;
        let place = (steps * (time - first) / (last - first)).clamp(0.0, steps);
        let before = (place as usize).min(self.count - 2);
        (before, place - before as f32)
    }
}

/// Logarithms of the factors of n Gaussians' colours at known times.
#[derive(Clone, Debug, PartialEq)]
pub struct Shading {
    times: ShadingTimes,
    /// `[n, count]`, row by row.
    log_gains: Vec<f32>,
}

impl Shading {
    /// Factors given by their logarithms `[n, count]`, row by row.
    ///
    /// # Panics
    /// If there are less than two times, their span is empty, or a row is not whole.
    #[must_use]
    pub fn new(times: ShadingTimes, log_gains: Vec<f32>) -> Self {
        assert!(times.count > 1 && times.span[0] < times.span[1], "times of a shading");
        assert!(log_gains.len().is_multiple_of(times.count), "whole rows");
        Self { times, log_gains }
    }

    /// Number of Gaussians.
    #[must_use]
    pub fn len(&self) -> usize {
        self.log_gains.len() / self.times.count
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.log_gains.is_empty()
    }

    /// The times at which factors are known.
    #[must_use]
    pub fn times(&self) -> ShadingTimes {
        self.times
    }

    /// The logarithms `[n, count]`, row by row.
    #[must_use]
    pub fn log_gains(&self) -> &[f32] {
        &self.log_gains
    }

    /// Factors of all Gaussians at a time.
    pub fn gains(&self, time: f32) -> impl Iterator<Item = f32> {
        let (before, part) = self.times.at(time);
        let rows = self.log_gains.chunks_exact(self.times.count);
        rows.map(move |row| (row[before] + part * (row[before + 1] - row[before])).exp())
    }

    /// Gives Gaussians the colours that they have at a time.
    ///
    /// # Panics
    /// If their number is another.
    pub fn shade(&self, cloud: &mut GaussianCloud, time: f32) {
        assert_eq!(cloud.len(), self.len(), "Gaussians of a shading");
        multiply_colors(cloud, 0, self.gains(time));
    }

    /// The factors of some Gaussians, by row.
    #[must_use]
    pub fn select(&self, rows: &[usize]) -> Self {
        let count = self.times.count;
        let row = |&row: &usize| &self.log_gains[row * count..(row + 1) * count];
        Self { times: self.times, log_gains: rows.iter().flat_map(row).copied().collect() }
    }

    /// Adds the factors to a file.
    pub fn insert_into(&self, file: &mut TensorFile) {
        file.insert(SPAN, &[2], &self.times.span);
        file.insert(LOG_GAINS, &[self.len(), self.times.count], &self.log_gains);
    }

    /// Reads what [`Self::insert_into`] wrote, of so many Gaussians; nothing where a file has none.
    ///
    /// # Errors
    /// If an array is absent, not finite or of another shape.
    pub fn read_from(file: &TensorFile, gaussians: usize) -> Result<Option<Self>, TensorFileError> {
        if !file.names().any(|name| name == LOG_GAINS) {
            return Ok(None);
        }
        let (shape, log_gains) = file.values(LOG_GAINS)?;
        let &[rows, count] = shape else {
            return Err(file.field(LOG_GAINS, "shape [n, times]", format!("{shape:?}")));
        };
        if rows != gaussians || count < 2 {
            let expected = format!("{gaussians} rows of two times at least");
            return Err(file.field(LOG_GAINS, &expected, format!("shape {shape:?}")));
        }
        match file.values(SPAN)?.1 {
            &[first, last] if first < last => {
                Ok(Some(Self::new(ShadingTimes { span: [first, last], count }, log_gains.to_vec())))
            }
            found => Err(file.field(SPAN, "a first and a later last time", format!("{found:?}"))),
        }
    }
}

/// Multiplies the colours of Gaussians from a row on by factors.
pub(crate) fn multiply_colors(cloud: &mut GaussianCloud, first: usize, gains: impl Iterator<Item = f32>) {
    let stride = cloud.sh_stride();
    for (gain, sh) in gains.zip(cloud.sh[first * stride..].chunks_exact_mut(stride)) {
        sh.iter_mut().for_each(|value| *value *= gain);
        sh[..3].iter_mut().for_each(|value| *value += shift(gain));
    }
}

/// What is added to the constant coefficients of a colour whose coefficients were multiplied by a factor, so
/// that the colour is multiplied by it: `rgb = 0.5 + SH_C0 · dc + …`.
fn shift(gain: f32) -> f32 {
    (gain - 1.0) * 0.5 / SH_C0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LagrangianScene;
    use crate::lit_testing::{brightness_from_file, defect_of_file, two_gaussians};

    const TIMES: ShadingTimes = ShadingTimes { span: [0.2, 0.8], count: 4 };

    fn shading() -> Shading {
        Shading::new(TIMES, vec![0.0, -0.4, 0.2, 0.6, 0.1, 0.1, -1.0, 0.0])
    }

    #[test]
    fn factors_are_linear_between_times_and_constant_beyond() {
        let at = |time: f32| shading().gains(time).map(f32::ln).collect::<Vec<f32>>();
        let near = |found: Vec<f32>, expected: [f32; 2]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
        };
        near(at(-3.0), [0.0, 0.1]);
        near(at(0.4), [-0.4, 0.1]);
        near(at(0.5), [-0.1, -0.45]);
        near(at(7.0), [0.6, 0.0]);
    }

    #[test]
    fn colours_are_multiplied() {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], 0.1, [0.2, 0.5, 0.8], 0.6);
        shading().shade(&mut cloud, 0.4);
        let [first, second] =
            [&cloud.sh[..3], &cloud.sh[cloud.sh_stride()..]].map(|sh| [0, 1, 2].map(|c| 0.5 + SH_C0 * sh[c]));
        for (c, color) in [0.2, 0.5, 0.8].into_iter().enumerate() {
            assert!((first[c] - color * (-0.4_f32).exp()).abs() < 1e-6, "{first:?}");
            assert!((second[c] - color * 0.1_f32.exp()).abs() < 1e-6, "{second:?}");
        }
    }

    #[test]
    fn scenes_carry_factors_of_static_and_dynamic_gaussians() {
        let with = |shading| LagrangianScene { shading: Some(shading), ..two_gaussians() };
        let found = brightness_from_file(&with(shading()), 0.4);
        for (found, log_gain) in found.into_iter().zip([-0.4_f32, 0.1]) {
            assert!((found - 0.4 * log_gain.exp()).abs() < 1e-6, "{found}, not by {log_gain}");
        }
        let text = defect_of_file(&with(shading().select(&[0])));
        assert!(text.contains(LOG_GAINS) && text.contains("2 rows"), "{text}");
    }

    #[test]
    fn files_round_trip_and_defects_are_named() {
        let mut file = TensorFile::new("test/1");
        assert_eq!(Shading::read_from(&file, 2).expect("nothing"), None);
        shading().insert_into(&mut file);
        assert_eq!(Shading::read_from(&file, 2).expect("read"), Some(shading()));
        let text = Shading::read_from(&file, 3).expect_err("rows").to_string();
        assert!(text.contains("3 rows") && text.contains(LOG_GAINS), "{text}");
        file.insert(SPAN, &[2], &[0.5, 0.5]);
        let text = Shading::read_from(&file, 2).expect_err("span").to_string();
        assert!(text.contains(SPAN), "{text}");
    }
}
