//! Laws of a deforming body: of the amplitudes of its modes, or of its flight and its deformation about its
//! centre (method §4.7).

use super::decomposition::{Decomposition, ENTRIES};
use super::evidence::Evidence;
use super::flying::in_flight;
use super::observed::Laws;
use super::rated::Rated;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::MOST_MODES;
use lgs_mechanics::choose::{Choice, choose};
use lgs_mechanics::fit::Track;

/// Rates the laws of the amplitudes for each number of modes; `None` if none can be fitted.
pub(super) fn choose_modal(motion: &SharedMotion, laws: Laws, resolution: f64) -> Option<Rated> {
    let found = Decomposition::of(motion)?;
    let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
    let all = found.coordinates(ENTRIES);
    let mut whole = Track::new(&all, &times, &found.amplitudes);
    whole.noise.iter_mut().for_each(|noise| noise.deviation = noise.deviation.hypot(resolution));
    let size = (whole.independent_samples(), ENTRIES * times.len());
    let mut laws_of = Vec::new();
    let mut known = Vec::new();
    for modes in 1..=MOST_MODES {
        let system = found.configured(modes, &whole);
        let track = Track {
            noise: whole.noise[..modes].to_vec(),
            ..Track::new(&system.coordinates, &times, &system.x)
        };
        let list = laws.candidates(&system.coordinates);
        let Some(mut choice) = choose(&list, &track, &track.scales(&system.coordinates)) else { continue };
        choice.judged.retain(|judged| match found.freed(judged, &system, &track) {
            Some((system, judged, posterior)) => {
                let choice = Choice { judged: vec![judged], chosen: 0, samples: choice.samples };
                laws_of.push((system, choice));
                known.push(Some(posterior));
                false
            }
            None => true,
        });
        laws_of.push((system, choice));
        known.push(None);
    }
    for (system, judged, posterior) in in_flight(motion, laws, resolution) {
        laws_of.push((system, Choice { judged: vec![judged], chosen: 0, samples: size.0 }));
        known.push(posterior);
    }
    let mut rated = Rated::new(laws_of, &|system, law| Evidence::of(system, law, size))?;
    for law in &mut rated.laws {
        if let Some(posterior) = known[law.system].take() {
            law.set(posterior);
        }
    }
    Some(rated)
}
