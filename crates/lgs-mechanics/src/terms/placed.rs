//! A term of a law: a kind, and the port that it acts on.

use super::kind::TermKind;
use crate::coordinates::Port;
use crate::error::MechanicsError;

/// A kind of term and the port of the coordinates that it acts on.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// The kind.
    pub kind: &'static dyn TermKind,
    /// What it acts on.
    pub port: Port,
}

impl Term {
    /// The kind with a name at a port; an error that lists all names if there is no such kind.
    pub fn named(name: &str, port: Port) -> Result<Self, MechanicsError> {
        let unknown = || MechanicsError::UnknownTerm {
            name: name.to_owned(),
            known: super::kinds().iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", "),
        };
        super::kind(name).map(|kind| Self { kind, port }).ok_or_else(unknown)
    }
}

impl PartialEq for Term {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name() == other.kind.name() && self.port == other.port
    }
}
