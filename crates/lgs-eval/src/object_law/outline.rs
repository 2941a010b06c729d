//! An object's law in short, with the names that programs which read `metrics.json` rely on.

use std::collections::BTreeMap;

use lgs_mechanics::bands::Verdict;
use lgs_mechanics::terms::Role;
use serde::{Deserialize, Serialize};

use super::{LawParameter, LawTerm, ObjectLaw};

/// The law of an object's motion in short.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LawOutline {
    /// `particles`; `rigid` for a body that is free to move, turning or not; `joint` for one that hinges,
    /// slides, rolls or turns about a point; `modal` for one that deforms; `tree` for two that act on each
    /// other.
    pub coordinates: String,
    /// Energies and forces; none for free motion and for the paper's system.
    pub terms: Vec<TermOutline>,
    /// First and last time of the part of the captured window that these explain, where none explains all of
    /// it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<[f64; 2]>,
    /// Whether networks have a part in U or Q.
    pub networks: bool,
    /// Error of blocked forecasts inside of the captured window, over the displacement in the hidden part.
    pub forecast_error: Option<f64>,
    /// Last time at which the forecast is trusted; nothing where it is not beyond the captured window.
    pub trusted_until: Option<f64>,
    /// First time at which the forecast is trusted, likewise.
    pub trusted_since: Option<f64>,
    /// Claim that the scene makes about the motion.
    pub verdict: Verdict,
    /// Whether a term may add energy.
    pub driven: bool,
}

/// One energy or force in short.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TermOutline {
    /// Kind of the term, as `info --terms` lists them.
    pub kind: String,
    /// Vector of the coordinates that it acts on.
    pub port: String,
    /// Values of its parameters, world units.
    pub values: BTreeMap<String, f64>,
    /// Standard deviations of those that have one.
    pub deviations: BTreeMap<String, f64>,
}

impl LawOutline {
    /// Of a system of particles of which nothing is claimed.
    #[must_use]
    pub fn of_particles(networks: bool) -> Self {
        Self { coordinates: "particles".to_owned(), networks, ..Self::default() }
    }

    /// Of a law.
    #[must_use]
    pub fn of(law: &ObjectLaw, networks: bool) -> Self {
        Self {
            coordinates: class(&law.coordinates).to_owned(),
            terms: law.terms.iter().map(TermOutline::of).collect(),
            part: law.part,
            networks,
            forecast_error: law.forecast_error,
            trusted_until: law.trusted.map(|[_, until]| until),
            trusted_since: law.trusted.map(|[since, _]| since),
            verdict: law.verdict,
            driven: law.terms.iter().any(|term| term.role == Role::Drives),
        }
    }
}

impl TermOutline {
    fn of(term: &LawTerm) -> Self {
        let value = |p: &LawParameter| (p.name.clone(), p.value);
        let deviation = |p: &LawParameter| Some((p.name.clone(), p.deviation?));
        Self {
            kind: term.name.clone(),
            port: term.port.clone(),
            values: term.parameters.iter().map(value).collect(),
            deviations: term.parameters.iter().filter_map(deviation).collect(),
        }
    }
}

/// The class of coordinates with a name.
fn class(coordinates: &str) -> &'static str {
    match coordinates {
        "point" | "rigid" => "rigid",
        "hinge" | "slider" | "rolling" | "ball" => "joint",
        "modal" => "modal",
        "tree" | "pair" => "tree",
        _ => "particles",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::Law;
    use lgs_mechanics::coordinates::{Coordinates, Hinge, Port};
    use lgs_mechanics::terms::Term;

    #[test]
    fn a_law_in_short_has_its_terms_by_name_and_says_what_drives_it() {
        let hinge = Coordinates::Hinge(Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] });
        let terms = vec![Term::named("constant-drive", Port::Whole).expect("a term")];
        let law = Law::new(hinge, terms, vec![0.4], 0.01).expect("a law");
        let law = Law { deviations: vec![0.02], ..law };
        let record = ObjectLaw {
            trusted: Some([-0.5, 1.5]),
            forecast_error: Some(0.01),
            ..ObjectLaw::describing(&law, Verdict::Explained)
        };
        let outline = serde_json::to_value(LawOutline::of(&record, false)).expect("JSON");
        assert_eq!((&outline["coordinates"], &outline["verdict"]), (&"joint".into(), &"explained".into()));
        assert_eq!((&outline["trusted_until"], &outline["driven"]), (&1.5.into(), &true.into()));
        let term = &outline["terms"][0];
        assert_eq!(term["kind"], "constant-drive");
        let [value] = &term["values"].as_object().expect("values").values().collect::<Vec<_>>()[..] else {
            panic!("one value: {term}")
        };
        assert_eq!(value.as_f64(), Some(0.4));
        assert_eq!(term["deviations"].as_object().expect("deviations").len(), 1);
        let particles = serde_json::to_value(LawOutline::of_particles(true)).expect("JSON");
        assert!(particles["trusted_until"].is_null() && particles["networks"] == true);
    }
}
