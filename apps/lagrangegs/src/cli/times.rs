//! `--times`: single times, ranges `A:B:STEP`, and comma-separated lists of both.

use super::thresholds::{END_TOLERANCE, LIMIT_TOLERANCE, MAX_TIMES};
use std::path::Path;
use std::str::FromStr;

use anyhow::{Result, bail};
use lgs_model::MotionConfig;

/// Times in the order given.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Times(pub(crate) Vec<f32>);

impl FromStr for Times {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut times = Vec::new();
        for part in text.split(',') {
            let numbers = part.split(':').map(number).collect::<Result<Vec<f64>, String>>()?;
            match numbers[..] {
                [time] => times.push(time as f32),
                [from, to, step] => range(&mut times, from, to, step)?,
                _ => return Err(format!("`{part}` is neither a time nor a range FROM:TO:STEP")),
            }
            if times.len() > MAX_TIMES {
                return Err(format!("more than {MAX_TIMES} times"));
            }
        }
        Ok(Self(times))
    }
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a number")),
    }
}

fn range(times: &mut Vec<f32>, from: f64, to: f64, step: f64) -> Result<(), String> {
    if step <= 0.0 || to < from {
        return Err(format!("the range {from}:{to}:{step} is empty: it needs FROM ≤ TO and STEP > 0"));
    }
    let count = ((to - from) / step + END_TOLERANCE).floor();
    if count >= MAX_TIMES as f64 {
        return Err(format!("more than {MAX_TIMES} times"));
    }
    times.extend((0..=count as usize).map(|i| (from + i as f64 * step) as f32));
    Ok(())
}

impl Times {
    /// Refuses times that the scene of a run or dataset does not allow, naming the range.
    pub(crate) fn check(&self, motion: &MotionConfig, path: &Path) -> Result<()> {
        let (low, high) = motion.time_range();
        if let Some(time) = self.0.iter().find(|&&t| t < low - LIMIT_TOLERANCE || t > high + LIMIT_TOLERANCE)
        {
            bail!("time {time} is outside what the scene allows, {low} to {high}: {}", path.display());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Vec<f32> {
        text.parse::<Times>().expect(text).0
    }

    #[test]
    fn ranges_include_their_ends_and_lists_keep_their_order() {
        assert_eq!(parse("0.5"), [0.5]);
        assert_eq!(parse("-0.75:2.25:0.75"), [-0.75, 0.0, 0.75, 1.5, 2.25]);
        assert_eq!(parse("0:0.3:0.1").len(), 4);
        assert_eq!(parse("2, -0.5,0:0.2:0.1"), [2.0, -0.5, 0.0, 0.1, 0.2]);
        assert_eq!(parse("1:1:0.1"), [1.0]);
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in
            ["", "a", "0:1", "0:1:0", "1:0:0.1", "0:1:-0.1", "0:1:1e-9", "nan", "inf", "0:1:0.1:2", "0,,1"]
        {
            assert!(text.parse::<Times>().is_err(), "{text}");
        }
    }
}
