//! Candidates for each kind of coordinates, symmetric special cases among them.

use crate::Candidate;
use crate::coordinates::{Coordinates, Port};
use crate::terms::{Role, Term};

/// Laws of a point, or of the centre of a body.
const OF_A_POINT: &[&[&str]] = &[
    &[],
    &["uniform-field"],
    &["linear-drag"],
    &["quadratic-drag"],
    &["uniform-field", "linear-drag"],
    &["uniform-field", "quadratic-drag"],
    &["spring"],
    &["spring", "linear-drag"],
    &["spring-positive"],
    &["spring-full"],
    &["central-inverse-square"],
    &["central-logarithm"],
    &["central-power"],
    &["quartic-radial"],
    &["quartic-axis"],
    &["gyroscopic"],
    &["uniform-field", "gyroscopic"],
];

/// Laws of an angle, of an offset along a rail, and of each joint of a tree.
const OF_AN_AXIS: &[&[&str]] = &[
    &[],
    &["uniform-field"],
    &["uniform-field", "linear-drag"],
    &["linear-drag"],
    &["quadratic-drag"],
    &["dry-friction"],
    &["constant-drive"],
    &["constant-drive", "linear-drag"],
    &["spring"],
    &["spring", "linear-drag"],
    &["fourier"],
    &["fourier", "linear-drag"],
    &["fourier-two"],
    &["quartic-radial"],
];

/// Laws of the amplitudes of a deforming body.
const OF_MODES: &[&[&str]] = &[
    &[],
    &["spring-positive"],
    &["spring-full"],
    &["spring-positive", "linear-drag"],
    &["spring-positive", "damping-positive"],
    &["spring-positive", "gyroscopic"],
];

/// Laws between two points.
const BETWEEN: &[&[&str]] =
    &[&[], &["spring"], &["spring-length"], &["central-inverse-square"], &["spring-length", "linear-drag"]];

/// All combinations that the coordinates can have; names that do not suit a port drop out.
#[must_use]
pub fn candidates(coordinates: &Coordinates) -> Vec<Candidate> {
    let terms = |port: Port, list: &[&[&str]]| -> Vec<Vec<Term>> {
        let named = |names: &&[&str]| names.iter().map(|name| Term::named(name, port).ok()).collect();
        list.iter().filter_map(named).collect()
    };
    let sets = match coordinates {
        Coordinates::Point => terms(Port::Whole, OF_A_POINT),
        Coordinates::Rigid(_) => {
            product(&terms(Port::Center, OF_A_POINT), &terms(Port::Spin, &[&[], &["linear-drag"]]))
        }
        Coordinates::Ball(_) => product(
            &terms(Port::Arm, &[&[], &["uniform-field"], &["spring"]]),
            &terms(Port::Spin, &[&[], &["linear-drag"]]),
        ),
        Coordinates::Modal(_) => terms(Port::Whole, OF_MODES),
        Coordinates::Tree(_) => {
            let joint: &[&[&str]] = &[&[], &["fourier"], &["spring"]];
            product(&terms(Port::First, joint), &terms(Port::Second, joint))
        }
        Coordinates::Pair => {
            product(&terms(Port::Both, &[&[], &["uniform-field"]]), &terms(Port::Between, BETWEEN))
        }
        _ => terms(Port::Whole, OF_AN_AXIS),
    };
    sets.into_iter().filter_map(|terms| Candidate::new(coordinates.clone(), terms).ok()).collect()
}

/// Every set of the first list with every set of the second.
fn product(first: &[Vec<Term>], second: &[Vec<Term>]) -> Vec<Vec<Term>> {
    first.iter().flat_map(|a| second.iter().map(|b| [a.as_slice(), b].concat())).collect()
}

/// Unknowns by which a force without an energy counts as less simple than one with an energy: a circling point
/// can be held by a spring (four unknowns) or by a gyroscopic force (three), and the spring comes first.
const WITHOUT_ENERGY: usize = 2;

/// Number of unknowns, and the surcharge of terms without an energy.
#[must_use]
pub fn simplicity(candidate: &Candidate) -> usize {
    let without = candidate.terms.iter().filter(|term| term.kind.role() != Role::Conserves).count();
    candidate.parameter_count() + WITHOUT_ENERGY * without
}
