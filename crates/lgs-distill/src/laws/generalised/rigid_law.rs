//! Laws of a free rigid body, put together from those of its centre and of its rotation, which do not act on
//! each other.

use crate::thresholds::NO_RIVAL;
use lgs_mechanics::Candidate;
use lgs_mechanics::choose::{Choice, Judged};
use lgs_mechanics::coordinates::{Coordinates, Inertia, Port};
use lgs_mechanics::explain::joined_law;
use lgs_mechanics::terms::Term;

/// All laws of the centre with all laws of the rotation.
pub(super) fn combined(of_center: &Choice, of_spin: &Choice, inertia: &Inertia) -> Option<Choice> {
    let near = |choice: &Choice| -> Vec<Judged> {
        let best = choice.judged.first().map_or(0.0, Judged::score);
        choice.judged.iter().filter(|judged| judged.score() <= best + NO_RIVAL).cloned().collect()
    };
    let (centers, spins) = (near(of_center), near(of_spin));
    let pairs = centers.iter().flat_map(|center| spins.iter().map(move |spin| (center, spin)));
    let joined =
        |(index, (center, spin))| joined_law(index, &candidate(center, spin, inertia)?, [spin, center]);
    let mut all: Vec<Judged> = pairs.enumerate().filter_map(joined).collect();
    all.sort_by(|a, b| a.score().total_cmp(&b.score()));
    let samples = of_center.samples + of_spin.samples;
    (!all.is_empty()).then_some(Choice { judged: all, chosen: 0, samples })
}

/// The terms of the centre, then those of the rotation.
fn candidate(center: &Judged, spin: &Judged, inertia: &Inertia) -> Option<Candidate> {
    let on_center = |term: &Term| Term { kind: term.kind, port: Port::Center };
    let moves = center.fitted.law.terms.iter().map(on_center);
    let terms = moves.chain(spin.fitted.law.terms.iter().copied()).collect();
    Candidate::new(Coordinates::Rigid(*inertia), terms).ok()
}
