//! What a scene knows of its objects' laws.

use anyhow::Result;
use lgs_distill::{CoordinatesKind, DistillReport};
use lgs_eval::laws::{ObjectLaw, PositionBand, RivalLaw};
use lgs_mechanics::bands::{self, Verdict};
use lgs_model::{GeneralisedDynamics, ObjectModel, PartDynamics, Recording};

use super::run::Run;

/// A record for every object of a run; none for a run of the paper's particles.
pub(super) fn laws_of(run: &Run) -> Result<Vec<Option<ObjectLaw>>> {
    if run.config.distill.coordinates == CoordinatesKind::Particles {
        return Ok(Vec::new());
    }
    let window = f64::from(run.scene.motion.time_window);
    let mut reports = run.distillation()?;
    // Images may have put two objects of stage 1 together, after which indices are others.
    if reports.len() != run.scene.objects.len() {
        reports.clear();
    }
    let of_itself = |index: usize| {
        let law = law_of(&run.scene.objects[index], reports.get(index), window);
        match &run.scene.contact {
            Some(contact) => law.with_hits(contact, index),
            None => law,
        }
    };
    let law = |index| match run.scene.caster_of(index) {
        Some(caster) => of_itself(caster).of_shadow(caster),
        None => of_itself(index),
    };
    Ok((0..run.scene.objects.len()).map(|index| Some(law(index))).collect())
}

/// The same with how far forecasts under edits are trusted.
pub(super) fn laws_with_edits(run: &Run) -> Result<Vec<Option<ObjectLaw>>> {
    let laws = laws_of(run)?.into_iter().enumerate();
    Ok(laws.map(|(object, law)| law.map(|law| law.with_edits(&run.scene, object))).collect())
}

fn law_of(object: &ObjectModel, report: Option<&DistillReport>, window: f64) -> ObjectLaw {
    if let Some(law) = object.recording.as_ref().and_then(|recording| law_of_part(recording, window)) {
        return law;
    }
    if let Some(dynamics) = object.dynamics.generalised() {
        return known_law(dynamics, window);
    }
    let verdict = if object.recording.is_some() { Verdict::Outside } else { Verdict::Described };
    let forecast_error = report.and_then(|report| Some(report.forecast_error? / report.displacement));
    let forecast_error = forecast_error.filter(|error| error.is_finite());
    ObjectLaw { coordinates: "particles".to_owned(), verdict, forecast_error, ..ObjectLaw::default() }
}

/// The law of the end of the window, or that of its beginning; none explains all of it.
fn law_of_part(recording: &Recording, window: f64) -> Option<ObjectLaw> {
    let [first, last] = recording.parts();
    let PartDynamics { times, dynamics: GeneralisedDynamics { law, known, .. } } =
        last.as_ref().or(first.as_ref())?;
    let since = first.as_ref().map_or(0.0, |part| part.dynamics.known.trusted[0].min(0.0));
    let end = |part: &PartDynamics| (part.times[0] + part.dynamics.known.trusted[1]).max(window);
    let until = last.as_ref().map_or(window, end);
    Some(ObjectLaw {
        part: Some(*times),
        forecast_error: known.forecast_error,
        trusted: Some([since, until]).filter(|[since, until]| *since < 0.0 || *until > window),
        ..ObjectLaw::describing(law, Verdict::Outside)
    })
}

fn known_law(GeneralisedDynamics { law, known, .. }: &GeneralisedDynamics, window: f64) -> ObjectLaw {
    let rival = |rival: &bands::Rival| RivalLaw { terms: rival.terms.clone(), weight: rival.weight };
    let bands::PositionBand { times, radius } = known.band.clone();
    ObjectLaw {
        forecast_error: known.forecast_error,
        trusted: Some(known.trusted).filter(|trusted| trusted[1] > window),
        rivals: known.rivals.iter().map(rival).collect(),
        band: Some(PositionBand { times, radius }).filter(|band| !band.times.is_empty()),
        ..ObjectLaw::describing(law, known.verdict)
    }
}
