//! A law in generalised coordinates as a record: names, values and units.

use lgs_mechanics::Law;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::contact::{Contact, Impact};
use lgs_mechanics::mutual_contact::{MutualContact, RoundBody};
use lgs_mechanics::terms::{Entry, Parameter, Quantity, Space};
use lgs_model::ObjectContact;

use super::{HitsOfObjects, LawContact, LawParameter, LawTerm, ObjectLaw};

impl ObjectLaw {
    /// The record of a law: coordinates and terms with values, deviations and units. Trust, rivals and band
    /// are left out.
    #[must_use]
    pub fn describing(law: &Law, verdict: Verdict) -> Self {
        let all: Vec<LawParameter> =
            law.table().iter().enumerate().map(|(index, entry)| parameter(law, index, entry)).collect();
        let term = |(index, term): (usize, &lgs_mechanics::terms::Term)| LawTerm {
            name: term.kind.name().to_owned(),
            port: term.port.name().to_owned(),
            role: term.kind.role(),
            parameters: all[law.range(index)].to_vec(),
        };
        let of_terms: usize = (0..law.terms.len()).map(|index| law.range(index).len()).sum();
        Self {
            coordinates: law.coordinates.name().to_owned(),
            bodies: law.coordinates.bodies(),
            kinetic: all[..all.len() - of_terms].to_vec(),
            terms: law.terms.iter().enumerate().map(term).collect(),
            contact: law.contact.as_ref().map(|contact| describing(contact, &law.impacts)),
            impulses: law.impulses.clone(),
            verdict,
            ..Self::default()
        }
    }
}

impl ObjectLaw {
    /// The record of the shadow of an object that has this one: it is known as far as what casts it.
    #[must_use]
    pub fn of_shadow(&self, caster: usize) -> Self {
        Self {
            coordinates: "shadow".to_owned(),
            shadow_of: Some(caster),
            verdict: self.verdict,
            trusted: self.trusted,
            ..Self::default()
        }
    }

    /// The record of an object that others may hit: impulses that are hits are told of as such.
    #[must_use]
    pub fn with_hits(
        mut self,
        ObjectContact { objects, contact, .. }: &ObjectContact,
        object: usize,
    ) -> Self {
        let Some(body) = objects.iter().position(|&other| other == object) else { return self };
        let MutualContact { bodies, restitution, friction, deviations } = contact;
        let RoundBody { radius, mass, hits, .. } = &bodies[body];
        let (hit, others): (Vec<(usize, Impact)>, Vec<_>) =
            self.impulses.into_iter().enumerate().partition(|(index, _)| hits.contains(index));
        self.impulses = others.into_iter().map(|(_, impulse)| impulse).collect();
        self.hits = Some(HitsOfObjects {
            others: objects.iter().copied().filter(|&other| other != object).collect(),
            times: hit.into_iter().map(|(_, impulse)| impulse.time).collect(),
            parameters: vec![
                LawParameter { unit: "u".to_owned(), ..constant("radius", *radius, 0.0) },
                constant("mass-ratio", *mass, 0.0),
                constant("restitution", *restitution, deviations[0]),
                constant("friction", *friction, deviations[1]),
            ],
        });
        self
    }
}

/// A number without a unit.
fn constant(name: &str, value: f64, deviation: f64) -> LawParameter {
    let deviation = Some(deviation).filter(|deviation| *deviation > 0.0);
    LawParameter { name: name.to_owned(), value, deviation, unit: String::new() }
}

fn describing(contact: &Contact, impacts: &[Impact]) -> LawContact {
    let [restitution, friction] = contact.deviations;
    LawContact {
        normal: contact.plane.normal,
        offset: contact.plane.offset,
        origin: contact.origin,
        walls: contact.walls.clone(),
        parameters: vec![
            constant("restitution", contact.restitution, restitution),
            constant("friction", contact.friction, friction),
        ],
        impacts: impacts.iter().map(|impact| impact.time).collect(),
    }
}

fn parameter(law: &Law, index: usize, (parameter, space): &(Parameter, Space)) -> LawParameter {
    LawParameter {
        name: parameter.name.clone(),
        value: law.parameters[index],
        deviation: law.deviations.get(index).copied(),
        unit: unit_text(parameter, *space),
    }
}

/// The unit of a parameter in a space, such as `u/t²`: `u` is the world's unit of length, `t` the unit of
/// time. Angles are in radians, which are left out of compound units.
#[must_use]
pub fn unit_text(parameter: &Parameter, space: Space) -> String {
    let angular = matches!(space.quantity, Quantity::Angle | Quantity::Rate);
    if angular && parameter.entry == Entry::Place {
        return "rad".to_owned();
    }
    let length = if angular { 0.0 } else { parameter.unit.length };
    let powers = [("u", length), ("t", parameter.unit.time)];
    let part = |sign: f64| -> String {
        powers
            .iter()
            .filter(|(_, power)| sign * power > 0.0)
            .map(|(name, p)| powered(name, sign * p))
            .collect()
    };
    match (part(1.0), part(-1.0)) {
        (above, below) if below.is_empty() => above,
        (above, below) if above.is_empty() => format!("1/{below}"),
        (above, below) => format!("{above}/{below}"),
    }
}

