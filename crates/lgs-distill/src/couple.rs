//! Two objects that act on each other, as one system.

use crate::config::DistillConfig;
use crate::distilled::DistilledLaw;
use crate::laws::generalised::{Evidence, GeneralisedLaw, Surroundings, find_law};
use crate::object::{Prepared, laws, resolution};
use crate::report::DistillReport;
use lgs_mechanics::Law;
use lgs_mechanics::bands::{Known, Verdict};

/// Whether two objects can be one system of two bodies, by what is known of their own laws: not if these
/// explain both and one of them needs no force but a constant one, nor if one hits something, since laws of
/// two bodies have neither contact nor impulses. A force towards a place may be the other body's.
#[must_use]
pub fn may_be_a_pair(own: [Option<(&Law, &Known)>; 2]) -> bool {
    let is_explained = |(_, known): (&Law, &Known)| known.verdict == Verdict::Explained;
    let is_moved_alone = |(law, _): (&Law, &Known)| !law.has_varying_potential();
    let hits = |(law, known): (&Law, &Known)| !law.is_smooth() && known.verdict != Verdict::Outside;
    let any = |is: &dyn Fn((&Law, &Known)) -> bool| own.into_iter().flatten().any(is);
    let are_explained = own.iter().all(|law| law.is_some_and(is_explained));
    let are_apart = are_explained && any(&is_moved_alone);
    !are_apart && !any(&hits)
}

/// Two objects that act on each other.
pub(crate) struct Couple {
    /// The law of both.
    pub(crate) law: DistilledLaw,
    /// The order in which its coordinates take them.
    pub(crate) order: [usize; 2],
    /// How much likelier it is than a law for each of them, in units of χ².
    pub(crate) gain: f64,
}

/// How much likelier a law of two bodies together is than a law for each of them, in units of χ²; `None` if
/// it is not.
pub(crate) fn gain(both: &GeneralisedLaw, [a, b]: [&GeneralisedLaw; 2]) -> Option<f64> {
    let (together, apart) = (both.evidence?, a.evidence?.and(b.evidence?));
    let inflation = Evidence::inflation([together, apart].into_iter());
    let gain = apart.score(inflation) - together.score(inflation);
    tracing::debug!(gain, inflation, ?together, ?apart, "two objects as one system?");
    (gain > 0.0).then_some(gain)
}

/// Pairs of objects that may be one system, by their own laws.
pub(crate) fn possible_pairs(objects: &[Option<Prepared>]) -> Vec<[usize; 2]> {
    let law = |object: usize| objects[object].as_ref()?.law().map(|(_, law)| (&law.law, &law.known));
    let may = |&[a, b]: &[usize; 2]| {
        let own = [law(a), law(b)];
        !own.contains(&None) && may_be_a_pair(own)
    };
    (0..objects.len()).flat_map(|a| (a + 1..objects.len()).map(move |b| [a, b])).filter(may).collect()
}

/// The law of a possible pair, if it describes both and is likelier than a law for each of them.
pub(crate) fn couple(objects: [&Prepared; 2], config: &DistillConfig, seed: u64) -> Option<Couple> {
    let [(first, a), (second, b)] = [objects[0].law()?, objects[1].law()?];
    let shared = [&first.shared.as_ref()?.shared, &second.shared.as_ref()?.shared];
    let around = (laws(config)?, Surroundings::default());
    let found = find_law(&shared, around, resolution(config), seed)?;
    if found.is_refuted || found.known.verdict == Verdict::Outside {
        return None;
    }
    let gain = gain(&found, [a, b])?;
    let order = [found.order[0], found.order[1]];
    let reports = [first, second].map(DistillReport::of_motion);
    let law = found.distilled(&order.map(|i| shared[i]), &DistillReport::joined(&reports), config);
    law.report.describes_window(config).then_some(Couple { law, order, gain })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::coordinates::{Coordinates, Port};
    use lgs_mechanics::terms::Term;

    #[test]
    fn a_force_towards_a_place_may_be_that_of_another_body() {
        let law = |name: &str, parameters: usize| {
            let term = Term::named(name, Port::Whole).unwrap();
            Law::new(Coordinates::Point, vec![term], vec![1.0; parameters], 0.1).unwrap()
        };
        let [falls, is_pulled] = [law("uniform-field", 3), law("central-inverse-square", 4)];
        let known = Known { verdict: Verdict::Explained, ..Known::default() };
        let may = |a, b| may_be_a_pair([Some((a, &known)), Some((b, &known))]);
        assert!(may(&is_pulled, &is_pulled));
        assert!(!may(&is_pulled, &falls) && !may(&falls, &falls));
        assert!(may_be_a_pair([Some((&falls, &known)), None]));
    }
}
