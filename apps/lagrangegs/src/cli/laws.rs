//! What a run knows of its objects' laws: those of the scene, with the verdicts and bands of stage 1.

use lgs_distill::{CoordinatesKind, DistillReport, GeneralisedReport};
use lgs_eval::laws::{ObjectLaw, PositionBand, RivalLaw};
use lgs_mechanics::bands::Verdict;
use lgs_model::ObjectModel;

use super::run::Run;

/// A record for every object of a run; none for a run of the paper's particles, or without a report of stage 1.
pub(super) fn laws_of(run: &Run) -> Vec<Option<ObjectLaw>> {
    if run.config.distill.coordinates == CoordinatesKind::Particles {
        return Vec::new();
    }
    let text = std::fs::read(run.folder.distillation_path()).unwrap_or_default();
    let reports: Vec<DistillReport> = serde_json::from_slice(&text).unwrap_or_default();
    if reports.len() != run.scene.objects.len() {
        return Vec::new();
    }
    let window = f64::from(run.scene.motion.time_window);
    let objects = run.scene.objects.iter().zip(reports);
    objects.map(|(object, report)| Some(law_of(object, report, window))).collect()
}

fn law_of(object: &ObjectModel, report: DistillReport, window: f64) -> ObjectLaw {
    let forecast_error = report.forecast_error.map(|error| error / report.displacement);
    match (object.dynamics.generalised(), report.generalised) {
        (Some(dynamics), Some(known)) => ObjectLaw { forecast_error, ..known_law(dynamics, known, window) },
        _ => {
            let verdict = if object.recording.is_some() { Verdict::Outside } else { Verdict::Described };
            ObjectLaw { coordinates: "particles".to_owned(), verdict, forecast_error, ..ObjectLaw::default() }
        }
    }
}

/// The law of the scene, fitted to the images, with what stage 1 knew of it.
fn known_law(dynamics: &lgs_model::GeneralisedDynamics, known: GeneralisedReport, window: f64) -> ObjectLaw {
    let rival = |rival: lgs_distill::Rival| RivalLaw { terms: rival.terms, weight: rival.weight };
    let lgs_distill::PositionBand { times, radius } = known.band;
    ObjectLaw {
        trusted: Some(known.trusted).filter(|trusted| trusted[1] > window),
        rivals: known.rivals.into_iter().map(rival).collect(),
        band: Some(PositionBand { times, radius }).filter(|band| !band.times.is_empty()),
        ..ObjectLaw::describing(&dynamics.law, known.verdict)
    }
}
