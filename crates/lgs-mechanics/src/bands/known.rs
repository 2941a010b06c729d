//! What is known of a law beside the law itself.

use super::{Verdict, trusted};
use crate::law::Law;
use crate::thresholds::{EXPLAINED_WINDOWS, TRUSTED_FRACTION};
use serde::{Deserialize, Serialize};

/// How well a law is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Known {
    /// χ² of the whitened track for each degree of freedom: near 1 for a law that explains it.
    pub chi_square: f64,
    /// Whether the law explains the motion.
    pub verdict: Verdict,
    /// Times since the start between which the forecast is trusted.
    pub trusted: [f64; 2],
    /// Error of forecasts of parts of the window from the rest of it, over the displacement in them, where it
    /// was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forecast_error: Option<f64>,
    /// Laws that the evidence hardly tells from this one, the likeliest first, this one among them; those in
    /// other coordinates are told with these.
    pub rivals: Vec<Rival>,
    /// The 90 % band around the forecast; empty where no law describes the motion.
    pub band: PositionBand,
}

impl Known {
    /// Takes the radius of a band (infinite where it has none) at some times, and from it the times between
    /// which the forecast is trusted and whether the law explains the motion. `window` is the duration of the
    /// captured window, `path` the length of the path in such a time. A law that something outside of it
    /// strikes in the window is not trusted beyond it: nobody knows what strikes next.
    pub fn take_band(&mut self, law: &Law, (times, radius): (&[f64], &[f64]), window: f64, path: f64) {
        self.trusted = trusted(times, radius, [0.0, window], TRUSTED_FRACTION * path);
        let explains = self.trusted[1] >= EXPLAINED_WINDOWS * window;
        self.verdict = if explains { Verdict::Explained } else { Verdict::Described };
        if !law.impulses().is_empty() {
            self.limit_to_window(window);
        }
        let radius = radius.iter().map(|radius| radius.is_finite().then_some(*radius)).collect();
        self.band = PositionBand { times: times.to_vec(), radius };
    }

    /// Trusts no forecast beyond the window: those of its parts from each other have failed.
    pub fn limit_to_window(&mut self, window: f64) {
        self.trusted = self.trusted.map(|time| time.clamp(0.0, window));
        if self.verdict == Verdict::Explained {
            self.verdict = Verdict::Described;
        }
    }
}

/// A law among its rivals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rival {
    /// Names of its terms, joined by ` + `.
    pub terms: String,
    /// Its share of the weights of all.
    pub weight: f64,
}

/// Radius around the forecast positions of an object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionBand {
    /// Times since the start, ascending.
    pub times: Vec<f64>,
    /// Distance that holds 90 % of the posterior of positions, over the particles, world units; none where
    /// rivals cannot be followed.
    pub radius: Vec<Option<f64>>,
}
