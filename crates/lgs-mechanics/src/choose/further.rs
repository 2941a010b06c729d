//! Laws of more terms: sought where no simple law explains a motion, or where a further term betters the one
//! that does.

use super::{Choice, Effort, Judged, among, choose, judge, simplicity};
use crate::candidate::Candidate;
use crate::fit::{Track, regressions};
use crate::terms::Scales;
use crate::thresholds::{NEARLY_PROMISING_LEFT, PROMISING, PROMISING_LEFT};
use rayon::prelude::*;

/// The choice among some candidates, and among further ones if none of the first explains the track, or if
/// one more term betters the likeliest: what is left may be within the scatter of χ² and tell of a term all
/// the same.
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
    let explains = |choice: &&Choice| choice.judged.iter().any(|judged| choice.explains(judged));
    let longer = match choice.as_ref().filter(explains) {
        Some(choice) => {
            let longer = with_one_more(choice, (list, further), (track, scales));
            if longer.iter().all(|judged| judged.score() >= choice.law().score()) {
                return joined(Some(choice.clone()), longer, track);
            }
            longer
        }
        None => Vec::new(),
    };
    let mut kept = promising(further, track, scales);
    kept.retain(|&index| longer.iter().all(|judged| judged.index != list.len() + index));
    let picked: Vec<Candidate> = kept.iter().map(|&index| further[index].clone()).collect();
    let behind = |judged: Judged| Judged { index: list.len() + kept[judged.index], ..judged };
    let others = choose(&picked, track, scales).map_or_else(Vec::new, |choice| choice.judged);
    joined(choice, longer.into_iter().chain(others.into_iter().map(behind)).collect(), track)
}

/// A choice among more laws.
fn joined(choice: Option<Choice>, others: Vec<Judged>, track: &Track) -> Option<Choice> {
    let first = choice.map_or_else(Vec::new, |choice| choice.judged);
    among(first.into_iter().chain(others).collect(), track.independent_samples())
}

/// The further laws that have all terms of the likeliest one and one more.
fn with_one_more(
    choice: &Choice,
    (list, further): (&[Candidate], &[Candidate]),
    track: (&Track, &Scales),
) -> Vec<Judged> {
    let terms = &list[choice.law().index].terms;
    let is_longer = |other: &Candidate| {
        other.terms.len() == terms.len() + 1 && terms.iter().all(|term| other.terms.contains(term))
    };
    let longer = further.par_iter().enumerate().filter(|(_, other)| is_longer(other));
    longer.filter_map(|(i, other)| judge(list.len() + i, other, track, Effort::Rival)).collect()
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
