//! Errors of laws and of their integration.

use thiserror::Error;

/// A law that cannot be built, or a motion that cannot be followed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MechanicsError {
    /// No kind of term has this name.
    #[error("unknown term `{name}`; known are {known}")]
    UnknownTerm {
        /// The name found.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// The coordinates do not offer what a term is to act on.
    #[error("term `{term}` cannot act on `{port}` of {coordinates} coordinates")]
    NoSuchPort {
        /// Name of the term.
        term: String,
        /// Name of the port.
        port: &'static str,
        /// Name of the coordinates.
        coordinates: &'static str,
    },
    /// A list has the wrong number of entries.
    #[error("{what}: {expected} values expected, {found} found")]
    Size {
        /// The list.
        what: String,
        /// Entries that the coordinates or the term ask for.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A value is not finite or lies outside of what its meaning allows.
    #[error("{what} is {value}, allowed is {allowed}")]
    OutOfBounds {
        /// The value's name.
        what: String,
        /// The value.
        value: f64,
        /// Description of the allowed range.
        allowed: String,
    },
    /// The equations of a step have no solution near the state before it, or the state left the numbers.
    #[error("the motion is not determined beyond time {time}")]
    Undetermined {
        /// The last time up to which it is determined.
        time: f64,
    },
    /// A list of impacts or impulses is not in the order of time.
    #[error("{kind} {index} of a law is at time {time}, not after the one before at {before}")]
    OutOfOrder {
        /// `impact` or `impulse`.
        kind: &'static str,
        /// Place in the list, from 0.
        index: usize,
        /// Its time.
        time: f64,
        /// Time of the one before it.
        before: f64,
    },
    /// No candidate could be followed from the track's own start.
    #[error("none of {candidates} candidate laws could be fitted to the track")]
    NoFit {
        /// Number of candidates.
        candidates: usize,
    },
}
