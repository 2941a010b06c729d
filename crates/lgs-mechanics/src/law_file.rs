//! The file form of laws, for any serde format with maps: JSON, TOML.
//!
//! ```json
//! {
//!   "coordinates": { "kind": "point" },
//!   "step": 0.005,
//!   "terms": [
//!     { "kind": "uniform-field", "on": "whole",
//!       "parameters": { "field-x": 0.0, "field-y": 0.0, "field-z": -9.81 } }
//!   ]
//! }
//! ```

use crate::contact::{Contact, Impact};
use crate::coordinates::{Coordinates, Port};
use crate::error::MechanicsError;
use crate::law::{Law, check_term, ranges, space_of};
use crate::terms::{Parameter, Term};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

/// Values by name.
type Values = BTreeMap<String, f64>;

/// A law as it stands in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LawFile {
    step: f64,
    coordinates: Coordinates,
    /// Parameters of the coordinates.
    #[serde(default, skip_serializing_if = "Values::is_empty")]
    inertia: Values,
    #[serde(default, skip_serializing_if = "Values::is_empty")]
    inertia_deviations: Values,
    terms: Vec<TermFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contact: Option<Contact>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    impacts: Vec<Impact>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    impulses: Vec<Impact>,
    /// In files of earlier versions: impacts of a law with a contact, impulses of one without.
    #[serde(default, skip_serializing)]
    events: Vec<Impact>,
}

/// A term as it stands in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TermFile {
    kind: String,
    on: Port,
    parameters: Values,
    #[serde(default, skip_serializing_if = "Values::is_empty")]
    deviations: Values,
}

impl Serialize for Law {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        LawFile::from(self.clone()).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Law {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        LawFile::deserialize(deserializer)?.try_into().map_err(D::Error::custom)
    }
}

impl From<Law> for LawFile {
    fn from(law: Law) -> Self {
        let own = law.coordinates.parameters();
        let named = |parameters: &[Parameter], values: &[f64]| -> Values {
            parameters.iter().map(|parameter| parameter.name.clone()).zip(values.iter().copied()).collect()
        };
        let part = |values: &[f64], range: std::ops::Range<usize>| values.get(range).unwrap_or(&[]).to_vec();
        let ranges = ranges(&law.coordinates, &law.terms);
        let write = |(term, range): (&Term, std::ops::Range<usize>)| {
            let parameters = term.kind.parameters(space_of(&law.coordinates, term));
            TermFile {
                kind: term.kind.name().to_owned(),
                on: term.port,
                parameters: named(&parameters, &part(&law.parameters, range.clone())),
                deviations: named(&parameters, &part(&law.deviations, range)),
            }
        };
        Self {
            step: law.step,
            inertia: named(&own, &part(&law.parameters, 0..own.len())),
            inertia_deviations: named(&own, &part(&law.deviations, 0..own.len())),
            terms: law.terms.iter().zip(ranges).map(write).collect(),
            coordinates: law.coordinates,
            contact: law.contact,
            impacts: law.impacts,
            impulses: law.impulses,
            events: Vec::new(),
        }
    }
}

impl TryFrom<LawFile> for Law {
    type Error = MechanicsError;

    fn try_from(file: LawFile) -> Result<Self, MechanicsError> {
        let coordinates = file.coordinates;
        coordinates.check()?;
        let own = coordinates.parameters();
        let mut parameters = values_of(coordinates.name(), &own, file.inertia)?;
        let known =
            !file.inertia_deviations.is_empty() || file.terms.iter().any(|t| !t.deviations.is_empty());
        let mut deviations = Vec::new();
        if known {
            deviations = listed(coordinates.name(), &own, file.inertia_deviations)?;
        }
        let mut terms = Vec::new();
        for entry in file.terms {
            let term = Term::named(&entry.kind, entry.on)?;
            check_term(&coordinates, &term)?;
            let described = term.kind.parameters(space_of(&coordinates, &term));
            parameters.extend(values_of(&entry.kind, &described, entry.parameters)?);
            if known {
                deviations.extend(listed(&entry.kind, &described, entry.deviations)?);
            }
            terms.push(term);
        }
        let (step, contact) = (file.step, file.contact);
        let (mut impacts, mut impulses) = (file.impacts, file.impulses);
        if contact.is_some() { &mut impacts } else { &mut impulses }.extend(file.events);
        let law = Self { coordinates, terms, parameters, deviations, step, contact, impacts, impulses };
        law.check()?;
        Ok(law)
    }
}

/// The values of parameters in their order, all of them and no others.
fn listed(owner: &str, described: &[Parameter], mut values: Values) -> Result<Vec<f64>, MechanicsError> {
    let size = |what: String, found| MechanicsError::Size { what, expected: described.len(), found };
    let take = |parameter: &Parameter| {
        let found = values.len();
        let value = values.remove(&parameter.name);
        value.ok_or_else(|| size(format!("parameters of {owner} without `{}`", parameter.name), found))
    };
    let list = described.iter().map(take).collect::<Result<Vec<_>, _>>()?;
    match values.keys().next() {
        None => Ok(list),
        Some(name) => {
            Err(size(format!("parameters of {owner} with the unknown `{name}`"), list.len() + values.len()))
        }
    }
}

/// The same with values checked against those of their bounds that have no scale.
fn values_of(owner: &str, described: &[Parameter], values: Values) -> Result<Vec<f64>, MechanicsError> {
    let list = listed(owner, described, values)?;
    for (parameter, &value) in described.iter().zip(&list) {
        let [lower, upper] = parameter.absolute_bounds();
        if !(lower..=upper).contains(&value) {
            let what = format!("`{}` of {owner}", parameter.name);
            let allowed = format!("{lower} to {upper}");
            return Err(MechanicsError::OutOfBounds { what, value, allowed });
        }
    }
    Ok(list)
}
