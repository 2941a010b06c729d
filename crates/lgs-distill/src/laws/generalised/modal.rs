//! Laws of a deforming body: of the amplitudes of its modes, or of its flight and its deformation about its
//! centre (method §4.7).

use super::decomposition::{Decomposition, ENTRIES};
use super::evidence::Evidence;
use super::flying::{OfModes, in_flight};
use super::kinematics::Configured;
use super::observed::Laws;
use super::rated::Rated;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::MOST_MODES;
use lgs_mechanics::choose::{Choice, Judged, choose};
use lgs_mechanics::fit::Track;

/// Rates the laws of the amplitudes for each number of modes, and those of a body in flight; `None` if none
/// can be fitted.
pub(super) fn choose_modal(motion: &SharedMotion, laws: Laws, resolution: f64) -> Option<Rated> {
    let found = Decomposition::of(motion)?;
    let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
    let mut whole = Track::new(&found.coordinates(ENTRIES), &times, &found.amplitudes);
    whole.noise.iter_mut().for_each(|noise| noise.deviation = noise.deviation.hypot(resolution));
    let size = (whole.independent_samples(), ENTRIES * times.len());
    let of_modes = (1..=MOST_MODES).flat_map(|modes| of_amplitudes(&found, modes, &whole, laws));
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

/// The laws of the first amplitudes, in normal modes where they have any.
fn of_amplitudes(found: &Decomposition, modes: usize, whole: &Track, laws: Laws) -> Vec<OfModes> {
    let system = || found.configured(modes, whole);
    let Configured { coordinates, x, .. } = system();
    let noise = whole.noise[..modes].to_vec();
    let track = Track { noise, ..Track::new(&coordinates, &whole.times, &x) };
    let choice = choose(&laws.candidates(&coordinates), &track, &track.scales(&coordinates));
    let judged = choice.map_or_else(Vec::new, |choice| choice.judged);
    let own = |judged: Judged| match found.freed(&judged, &system(), &track) {
        Some((system, judged, posterior)) => (system, judged, Some(posterior)),
        None => (system(), judged, None),
    };
    judged.into_iter().map(own).collect()
}
