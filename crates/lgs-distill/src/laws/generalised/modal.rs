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
    let whole = Track::new(&coordinates, motion.samples(&times), &found.amplitudes)
        .coarsened(&coordinates, [0.0, resolution]);
    let size = (whole.independent_samples(), ENTRIES * times.len());
    let of_modes =
        (1..=MOST_MODES.min(found.count())).flat_map(|modes| found.laws(modes, &whole, laws, f64::INFINITY));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::pose::{Pose, PoseKind};
    use glam::{DMat3, DVec3};

    /// A body that stretches and rises, at so many times.
    fn stretching(times: usize) -> SharedMotion {
        let shape: Vec<DVec3> = (0..27)
            .map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - DVec3::ONE)
            .collect();
        let times: Vec<f64> = (0..times).map(|i| i as f64 / 10.0).collect();
        let pose = |t: &f64| Pose {
            linear: DMat3::from_diagonal(DVec3::new(1.0 + 0.3 * (9.0 * t).sin(), 1.0, 1.0 - 0.2 * t)),
            shift: DVec3::Z * (t - t * t),
        };
        let weights = vec![(shape.len() as f64).recip(); shape.len()];
        let poses = times.iter().map(pose).collect();
        SharedMotion {
            kind: PoseKind::Affine,
            times,
            poses,
            shape,
            weights,
            deviations: Vec::new(),
            residual: 0.0,
        }
    }

    #[test]
    fn a_body_seen_at_few_times_has_no_more_modes_than_times() {
        for times in [4, 8] {
            let found = choose_modal(&stretching(times), Laws::All, 1e-3);
            assert!(found.is_none_or(|rated| rated.chi_square().is_finite()), "{times} times");
        }
    }
}
