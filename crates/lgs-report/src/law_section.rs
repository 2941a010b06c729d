//! The laws of objects on a run's page: objects whose law is trusted, and apart from them those of which the
//! scene claims less.

use lgs_eval::laws::{
    HitsOfObjects, LawContact, ObjectLaw, TrustedEdit, edit_rows, parameter_rows, rival_rows,
};
use lgs_eval::{Metrics, ObjectSummary, Verdict};
use lgs_mechanics::contact::{Impact, Origin};
use lgs_mechanics::terms::Role;

use crate::axis::number;
use crate::html::{self, FirstRow};

/// The sections of all objects that have a record, and the errors of edited motions; empty without a record.
pub(crate) fn law_sections(metrics: &Metrics) -> String {
    let explained = |law: &ObjectLaw| law.verdict == Verdict::Explained;
    let objects = &metrics.physics.objects;
    let mut text = group("Laws of explained objects", objects, explained);
    text.push_str(&group("Objects without a trusted law", objects, |law| !explained(law)));
    if !text.is_empty() {
        text.push_str(&html::table(
            "Edits: position error against the edited truth, over the length of its path.",
            &edit_rows(&metrics.physics),
            FirstRow::Names,
        ));
    }
    text
}

/// The objects of one kind under a heading; empty without any.
fn group(heading: &str, objects: &[ObjectSummary], belongs: impl Fn(&ObjectLaw) -> bool) -> String {
    let records = objects.iter().enumerate();
    let known = records.filter_map(|(index, object)| Some((index, object.law.as_ref()?)));
    let text: String =
        known.filter(|(_, law)| belongs(law)).map(|(index, law)| section(index, law)).collect();
    if text.is_empty() { text } else { format!("<h2>{heading}</h2>\n{text}") }
}

/// One object: verdict, coordinates, constants with their uncertainty, and rival laws.
fn section(index: usize, law: &ObjectLaw) -> String {
    let coordinates = html::escaped(&law.coordinates);
    let mut text = format!("<h3>Object {index}: {coordinates} coordinates</h3>\n");
    text.push_str(&format!("<p>{}</p>\n", html::escaped(&sentences(law).join(" "))));
    text.push_str(&html::table(
        "Constants for unit mass with their standard deviation; u: world unit, t: unit of time.",
        &parameter_rows(law),
        FirstRow::Names,
    ));
    text + &html::table("Laws by the weight of their evidence.", &rival_rows(law), FirstRow::Names)
}

/// The claims of a record in words.
fn sentences(law: &ObjectLaw) -> Vec<String> {
    let percent = |part: f64, digits| format!("{} %", number(100.0 * part, digits));
    let claim = match law.verdict {
        Verdict::Explained => {
            "Explained: the law describes the captured window and forecasts within its band."
        }
        Verdict::Described => {
            "Described: the law describes the captured window; its forecast is not known to hold."
        }
        Verdict::Outside => {
            "Outside: no law describes the captured window; the motion beyond it is not to be trusted."
        }
    };
    let driven = law.terms.iter().any(|term| term.role == Role::Drives);
    let trust = match law.trusted {
        Some([from, to]) => {
            format!("The forecast is trusted from t = {} to t = {}.", number(from, 2), number(to, 2))
        }
        None => "The forecast is not trusted beyond the captured window.".to_owned(),
    };
    let parts = [
        Some(claim.to_owned()),
        (law.bodies > 1).then(|| format!("The law moves {} bodies, which act on each other.", law.bodies)),
        driven.then(|| "A constant drive may add energy.".to_owned()),
        law.contact.as_ref().map(collision),
        (!law.impulses.is_empty()).then(|| struck(&law.impulses)),
        law.hits.as_ref().map(hits),
        law.shadow_of.map(shadow),
        law.forecast_error.map(|e| {
            format!("Forecasts inside the window are off by {} of the displacement.", percent(e, 2))
        }),
        Some(trust),
        (!law.edits.is_empty()).then(|| edited(&law.edits)),
        law.coverage.map(|c| format!("The 90 % band contains {} of the true positions.", percent(c, 0))),
        law.expected
            .filter(|&expected| !lgs_eval::laws::is_right(law.verdict, expected))
            .map(|_| "The truth contradicts this verdict.".to_owned()),
    ];
    parts.into_iter().flatten().collect()
}

/// How far edited forecasts are trusted, in words.
fn edited(edits: &[TrustedEdit]) -> String {
    let until = |edit: &TrustedEdit| match edit.trusted[1] {
        0.0 => format!("not with {}", edit.name()),
        until => format!("to t = {} with {}", number(until, 2), edit.name()),
    };
    let all: Vec<String> = edits.iter().map(until).collect();
    format!("Edited, it is trusted {}.", all.join(", "))
}

