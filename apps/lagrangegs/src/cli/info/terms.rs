//! `lagrangegs info --terms`: the kinds of terms that laws are made of.

use anyhow::Result;
use lgs_eval::laws::unit_text;
use lgs_eval::table::aligned;
use lgs_mechanics::terms::{Quantity, Role, Space, TermKind, kinds};
use serde_json::json;

use super::super::output;

/// The spaces that terms act on, with their names; amplitudes are shown for two modes.
const SPACES: [(&str, Space); 5] = [
    ("place", Space::PLACE),
    ("separation", Space { dimension: 3, quantity: Quantity::Separation }),
    ("angle", Space { dimension: 1, quantity: Quantity::Angle }),
    ("amplitudes", Space { dimension: 2, quantity: Quantity::Amplitude }),
    ("rate", Space { dimension: 3, quantity: Quantity::Rate }),
];

/// Prints every kind, in the order of files.
pub(super) fn list(json: bool) -> Result<()> {
    if json {
        let kind = |&kind: &&dyn TermKind| {
            let parameters: Vec<_> = parameters(kind)
                .into_iter()
                .map(|(name, unit)| json!({ "name": name, "unit": unit }))
                .collect();
            json!({
                "kind": kind.name(), "role": kind.role(), "scaled_by": scale(kind),
                "acts_on": spaces(kind), "parameters": parameters,
            })
        };
        return output::print_json(&kinds().iter().map(kind).collect::<Vec<_>>());
    }
    let header = ["kind", "effect on energy", "edited by", "acts on", "parameters in the first of these"];
    let row = |&kind: &&dyn TermKind| {
        let parameters = parameters(kind).into_iter().map(|(name, unit)| match unit.is_empty() {
            true => name,
            false => format!("{name} [{unit}]"),
        });
        let parameters = parameters.collect::<Vec<_>>().join(", ");
        vec![
            kind.name().to_owned(),
            role(kind).to_owned(),
            scale(kind).to_owned(),
            spaces(kind).join(", "),
            parameters,
        ]
    };
    let rows = std::iter::once(header.map(str::to_owned).to_vec()).chain(kinds().iter().map(row));
    output::print(&aligned(&rows.collect::<Vec<_>>(), &[false; 5]))
}

fn spaces(kind: &dyn TermKind) -> Vec<&'static str> {
    SPACES.iter().filter(|(_, space)| kind.suits(*space)).map(|(name, _)| *name).collect()
}

/// Names and units of the parameters in the first space that suits the kind.
fn parameters(kind: &dyn TermKind) -> Vec<(String, String)> {
    let Some((_, space)) = SPACES.iter().find(|(_, space)| kind.suits(*space)) else { return Vec::new() };
    let named =
        |parameter: &lgs_mechanics::terms::Parameter| (parameter.name.clone(), unit_text(parameter, *space));
    kind.parameters(*space).iter().map(named).collect()
}

fn role(kind: &dyn TermKind) -> &'static str {
    match kind.role() {
        Role::Conserves => "conserves",
        Role::Dissipates => "dissipates",
        Role::Gyroscopic => "does no work",
        Role::Drives => "may add energy",
    }
}

/// The flag of `render` and `export` that scales the kind.
fn scale(kind: &dyn TermKind) -> &'static str {
    match kind.role() {
        Role::Conserves => "--potential-scale",
        Role::Dissipates | Role::Gyroscopic | Role::Drives => "--force-scale",
    }
}
