//! What is known of bodies that hit each other: laws drawn for each of them, with the hits that follow when
//! all move at once.

use super::{Moving, MutualContact};
use crate::bands::{DrawnLaws, PosteriorLaws, StartedLaw};
use crate::edit::Edit;

impl MutualContact {
    /// The laws drawn for each body, with the hits that follow from them under an edit of each: those of the
    /// likeliest laws by this contact, those of each draw by a `drawn` one. Hits up to `since` are those that
    /// the laws have. Nothing where a body has no draws, or ones that are given in part.
    #[must_use]
    pub fn with_hits(
        &self,
        drawn: &[Self],
        bodies: &[(&PosteriorLaws, Edit)],
        span: [f64; 2],
    ) -> Option<Vec<PosteriorLaws>> {
        let own: Vec<Draws<'_>> =
            bodies.iter().map(|(posterior, _)| Draws::of(posterior)).collect::<Option<_>>()?;
        let edits: Vec<Edit> = bodies.iter().map(|(_, edit)| *edit).collect();
        let middles: Vec<&StartedLaw> = own.iter().map(|draws| draws.middle).collect();
        let middles = self.struck(&middles, &edits, span);
        let each = drawn.iter().enumerate().map(|(index, contact)| {
            let laws: Vec<&StartedLaw> = own.iter().map(|draws| draws.at(index)).collect();
            contact.struck(&laws, &edits, span)
        });
        let each: Vec<Vec<StartedLaw>> = each.collect();
        let of_body = |(body, (middle, (posterior, _))): (usize, (StartedLaw, &(&PosteriorLaws, Edit)))| {
            let drawn = each.iter().map(|laws| laws[body].clone()).collect();
            let laws = vec![DrawnLaws { middle, order: vec![0], part: 1.0, drawn }];
            PosteriorLaws { laws, ..**posterior }
        };
        (!each.is_empty()).then(|| middles.into_iter().zip(bodies).enumerate().map(of_body).collect())
    }

    /// Laws with the hits that follow; as they are where a motion cannot be followed.
    fn struck(&self, laws: &[&StartedLaw], edits: &[Edit], span: [f64; 2]) -> Vec<StartedLaw> {
        let both = laws.iter().copied().zip(edits);
        let motions: Vec<Moving<'_>> =
            both.map(|(StartedLaw { law, start }, &edit)| Moving { law, start, edit }).collect();
        let mut struck: Vec<StartedLaw> = laws.iter().map(|&one| one.clone()).collect();
        if let Ok(impulses) = self.impulses(&motions, span) {
            struck.iter_mut().zip(impulses).for_each(|(one, impulses)| one.law.impulses = impulses);
        }
        struck
    }
}

/// The draws of one body, those of all its rivals.
struct Draws<'a> {
    middle: &'a StartedLaw,
    all: Vec<&'a StartedLaw>,
}

impl<'a> Draws<'a> {
    fn of(posterior: &'a PosteriorLaws) -> Option<Self> {
        let middle = &posterior.laws.first()?.middle;
        let is_whole = posterior.laws.iter().all(|laws| laws.part == 1.0);
        let all: Vec<&StartedLaw> = posterior.laws.iter().flat_map(|laws| &laws.drawn).collect();
        (is_whole && !all.is_empty()).then_some(Self { middle, all })
    }

    fn at(&self, index: usize) -> &'a StartedLaw {
        self.all[index % self.all.len()]
    }
}