/// What strikes a body, in words.
fn struck(impulses: &[Impact]) -> String {
    let times: Vec<String> = impulses.iter().map(|impulse| number(impulse.time, 3)).collect();
    format!(
        "Something that the law does not know strikes it at t = {}, under an edit as well; what comes after \
         the window is its motion if nothing strikes it again.",
        times.join(", ")
    )
}

/// Other objects that hit one, in words.
fn hits(HitsOfObjects { others, times, .. }: &HitsOfObjects) -> String {
    let others: Vec<String> = others.iter().map(usize::to_string).collect();
    let times: Vec<String> = times.iter().map(|&time| number(time, 3)).collect();
    let seen = if times.is_empty() {
        "not in the window".to_owned()
    } else {
        format!("at t = {}", times.join(", "))
    };
    format!(
        "It is one of the objects that hit each other, with {}: {seen}, and after the window and under edits \
         as their spheres meet.",
        others.join(", ")
    )
}

/// What casts a shadow, in words.
fn shadow(caster: usize) -> String {
    format!("It is the shadow of object {caster}, and goes on with it after the window and under edits.")
}

/// The plane that a body collides with, in words.
fn collision(contact: &LawContact) -> String {
    let plane = match contact.origin {
        Origin::Given => "a given plane",
        Origin::Observed => "a plane in which Gaussians are at rest",
        Origin::Fitted => "a plane that its impacts tell of",
    };
    let times: Vec<String> = contact.impacts.iter().map(|&time| number(time, 3)).collect();
    if times.is_empty() {
        return format!(
            "It is expected to collide with {plane}; none was seen, restitution and friction are assumed."
        );
    }
    let walls = match contact.walls.len() {
        0 => String::new(),
        1 => " and another one".to_owned(),
        more => format!(" and {more} others"),
    };
    format!("It collides with {plane}{walls}; impacts in the captured window: t = {}.", times.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_eval::laws::{LawParameter, LawTerm, RivalLaw};

    fn law(verdict: Verdict) -> ObjectLaw {
        let g = LawParameter { name: "z".into(), value: -0.98, deviation: Some(0.02), unit: "u/t²".into() };
        let field = LawTerm {
            name: "uniform-field".into(),
            port: "center".into(),
            role: Role::Conserves,
            parameters: vec![g],
        };
        let rival = RivalLaw { terms: "uniform-field + linear-drag".into(), weight: 0.125 };
        ObjectLaw {
            coordinates: "rigid".into(),
            terms: vec![field],
            verdict,
            trusted: Some([-0.5, 1.5]),
            rivals: vec![rival],
            ..ObjectLaw::default()
        }
    }

    fn metrics(laws: Vec<Option<ObjectLaw>>) -> Metrics {
        let object = |law| ObjectSummary { law, ..ObjectSummary::default() };
        let mut metrics = Metrics::default();
        metrics.physics.objects = laws.into_iter().map(object).collect();
        metrics
    }

    #[test]
    fn trusted_and_untrusted_objects_stand_apart_with_values_and_rivals() {
        let text = law_sections(&metrics(vec![
            Some(law(Verdict::Outside)),
            None,
            Some(ObjectLaw { expected: Some(Verdict::Outside), ..law(Verdict::Explained) }),
        ]));
        let place = |words: &str| text.find(words).unwrap_or_else(|| panic!("{words}: {text}"));
        assert!(place("Laws of explained objects") < place("Object 2: rigid coordinates"));
        assert!(place("Object 2") < place("Objects without a trusted law"));
        assert!(place("Objects without a trusted law") < place("Object 0: rigid coordinates"));
        place("-0.980 ± 0.020");
        place("uniform-field on center");
        place("12.5 %");
        place("The forecast is trusted from t = −0.50 to t = 1.50.");
        assert_eq!(text.matches("The truth contradicts this verdict.").count(), 1);
    }

    #[test]
    fn a_run_without_records_has_no_section() {
        let mut metrics = metrics(vec![None, None]);
        let errors = [("1.0".to_owned(), Some(0.1))].into();
        metrics.physics.edited_trajectory_error.insert("edit-a".into(), errors);
        assert_eq!(law_sections(&metrics), "");
    }

    #[test]
    fn an_untrusted_and_driven_law_says_so() {
        let mut untrusted = ObjectLaw { trusted: None, bodies: 2, ..law(Verdict::Described) };
        untrusted.terms[0].role = Role::Drives;
        let text = sentences(&untrusted).join(" ");
        for words in ["Described:", "2 bodies", "drive", "not trusted beyond the captured window"] {
            assert!(text.contains(words), "{words}: {text}");
        }
    }
}
