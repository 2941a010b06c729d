//! Laws of more terms: sought where no simple law explains a motion, and as rivals of those that do.

use super::{Choice, Effort, Judged, among, choose, judge, simplicity};
use crate::candidate::Candidate;
use crate::fit::{Track, regressions};
use crate::terms::Scales;
use crate::thresholds::{NEARLY_PROMISING_LEFT, PROMISING, PROMISING_LEFT};
use rayon::prelude::*;

/// The choice among some candidates and the further ones that are promising; where one of the first explains
/// the track, these are tried as its rivals, and with them those that have all terms of such a law and one
/// more.
/// What a law leaves may be within the scatter of χ² and tell of a term all the same.
#[must_use]
pub fn choose_further(
    choice: Option<Choice>,
    (list, further): (&[Candidate], &[Candidate]),
    track: &Track,
    scales: &Scales,
) -> Option<Choice> {
    let is_further = |judged: &Judged| judged.index >= list.len();
    if further.is_empty() || choice.as_ref().is_some_and(|choice| choice.judged.iter().any(is_further)) {
        return choice;
    }
    let promising = promising(further, track, scales);
    let explains = |choice: &&Choice| choice.judged.iter().any(|judged| choice.explains(judged));
    let others: Vec<Judged> = match choice.as_ref().filter(explains) {
        Some(choice) => {
            let fitted = |i: &usize| judge(list.len() + i, &further[*i], (track, scales), Effort::Rival);
            rivals(choice, (list, further), &promising).par_iter().filter_map(fitted).collect()
        }
        None => {
            let picked: Vec<Candidate> = promising.iter().map(|&i| further[i].clone()).collect();
            let own = |judged: Judged| Judged { index: list.len() + promising[judged.index], ..judged };
            let found = choose(&picked, track, scales).map_or_else(Vec::new, |choice| choice.judged);
            found.into_iter().map(own).collect()
        }
    };
    let first = choice.map_or_else(Vec::new, |choice| choice.judged);
    among(first.into_iter().chain(others).collect(), track.independent_samples())
}

/// The choice together with the further laws that are as simple as the simplest one which explains the track,
/// or simpler; as it is where none explains the track.
#[must_use]
pub fn choose_as_simple(
    choice: Choice,
    (list, further): (&[Candidate], &[Candidate]),
    track: &Track,
    scales: &Scales,
) -> Choice {
    let explaining = choice.judged.iter().filter(|judged| choice.explains(judged));
    let Some(most) = explaining.map(|judged| judged.simplicity).min() else { return choice };
    let is_known = |index: usize| choice.judged.iter().any(|judged| judged.index == index);
    let is_due = |i: &usize| simplicity(&further[*i]) <= most && !is_known(list.len() + i);
    let fitted = |i: usize| judge(list.len() + i, &further[i], (track, scales), Effort::Full);
    let found: Vec<Judged> = (0..further.len()).into_par_iter().filter(is_due).filter_map(fitted).collect();
    let samples = choice.samples;
    among(choice.judged.into_iter().chain(found).collect(), samples).expect("a choice holds a law")
}

/// Places of the further laws that may be likelier than those that explain the track: those with all terms of
/// one of these and one more, and the promising ones; along an axis, where fits take little time, also all
/// that have at most one unknown more than the one with the fewest.
fn rivals(choice: &Choice, (list, further): (&[Candidate], &[Candidate]), promising: &[usize]) -> Vec<usize> {
    let explaining = choice.judged.iter().filter(|judged| choice.explains(judged));
    let explaining: Vec<&Candidate> = explaining.map(|judged| &list[judged.index]).collect();
    let is_longer = |other: &Candidate| {
        explaining.iter().any(|Candidate { terms, .. }| {
            other.terms.len() == terms.len() + 1 && terms.iter().all(|term| other.terms.contains(term))
        })
    };
    let fewest = explaining.iter().map(|candidate| candidate.unknown_count()).min().unwrap_or(0);
    let is_near =
        |other: &Candidate| other.coordinates.freedoms() == 1 && other.unknown_count() <= fewest + 1;
    let is_rival = |i: &usize| promising.contains(i) || is_longer(&further[*i]) || is_near(&further[*i]);
    (0..further.len()).filter(is_rival).collect()
}

/// The candidates whose equations of motion the track obeys about as well as those of any, and those that it
/// obeys better than those of all simpler ones and not much worse than those of any; the simplest of all
/// these.
fn promising(list: &[Candidate], track: &Track, scales: &Scales) -> Vec<usize> {
    let left = |candidate: &Candidate| regressions(candidate, track, scales).first().map(|first| first.left);
    let left: Vec<f64> = list.par_iter().map(|candidate| left(candidate).unwrap_or(f64::INFINITY)).collect();
    let least = left.iter().copied().fold(f64::INFINITY, f64::min);
    let mut order: Vec<usize> = (0..list.len()).collect();
    order.sort_by_key(|&index| simplicity(&list[index]));
    let mut least_of_simpler = f64::INFINITY;
    order.retain(|&index| {
        let is_first = left[index] < least_of_simpler;
        least_of_simpler = least_of_simpler.min(left[index]);
        left[index] <= least * if is_first { NEARLY_PROMISING_LEFT } else { PROMISING_LEFT }
    });
    order.truncate(PROMISING);
    order
}

#[cfg(test)]
mod tests {
    use super::super::{candidates, further_candidates};
    use super::*;
    use crate::coordinates::{Coordinates, Hinge, Port, State};
    use crate::edit::Edit;
    use crate::system::System;
    use crate::terms::Term;
    use crate::testing::normal;

    #[test]
    fn along_an_axis_laws_of_one_unknown_more_are_rivals_whatever_their_terms() {
        let hinge = Coordinates::Hinge(Hinge { axis: [1.0, 0.0, 0.0], pivot: [0.0; 3] });
        let terms =
            ["fourier", "quadratic-drag"].map(|name| Term::named(name, Port::Whole).unwrap()).to_vec();
        let law = Candidate::new(hinge.clone(), terms).unwrap().law(vec![2.0, 14.0, 0.6], 0.01).unwrap();
        let times: Vec<f64> = (0..46).map(|k| f64::from(k) / 60.0).collect();
        let start = State { x: vec![0.9], v: vec![-4.0] };
        let mut stream = lgs_core::stream(5, "rivals", 0);
        let states = System::new(&law, Edit::NONE).states(&start, &times).unwrap();
        let x: Vec<Vec<f64>> = states.iter().map(|s| vec![s.x[0] + 0.0005 * normal(&mut stream)]).collect();
        let track = Track::new(&hinge, &times, &x);
        let (list, further) = (candidates(&hinge), further_candidates(&hinge));
        let choice = choose(&list, &track, &track.scales(&hinge)).unwrap();
        let names = |candidate: &Candidate| -> Vec<&str> {
            candidate.terms.iter().map(|term| term.kind.name()).collect()
        };
        let found = rivals(&choice, (&list, &further), &[]);
        let is_rival = |wanted: &[&str]| found.iter().any(|&i| names(&further[i]) == wanted);
        assert!(is_rival(&["fourier", "constant-drive", "linear-drag"]));
        assert!(!is_rival(&["fourier-two", "constant-drive", "linear-drag"]), "two unknowns more");
    }
}
