//! Time and memory of training, as `metrics.json` holds them.

use serde::{Deserialize, Serialize};

/// Time and memory of one stage of training.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageCost {
    /// Name of the stage.
    pub stage: String,
    /// Seconds, over all sessions.
    pub secs: f64,
    /// Largest resident set while it ran, bytes, where the operating system tells.
    pub peak_rss_bytes: Option<u64>,
}

/// Time and memory of training.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Cost {
    /// Seconds of training, all stages.
    pub train_secs: Option<f64>,
    /// Largest resident set over all stages, bytes.
    pub peak_rss_bytes: Option<u64>,
    /// Time and memory of every stage, in the order of training.
    pub stages: Vec<StageCost>,
}

impl Cost {
    /// Adds what a session spent in a stage.
    pub fn add_stage(&mut self, stage: &str, secs: f64, peak_rss_bytes: Option<u64>) {
        match self.stages.iter_mut().find(|s| s.stage == stage) {
            Some(known) => {
                known.secs += secs;
                known.peak_rss_bytes = known.peak_rss_bytes.max(peak_rss_bytes);
            }
            None => self.stages.push(StageCost { stage: stage.to_owned(), secs, peak_rss_bytes }),
        }
        self.peak_rss_bytes = self.peak_rss_bytes.max(peak_rss_bytes);
    }
}