/// A unit with an exponent above zero.
fn powered(unit: &str, power: f64) -> String {
    let raised = [(1.0, ""), (2.0, "²"), (3.0, "³"), (4.0, "⁴")].into_iter().find(|(p, _)| *p == power);
    raised.map_or_else(|| format!("{unit}^{power}"), |(_, sign)| format!("{unit}{sign}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::coordinates::{Coordinates, Hinge, Port};
    use lgs_mechanics::terms::{Role, Term};

    #[test]
    fn a_law_is_described_with_values_deviations_and_units() {
        let term = |name| Term::named(name, Port::Whole).expect(name);
        let terms = vec![term("uniform-field"), term("quadratic-drag")];
        let law = Law::new(Coordinates::Point, terms, vec![0.0, 0.1, -0.98, 0.5], 0.01).expect("law");
        let law = Law { deviations: vec![0.01, 0.02, 0.03, 0.04], ..law };
        let record = ObjectLaw::describing(&law, Verdict::Explained);
        assert_eq!((record.coordinates.as_str(), record.kinetic.len(), record.terms.len()), ("point", 0, 2));
        let [field, drag] = &record.terms[..] else { panic!("two terms") };
        assert_eq!(
            (field.name.as_str(), field.port.as_str(), field.role),
            ("uniform-field", "whole", Role::Conserves)
        );
        assert_eq!((field.parameters[2].value, field.parameters[2].deviation), (-0.98, Some(0.03)));
        assert_eq!((field.parameters[0].unit.as_str(), drag.parameters[0].unit.as_str()), ("u/t²", "1/u"));
        assert_eq!(drag.role, Role::Dissipates);
    }

    #[test]
    fn impulses_by_another_object_are_hits() {
        let impulse = |time: f64| Impact { time, change: vec![1.0, 0.0, 0.0] };
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("law");
        let law = Law { impulses: vec![impulse(0.1), impulse(0.5)], ..law };
        let body = |mass: f64, hits: Vec<usize>| RoundBody { center: [0.0; 3], radius: 0.2, mass, hits };
        let bodies = vec![body(1.0, vec![0]), body(3.0, vec![1])];
        let contact = MutualContact { bodies, restitution: 0.8, friction: 0.0, deviations: [0.05, 0.0] };
        let contact = ObjectContact { objects: vec![0, 2], contact, drawn: Vec::new(), replays_window: true };
        let record = ObjectLaw::describing(&law, Verdict::Described);
        assert_eq!(record.clone().with_hits(&contact, 1), record, "no part of it");
        let record = record.with_hits(&contact, 2);
        assert_eq!(record.impulses, [impulse(0.1)]);
        let hits = record.hits.expect("hits");
        assert_eq!((hits.others, hits.times), (vec![0], vec![0.5]));
        let values: Vec<f64> = hits.parameters.iter().map(|p| p.value).collect();
        assert_eq!((values, hits.parameters[2].deviation), (vec![0.2, 3.0, 0.8, 0.0], Some(0.05)));
    }

    #[test]
    fn angles_have_no_length() {
        let hinge = Hinge { axis: [0.0, 0.0, 1.0], pivot: [0.0; 3] };
        let fourier = Term::named("fourier", Port::Whole).expect("term");
        let unknown = vec![0.0; 2];
        let law = Law::new(Coordinates::Hinge(hinge), vec![fourier], unknown, 0.01).expect("law");
        let record = ObjectLaw::describing(&law, Verdict::Described);
        let units: Vec<&str> = record.terms[0].parameters.iter().map(|p| p.unit.as_str()).collect();
        assert!(units.iter().all(|unit| ["rad", "1/t²"].contains(unit)), "{units:?}");
        assert!(record.terms[0].parameters.iter().all(|p| p.deviation.is_none()));
    }

    #[test]
    fn powers_are_written_as_a_reader_expects_them() {
        let unit = |length: i32, time: i32| unit_text(&Parameter::linear("k", length, time), Space::PLACE);
        assert_eq!(
            [unit(0, 0), unit(1, 0), unit(0, -2), unit(-2, -2), unit(3, -2)],
            ["", "u", "1/t²", "1/u²t²", "u³/t²"]
        );
        let root = unit_text(&Parameter::linear("k", 3, -2).root(2.0), Space::PLACE);
        assert_eq!(root, "u^1.5/t");
    }
}
