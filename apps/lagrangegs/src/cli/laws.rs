//! What a scene knows of its objects' laws.

use lgs_distill::CoordinatesKind;
use lgs_eval::laws::{ObjectLaw, PositionBand, RivalLaw};
use lgs_mechanics::bands::{self, Verdict};
use lgs_model::{GeneralisedDynamics, ObjectModel};

use super::run::Run;

/// A record for every object of a run; none for a run of the paper's particles.
pub(super) fn laws_of(run: &Run) -> Vec<Option<ObjectLaw>> {
    if run.config.distill.coordinates == CoordinatesKind::Particles {
        return Vec::new();
    }
    let window = f64::from(run.scene.motion.time_window);
    run.scene.objects.iter().map(|object| Some(law_of(object, window))).collect()
}

fn law_of(object: &ObjectModel, window: f64) -> ObjectLaw {
    if let Some(dynamics) = object.dynamics.generalised() {
        return known_law(dynamics, window);
    }
    let verdict = if object.recording.is_some() { Verdict::Outside } else { Verdict::Described };
    ObjectLaw { coordinates: "particles".to_owned(), verdict, ..ObjectLaw::default() }
}

fn known_law(GeneralisedDynamics { law, known, .. }: &GeneralisedDynamics, window: f64) -> ObjectLaw {
    let rival = |rival: &bands::Rival| RivalLaw { terms: rival.terms.clone(), weight: rival.weight };
    let bands::PositionBand { times, radius } = known.band.clone();
    ObjectLaw {
        trusted: Some(known.trusted).filter(|trusted| trusted[1] > window),
        rivals: known.rivals.iter().map(rival).collect(),
        band: Some(PositionBand { times, radius }).filter(|band| !band.times.is_empty()),
        ..ObjectLaw::describing(law, known.verdict)
    }
}
