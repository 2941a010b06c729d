//! The terms of a law, ready to be applied under an edit.

use crate::coordinates::Site;
use crate::edit::Edit;
use crate::law::{Law, ranges, space_of};
use crate::terms::{At, Derivatives, Term, TermKind};
use std::ops::Range;

/// A term, ready to be applied.
#[derive(Debug)]
pub(crate) struct Applied {
    pub(crate) kind: &'static dyn TermKind,
    pub(crate) parameters: Range<usize>,
    /// β or γ.
    pub(crate) factor: f64,
    pub(crate) dimension: usize,
    pub(crate) sites: Vec<Site>,
}

impl Applied {
    /// Derivatives of the force by position, velocity and the term's own parameters.
    pub(crate) fn differentiate(&self, parameters: &[f64], at: At, out: &mut Derivatives) {
        let p = &parameters[self.parameters.clone()];
        out.reset(self.dimension, p.len());
        self.kind.derivatives(p, at, out);
    }
}

/// All terms of a law under an edit.
pub(crate) fn applied_terms(law: &Law, edit: &Edit) -> Vec<Applied> {
    let ranges = ranges(&law.coordinates, &law.terms);
    let apply = |(term, parameters): (&Term, Range<usize>)| Applied {
        kind: term.kind,
        parameters,
        factor: edit.factor(term.kind.role()),
        dimension: space_of(&law.coordinates, term).dimension,
        sites: law.coordinates.sites(term.port),
    };
    law.terms.iter().zip(ranges).map(apply).collect()
}
