//! What training is going to do and to take, in words.

use std::time::Instant;

use lgs_data::dataset::Dataset;
use lgs_eval::memory::peak_rss_bytes;
use lgs_train::checkpoint::Stage;
use lgs_train::config::Preset;
use lgs_train::device::Device;
use lgs_train::{DataSummary, Estimate, Progress, TrainConfig, TrainError, estimate};

use super::progress::say;
use super::thresholds::{ALIKE, LONG_SECS, SETTLING_SECS};

/// Parses a time such as `40m`, `90s` or `1h30m`, in seconds.
pub(super) fn duration(text: &str) -> Result<f64, String> {
    let (mut secs, mut number) = (0.0, String::new());
    for letter in text.chars() {
        let unit = match letter {
            'h' => 3600.0,
            'm' => 60.0,
            's' => 1.0,
            _ => {
                number.push(letter);
                continue;
            }
        };
        secs += unit * number.parse::<f64>().map_err(|_| expectation(text))?;
        number.clear();
    }
    let is_time = number.is_empty() && secs > 0.0 && f64::is_finite(secs);
    if is_time { Ok(secs) } else { Err(expectation(text)) }
}

fn expectation(text: &str) -> String {
    format!("`{text}` is not a time such as 40m, 90s or 1h30m")
}

/// Seconds for people.
fn spoken(secs: f64) -> String {
    match secs {
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 99.5 * 60.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// The time of all training, which depends on how many Gaussians the scene comes to need.
fn spoken_range(estimate: &Estimate) -> String {
    let [least, most] = [estimate.least_secs, estimate.secs()];
    if least > ALIKE * most {
        return format!("about {}", spoken(most));
    }
    let [least, most] = [least, most].map(spoken);
    format!("{least} to {most}, by the number of Gaussians that the scene comes to need")
}

/// How training of images of a width that takes long is made shorter.
fn shorter(secs: f64, width: u32) -> Option<String> {
    let half = width / 2;
    (secs > LONG_SECS).then(|| {
        format!("; `--size {half}` takes about a quarter of it, and `--time-budget 40m` keeps to a time")
    })
}

/// The time that is left, kept up to date.
pub(super) struct Outlook {
    estimate: Option<Estimate>,
    stage: Option<(Stage, Instant)>,
    /// Time that things take over what was expected of them.
    factor: f64,
}

impl Outlook {
    /// Says what is about to be trained, and about how long it takes.
    pub(super) fn announce(
        dataset: &Dataset,
        config: &TrainConfig,
        device: &Device,
    ) -> Result<Self, TrainError> {
        let estimate = estimate(dataset, config, device)?;
        if let (Some(data), Some(estimate)) = (DataSummary::of(dataset), &estimate) {
            say(&plan(&data, config));
            advice(&data, config).iter().for_each(|advice| tracing::warn!("{advice}"));
            let memory = peak_rss_bytes().map_or_else(String::new, |bytes| {
                format!(", about {:.0} MiB of memory", bytes as f64 / f64::from(1 << 20))
            });
            say(&if config.time_budget_secs > 0.0 {
                let (budget, own) = (spoken(config.time_budget_secs), spoken_range(estimate));
                format!("training takes {budget}, its budget (its schedule alone {own}){memory}")
            } else {
                let shorter = shorter(estimate.secs(), data.size[0]);
                format!("training takes {}{memory}{}", spoken_range(estimate), shorter.unwrap_or_default())
            });
        }
        Ok(Self { estimate, stage: None, factor: 1.0 })
    }

    /// An outlook without an estimate, for a run that goes on.
    pub(super) fn none() -> Self {
        Self { estimate: None, stage: None, factor: 1.0 }
    }

    /// The time that is left, in words; nothing where it is not known.
    pub(super) fn left(&mut self, p: &Progress) -> Option<String> {
        if let Some(secs) = p.left_secs {
            return Some(format!("{} left", spoken(secs)));
        }
        let estimate = self.estimate.as_ref()?;
        if self.stage.is_none_or(|(stage, _)| stage != p.stage) {
            self.stage = Some((p.stage, Instant::now()));
        }
        let (_, begun) = self.stage?;
        let part = p.step as f64 / p.steps.max(1) as f64;
        let (passed, expected) = (begun.elapsed().as_secs_f64(), estimate.within(p.stage, part));
        if expected > SETTLING_SECS {
            self.factor = passed / expected;
        }
        let ahead = estimate.within(p.stage, 1.0) - expected + estimate.after(p.stage);
        Some(format!("about {} left", spoken(self.factor * ahead)))
    }
}

/// What to do instead, where a preset is known to lose what moves.
fn advice(data: &DataSummary, config: &TrainConfig) -> Option<String> {
    let per_time = data.images as f32 / data.times.max(1) as f32;
    let is_sparse = data.times > 1 && per_time < config.source.guide.below_images_per_time;
    let is_quick = config.preset == Preset::Quick && config.source.iterations > 0;
    (is_quick && is_sparse).then(|| {
        format!(
            "each time is shown by {per_time:.1} images: `quick` may lose what moves, `--preset standard` \
             follows it better"
        )
    })
}

/// What the settings become for a dataset.
fn plan(data: &DataSummary, config: &TrainConfig) -> String {
    let source = config.source.resolved(data);
    let width = |level: usize| (data.size[0] >> level).to_string();
    let widths: Vec<String> = (0..=source.coarse_levels).rev().map(width).collect();
    let most = source.densify.max_gaussians;
    let mut text = format!(
        "{} images of {} views and {} times, {} pixels wide; {} iterations, harmonics to degree {}",
        data.images,
        data.views,
        data.times,
        widths.join(" then "),
        source.iterations,
        source.sh_degree
    );
    if most > 0 {
        text.push_str(&format!(", at most {most} Gaussians"));
        if data.points > most {
            text.push_str(&format!("; the {} points of the set are thinned to these", data.points));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_and_spoken() {
        assert_eq!(
            ["40m", "90s", "1h30m", "0.5h"].map(duration),
            [Ok(2400.0), Ok(90.0), Ok(5400.0), Ok(1800.0)]
        );
        for text in ["", "40", "m", "-1m", "0s", "1d", "nanm", "infh", "1m2"] {
            assert!(duration(text).is_err(), "{text}");
        }
        assert_eq!([12.0, 150.0, 2400.0, 10_000.0].map(spoken), ["12 s", "2 min", "40 min", "2.8 h"]);
    }

    #[test]
    fn a_time_that_gaussians_decide_is_spoken_as_a_range() {
        let taking = |least_secs: f64| {
            spoken_range(&Estimate { source: vec![0.0, 600.0], stages: Vec::new(), least_secs })
        };
        assert!(
            taking(120.0).starts_with("2 min to 10 min, by the number of Gaussians"),
            "{}",
            taking(120.0)
        );
        assert_eq!(taking(590.0), "about 10 min");
        assert_eq!(shorter(600.0, 800), None);
        assert!(shorter(1e4, 800).expect("advice").contains("`--size 400`"));
    }
}
