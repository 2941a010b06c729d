//! Records of laws as rows of tables.

use lgs_mechanics::bands::Verdict;
use lgs_mechanics::terms::Role;

use crate::metrics::{Metrics, Physics};
use crate::object_law::{HitsOfObjects, LawParameter, LawTerm, ObjectLaw, RivalLaw, TrustedEdit};
use crate::physics::trajectory::TIMES;

/// Columns that say something of the object and stand in its first row alone.
const OBJECT_COLUMNS: [&str; 6] =
    ["object", "coordinates", "forecast error", "trusted", "in band", "verdict"];

/// A header, then one row per parameter of every object that has a record; empty without a record.
#[must_use]
pub fn law_rows(metrics: &Metrics) -> Vec<Vec<String>> {
    let records = metrics.physics.objects.iter().enumerate();
    let known: Vec<(usize, &ObjectLaw)> =
        records.filter_map(|(index, object)| Some((index, object.law.as_ref()?))).collect();
    if known.is_empty() {
        return Vec::new();
    }
    let [object, coordinates, rest @ ..] = OBJECT_COLUMNS;
    let header = [object, coordinates, "term", "role", "parameter", "value", "unit"].into_iter().chain(rest);
    let mut rows = vec![header.map(str::to_owned).collect()];
    for (index, law) in known {
        for (row, parameter) in parameter_rows(law).into_iter().skip(1).enumerate() {
            let [number, name, rest @ ..] =
                if row == 0 { object_cells(index, law) } else { std::array::from_fn(|_| String::new()) };
            rows.push([number, name].into_iter().chain(parameter).chain(rest).collect());
        }
    }
    rows
}

/// The cells of [`OBJECT_COLUMNS`].
fn object_cells(index: usize, law: &ObjectLaw) -> [String; 6] {
    let percent = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |v| format!("{:.digits$} %", 100.0 * v))
    };
    let trusted = law.trusted.map_or_else(|| "-".to_owned(), |[from, to]| format!("{from:.2} .. {to:.2}"));
    let verdict = match law.expected {
        Some(expected) if !super::is_right(law.verdict, expected) => {
            format!("{} (expected {})", verdict_name(law.verdict), verdict_name(expected))
        }
        _ => verdict_name(law.verdict).to_owned(),
    };
    let coordinates = match law.part {
        Some([from, to]) => format!("{}, t = {from:.2} .. {to:.2}", law.coordinates),
        None => law.coordinates.clone(),
    };
    [
        index.to_string(),
        coordinates,
        percent(law.forecast_error, 2),
        trusted,
        percent(law.coverage, 0),
        verdict,
    ]
}

/// A header, then one row per parameter of a law: term, role, parameter, value and unit; one row says so
/// where there is none.
#[must_use]
pub fn parameter_rows(law: &ObjectLaw) -> Vec<Vec<String>> {
    let mut rows = vec![["term", "role", "parameter", "value", "unit"].map(str::to_owned).to_vec()];
    let row = |term: &str, role: &str, p: &LawParameter| {
        let value = measured(p.value, p.deviation);
        vec![term.to_owned(), role.to_owned(), p.name.clone(), value, p.unit.clone()]
    };
    rows.extend(law.kinetic.iter().map(|p| row("kinetic energy", "", p)));
    for term in &law.terms {
        let (name, role) = (term_name(term), role_name(term.role));
        if term.parameters.is_empty() {
            rows.push(row(&name, role, &LawParameter::default())[..2].to_vec());
        }
        rows.extend(term.parameters.iter().map(|p| row(&name, role, p)));
    }
    match law.shadow_of {
        Some(caster) => rows.push(vec![format!("shadow of {caster}")]),
        None if law.terms.is_empty() => rows.push(vec!["free motion".to_owned()]),
        None => {}
    }
    let contact = law.contact.iter();
    rows.extend(contact.flat_map(|contact| contact.parameters.iter().map(|p| row("contact", "", p))));
    for impulse in &law.impulses {
        let size = impulse.change.iter().map(|change| change * change).sum::<f64>().sqrt();
        let name = format!("change at t = {:.3}", impulse.time);
        rows.push(row("impulse", "", &LawParameter { name, value: size, ..LawParameter::default() }));
    }
    if let Some(HitsOfObjects { others, times, parameters }) = &law.hits {
        let others: Vec<String> = others.iter().map(usize::to_string).collect();
        let name = format!("hits of {}", others.join(", "));
        rows.extend(parameters.iter().map(|p| row(&name, "", p)));
        let times: Vec<String> = times.iter().map(|time| format!("{time:.3}")).collect();
        rows.extend(
            (!times.is_empty()).then(|| vec![name, String::new(), "at t".to_owned(), times.join(", ")]),
        );
    }
    rows.iter_mut().for_each(|row| row.resize(5, String::new()));
    rows
}

