//! Laws that differ from the likeliest one in one of its parts: what holds a body, a uniform field, what
//! turns its velocity, what resists or drives it.

use super::candidates::ENERGIES_OF_AN_AXIS;
use super::{Choice, Effort, Judged, among, judge};
use crate::candidate::Candidate;
use crate::coordinates::{Coordinates, Port};
use crate::fit::Track;
use crate::terms::{Scales, Term};
use rayon::prelude::*;

/// What a part of a law may be, each a set of terms.
type Part = &'static [&'static [&'static str]];

/// Parts of a law of a point. A stiffness that holds it is `spring-positive`; `spring-full`, which may also
/// throw it off, has as many unknowns and would be as likely.
const OF_A_POINT: &[Part] = &[
    &[&[], &["uniform-field"]],
    &[
        &[],
        &["spring"],
        &["spring-positive"],
        &["spring-length"],
        &["quartic-radial"],
        &["quartic-axis"],
        &["central-inverse-square"],
        &["central-logarithm"],
        &["central-power"],
    ],
    &[&[], &["gyroscopic"]],
    &[
        &[],
        &["linear-drag"],
        &["quadratic-drag"],
        &["dry-friction"],
        &["wind-drag"],
        &["linear-drag", "swirl"],
        &["self-excitation"],
    ],
];

/// Parts of a law of an angle or of an offset along a rail.
const OF_AN_AXIS: &[Part] = &[
    ENERGIES_OF_AN_AXIS,
    &[&[], &["constant-drive"]],
    &[&[], &["linear-drag"], &["quadratic-drag"], &["dry-friction"], &["linear-drag", "dry-friction"]],
];

/// The parts of laws in coordinates that combine freely; none where the terms are not such parts.
fn parts_of(coordinates: &Coordinates) -> &'static [Part] {
    match coordinates {
        Coordinates::Point => OF_A_POINT,
        Coordinates::Hinge(_) | Coordinates::Rolling(_) => OF_AN_AXIS,
        _ => &[],
    }
}

/// The choice with admitted laws that have another of the parts of the likeliest one, and then of the one
/// that is the likeliest among these, until none is likelier.
#[must_use]
pub fn choose_among_neighbours(
    mut choice: Choice,
    coordinates: &Coordinates,
    admits: &(dyn Fn(&Candidate) -> bool + Sync),
    (track, scales): (&Track, &Scales),
) -> Choice {
    let parts = parts_of(coordinates);
    let mut tried: Vec<Vec<&str>> = choice.judged.iter().map(names).collect();
    loop {
        let best = names(choice.law());
        let mut near = neighbours(parts, &best);
        near.retain(|terms| !tried.iter().any(|other| is_same(other, terms)));
        tried.extend(near.iter().cloned());
        let next = choice.judged.iter().map(|judged| judged.index + 1).max().unwrap_or(0);
        let fitted = |(i, terms): (usize, Vec<&str>)| {
            let terms = terms.into_iter().map(|name| Term::named(name, Port::Whole).ok());
            let candidate = Candidate::new(coordinates.clone(), terms.collect::<Option<_>>()?).ok()?;
            admits(&candidate).then_some(())?;
            judge(next + i, &candidate, (track, scales), Effort::Rival)
        };
        let found: Vec<Judged> = near.into_par_iter().enumerate().filter_map(fitted).collect();
        let samples = choice.samples;
        let all = choice.judged.into_iter().chain(found).collect();
        choice = among(all, samples).expect("a choice holds a law");
        if names(choice.law()) == best {
            return choice;
        }
    }
}

fn names(judged: &Judged) -> Vec<&'static str> {
    judged.fitted.law.terms.iter().map(|term| term.kind.name()).collect()
}

fn is_same(one: &[&str], other: &[&str]) -> bool {
    one.len() == other.len() && one.iter().all(|name| other.contains(name))
}

/// The sets of terms that differ in one part from a law; none if the law does not consist of such parts.
fn neighbours(parts: &[Part], law: &[&str]) -> Vec<Vec<&'static str>> {
    let own = |part: &Part| {
        let options = part.iter().filter(|terms| terms.iter().all(|name| law.contains(name)));
        options.max_by_key(|terms| terms.len()).copied().unwrap_or_default()
    };
    let own: Vec<&[&'static str]> = parts.iter().map(own).collect();
    if !is_same(&own.concat(), law) {
        return Vec::new();
    }
    let changed = |(at, part): (usize, &Part)| {
        let others = part.iter().filter(|terms| **terms != own[at]).copied();
        let with = |terms: &'static [&'static str]| -> Vec<&'static str> {
            own.iter().enumerate().flat_map(|(i, own)| if i == at { terms } else { *own }).copied().collect()
        };
        others.map(with).collect::<Vec<_>>()
    };
    parts.iter().enumerate().flat_map(changed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neighbour_has_one_other_part() {
        let near = neighbours(OF_A_POINT, &["spring", "linear-drag", "swirl"]);
        let is_near = |wanted: &[&str]| near.iter().any(|terms| is_same(terms, wanted));
        assert!(is_near(&["uniform-field", "spring", "linear-drag", "swirl"]));
        assert!(is_near(&["spring"]) && is_near(&["spring", "linear-drag"]));
        assert!(is_near(&["linear-drag", "swirl"]) && is_near(&["central-power", "linear-drag", "swirl"]));
        assert!(!is_near(&["quartic-axis", "gyroscopic", "linear-drag", "swirl"]));
        assert_eq!(near.len(), 1 + 8 + 1 + 6);
    }

    #[test]
    fn a_law_of_other_parts_has_no_neighbours() {
        assert!(neighbours(OF_A_POINT, &["spring", "quartic-axis"]).is_empty());
        assert!(neighbours(&[], &["spring"]).is_empty());
    }
}
