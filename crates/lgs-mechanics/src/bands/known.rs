//! What is known of a law beside the law itself.

use super::edited::{PosteriorLaws, Stepped};
use super::{Verdict, trusted};
use crate::coordinates::{Bodies, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::thresholds::{EDITED_POINTS, EXPLAINED_WINDOWS, TRUSTED_FRACTION};
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
    /// Laws by which forecasts of edited motions are judged, of a law that explains the motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posterior: Option<PosteriorLaws>,
}

impl Known {
    /// Takes the radius of a band (infinite where it has none) at some times, and from it the times between
    /// which the forecast is trusted and whether the law explains the motion. `window` is the duration of the
    /// captured window, `path` the length of the path in such a time. A law that something outside of it
    /// strikes in the window is not trusted beyond it: nobody knows what strikes next.
    pub fn take_band(&mut self, law: &Law, band: (&[f64], &[f64]), window: f64, path: f64) {
        self.take_band_with_hits(band, window, path);
        if !law.impulses.is_empty() {
            self.limit_to_window(window);
        }
    }

    /// The same of a law whose impulses are all hits of a contact, which the band has also after the window.
    pub fn take_band_with_hits(&mut self, (times, radius): (&[f64], &[f64]), window: f64, path: f64) {
        self.trusted = trusted(times, radius, [0.0, window], TRUSTED_FRACTION * path);
        let explains = self.trusted[1] >= EXPLAINED_WINDOWS * window;
        self.verdict = if explains { Verdict::Explained } else { Verdict::Described };
        let radius = radius.iter().map(|radius| radius.is_finite().then_some(*radius)).collect();
        self.band = PositionBand { times: times.to_vec(), radius };
    }

    /// Takes a wider band in the place of its own, as [`Self::take_band`] does. What did not explain the
    /// motion before does not do so now, nor is trusted beyond the window what was limited to it.
    pub fn widen(&mut self, law: &Law, band: (&[f64], &[f64]), window: f64, path: f64) {
        let (verdict, [since, until]) = (self.verdict, self.trusted);
        self.take_band(law, band, window, path);
        if since >= 0.0 && until <= window {
            self.limit_to_window(window);
        }
        if verdict != Verdict::Explained {
            self.verdict = verdict;
        }
    }

    /// Trusts no forecast beyond the window, as where those of its parts from each other have failed.
    pub fn limit_to_window(&mut self, window: f64) {
        self.trusted = self.trusted.map(|time| time.clamp(0.0, window));
        if self.verdict == Verdict::Explained {
            self.verdict = Verdict::Described;
        }
    }

    /// Times between which the forecast of an edited motion by a law is trusted: those where the 90 % band
    /// around it is narrower than a fraction of the path, and that of the motion as it was too. `points` are
    /// the particles of the bodies at t = 0, world units. Nothing where no laws were drawn.
    #[must_use]
    pub fn trusted_under(
        &self,
        edit: Edit,
        law: (&Law, &State),
        points: (&Bodies, &[[f32; 3]]),
    ) -> Option<[f64; 2]> {
        self.trusted_by(self.posterior.as_ref()?, edit, law, points)
    }

    /// The same where other drawn laws say how the edited motion goes: with the hits that follow.
    #[must_use]
    pub fn trusted_by(
        &self,
        changed: &PosteriorLaws,
        edit: Edit,
        law: (&Law, &State),
        points: (&Bodies, &[[f32; 3]]),
    ) -> Option<[f64; 2]> {
        let radius = self.radius_by(changed, edit, law, points)?;
        let [since, until] = trusted(&self.band.times, &radius, [0.0; 2], TRUSTED_FRACTION * changed.path);
        Some([since.max(self.trusted[0]), until.min(self.trusted[1])])
    }

    /// Radius of the 90 % band around an edited motion as drawn laws have it, at the times of the band.
    #[must_use]
    pub fn radius_by(
        &self,
        changed: &PosteriorLaws,
        edit: Edit,
        (law, start): (&Law, &State),
        (bodies, points): (&Bodies, &[[f32; 3]]),
    ) -> Option<Vec<f64>> {
        let posterior = self.posterior.as_ref()?;
        let (times, points) = (&self.band.times, bodies.spread(points, EDITED_POINTS));
        let longest = law.under(edit, start, *times.last()?).step;
        let edit = Stepped { scales: edit, longest };
        let wider = self.rms_radius(posterior.window) / posterior.radius;
        let wider = if wider.is_finite() { wider.max(1.0) } else { f64::INFINITY };
        let unedited = Stepped { scales: Edit::NONE, ..edit };
        let own = posterior.radius(unedited, times, &points);
        let edited = changed.radius(edit, times, &points);
        // The band, widened as the draws are by the edit; or the draws, widened as the band is since.
        let band = self.band.radius.iter().map(|radius| radius.unwrap_or(f64::INFINITY));
        let both = band.zip(own.iter().zip(&edited));
        Some(both.map(|(band, (own, edited))| (band * (edited / own).max(1.0)).min(edited * wider)).collect())
    }

    /// Takes scaled terms as the law to be known, with a factor for each term.
    pub fn scale_terms(&mut self, factors: &[f64]) {
        self.posterior.iter_mut().for_each(|posterior| posterior.scale_terms(factors));
    }

    /// Root mean square radius of the band in a window from t = 0 on.
    #[must_use]
    pub fn rms_radius(&self, window: f64) -> f64 {
        let radius = |(_, radius): (&f64, &Option<f64>)| radius.unwrap_or(f64::INFINITY).powi(2);
        let inside = self.band.times.iter().zip(&self.band.radius);
        let inside: Vec<f64> = inside.filter(|(t, _)| (0.0..=window).contains(*t)).map(radius).collect();
        (inside.iter().sum::<f64>() / inside.len().max(1) as f64).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::Coordinates;

    #[test]
    fn a_wider_band_extends_no_trust_beyond_the_window() {
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.1).expect("a law");
        let (times, radius): (Vec<f64>, Vec<f64>) = (0..31).map(|k| (0.1 * f64::from(k), 1e-3)).unzip();
        let wider: Vec<f64> = radius.iter().map(|radius| 2.0 * radius).collect();
        let widened = |is_limited: bool| {
            let mut known = Known::default();
            known.take_band(&law, (&times, &radius), 1.0, 1.0);
            if is_limited {
                known.limit_to_window(1.0);
            }
            known.widen(&law, (&times, &wider), 1.0, 1.0);
            (known.verdict, known.trusted[1])
        };
        assert_eq!(widened(false), (Verdict::Explained, times[30]));
        assert_eq!(widened(true), (Verdict::Described, 1.0));
    }
}