/// A header, then how far the forecast of each object under each edit is trusted; empty where none is told
/// of.
#[must_use]
pub fn trusted_edit_rows(metrics: &Metrics) -> Vec<Vec<String>> {
    let records = metrics.physics.objects.iter().enumerate();
    let of_object = |(index, law): (usize, &ObjectLaw)| {
        let row = move |edit: &TrustedEdit| {
            let [from, to] = edit.trusted;
            vec![index.to_string(), edit.name(), format!("{from:.2} .. {to:.2}")]
        };
        law.edits.iter().map(row).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> =
        records.filter_map(|(i, object)| Some((i, object.law.as_ref()?))).flat_map(of_object).collect();
    let header = (!rows.is_empty()).then(|| ["object", "edit", "trusted"].map(str::to_owned).to_vec());
    header.into_iter().chain(rows).collect()
}

/// A header, then terms and weight of every rival law; empty without rivals.
#[must_use]
pub fn rival_rows(law: &ObjectLaw) -> Vec<Vec<String>> {
    let header = (!law.rivals.is_empty()).then(|| vec!["law".to_owned(), "weight".to_owned()]);
    let row = |rival: &RivalLaw| vec![rival.terms.clone(), format!("{:.1} %", 100.0 * rival.weight)];
    header.into_iter().chain(law.rivals.iter().map(row)).collect()
}

/// A header with times, then the position errors under every edit of the dataset; empty without an edit.
#[must_use]
pub fn edit_rows(physics: &Physics) -> Vec<Vec<String>> {
    let errors = &physics.edited_trajectory_error;
    let labels: Vec<String> = TIMES.map(|time| format!("{time:?}")).to_vec();
    let known = |label: &&String| errors.values().any(|by_time| by_time.contains_key(*label));
    let labels: Vec<&String> = labels.iter().filter(known).collect();
    if labels.is_empty() {
        return Vec::new();
    }
    let header =
        std::iter::once("edit".to_owned()).chain(labels.iter().map(|t| format!("t = {t}"))).collect();
    let percent = |error: f64| format!("{:.2} %", 100.0 * error);
    let row = |(split, by_time): (&String, &std::collections::BTreeMap<String, Option<f64>>)| {
        let cell =
            |label: &&String| by_time.get(*label).copied().flatten().map_or_else(|| "-".to_owned(), percent);
        std::iter::once(split.clone()).chain(labels.iter().map(cell)).collect()
    };
    std::iter::once(header).chain(errors.iter().map(row)).collect()
}

/// A value with as many decimals as two digits of its deviation need; with four digits where that is unknown.
#[must_use]
pub fn measured(value: f64, deviation: Option<f64>) -> String {
    let size = |number: f64| if number == 0.0 { 0.0 } else { number.abs().log10().floor() };
    let decimals = |digits: f64, number: f64| (digits - 1.0 - size(number)).clamp(0.0, 9.0) as usize;
    match deviation.filter(|d| d.is_finite() && *d > 0.0) {
        Some(deviation) => {
            let digits = decimals(2.0, deviation);
            format!("{value:.digits$} ± {deviation:.digits$}")
        }
        None => format!("{value:.0$}", decimals(4.0, value)),
    }
}

fn term_name(term: &LawTerm) -> String {
    if term.port == "whole" { term.name.clone() } else { format!("{} on {}", term.name, term.port) }
}

fn role_name(role: Role) -> &'static str {
    match role {
        Role::Conserves => "conserves",
        Role::Dissipates => "dissipates",
        Role::Gyroscopic => "gyroscopic",
        Role::Drives => "drives",
    }
}

/// The verdict's word in tables and files.
#[must_use]
pub fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Explained => "explained",
        Verdict::Described => "described",
        Verdict::Outside => "outside",
    }
}
