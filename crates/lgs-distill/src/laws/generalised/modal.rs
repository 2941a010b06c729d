//! Laws of a deforming body: of the amplitudes of its modes, or of its flight and its deformation about its
//! centre (method §4.7).

use super::decomposition::{Decomposition, ENTRIES};
use super::evidence::Evidence;
use super::flying::in_flight;
use super::observed::Laws;
use super::rated::Rated;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::MOST_MODES;
use lgs_mechanics::choose::Choice;
use lgs_mechanics::fit::Track;

/// Rates the laws of the amplitudes for each number of modes, and those of a body in flight; `None` if none
/// can be fitted.
pub(super) fn choose_modal(motion: &SharedMotion, laws: Laws, resolution: f64) -> Option<Rated> {
    let found = Decomposition::of(motion)?;
    let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
    let coordinates = found.coordinates(ENTRIES);
    let whole =
        Track::new(&coordinates, &times, &found.amplitudes).coarsened(&coordinates, [0.0, resolution]);
    let size = (whole.independent_samples(), ENTRIES * times.len());
    let of_modes = (1..=MOST_MODES).flat_map(|modes| found.laws(modes, &whole, laws, f64::INFINITY));
    let (mut all, mut known) = (Vec::new(), Vec::new());
    for (system, judged, posterior) in of_modes.chain(in_flight(motion, laws, resolution)) {
        all.push((system, Choice { judged: vec![judged], chosen: 0, samples: size.0 }));
        known.push(posterior);
    }
    let mut rated = Rated::new(all, &|system, law| Evidence::of(system, law, size))?;
    for law in &mut rated.laws {
        if let Some(posterior) = known[law.system].take() {
            law.set(posterior);
        }
    }
    Some(rated)
}
