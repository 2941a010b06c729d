//! Candidates for each kind of coordinates, symmetric special cases among them.

use crate::candidate::Candidate;
use crate::coordinates::{Ball, Coordinates, Inertia, InertiaForm, Port};
use crate::terms::{Role, Term};
use crate::thresholds::{DISSIPATES, DRIVES, GYROSCOPIC};

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
    &["dry-friction"],
    &["gyroscopic"],
    &["uniform-field", "gyroscopic"],
];

/// Energies of a point that further forces come with …
const ENERGIES_OF_A_POINT: &[&[&str]] = &[
    &[],
    &["uniform-field"],
    &["spring"],
    &["spring-positive"],
    &["uniform-field", "spring-length"],
    &["central-inverse-square"],
    &["quartic-radial"],
    &["quartic-axis"],
];

/// … and these forces.
const FORCES_ON_A_POINT: &[&[&str]] = &[
    &[],
    &["linear-drag"],
    &["quadratic-drag"],
    &["dry-friction"],
    &["gyroscopic"],
    &["gyroscopic", "linear-drag"],
];

/// Forces of what surrounds a point and moves, or has energy to give.
const FORCES_OF_SURROUNDINGS: &[&[&str]] = &[&["wind-drag"], &["linear-drag", "swirl"], &["self-excitation"]];

/// Laws of an angle and of an offset along a rail.
const OF_AN_AXIS: &[&[&str]] = &[
    &[],
    &["uniform-field"],
    &["uniform-field", "linear-drag"],
    &["uniform-field", "quadratic-drag"],
    &["linear-drag"],
    &["quadratic-drag"],
    &["dry-friction"],
    &["constant-drive"],
    &["constant-drive", "linear-drag"],
    &["constant-drive", "quadratic-drag"],
    &["spring"],
    &["spring", "linear-drag"],
    &["spring", "dry-friction"],
    &["fourier"],
    &["fourier", "linear-drag"],
    &["fourier", "quadratic-drag"],
    &["fourier", "constant-drive"],
    &["fourier-two"],
    &["quartic-radial"],
];

/// Energies of an angle and of an offset along a rail that further forces come with …
pub(super) const ENERGIES_OF_AN_AXIS: &[&[&str]] = &[
    &[],
    &["uniform-field"],
    &["spring"],
    &["fourier"],
    &["fourier-two"],
    &["spring", "fourier"],
    &["quartic-radial"],
];

/// … and these forces.
const FORCES_ON_AN_AXIS: &[&[&str]] = &[
    &[],
    &["linear-drag"],
    &["quadratic-drag"],
    &["dry-friction"],
    &["linear-drag", "dry-friction"],
    &["constant-drive"],
    &["constant-drive", "linear-drag"],
    &["constant-drive", "quadratic-drag"],
    &["constant-drive", "dry-friction"],
];

/// Laws of each joint of a tree.
const OF_A_JOINT: &[&[&str]] = &[&[], &["fourier"], &["spring"]];

/// Laws of the amplitudes of a deforming body.
const OF_MODES: &[&[&str]] = &[
    &[],
    &["uniform-field"],
    &["spring"],
    &["spring", "linear-drag"],
    &["spring-positive"],
    &["spring-full"],
    &["spring-positive", "linear-drag"],
    &["spring-positive", "damping-positive"],
    &["spring-positive", "gyroscopic"],
];

/// Laws between two points.
const BETWEEN: &[&[&str]] = &[
    &[],
    &["spring"],
    &["spring", "linear-drag"],
    &["spring-length"],
    &["spring-length", "linear-drag"],
    &["central-inverse-square"],
    &["central-logarithm"],
];

/// Laws of both of two points.
const OF_BOTH: &[&[&str]] = &[&[], &["uniform-field"], &["uniform-field", "linear-drag"]];

/// Laws of the vector from a pivot to the centre.
const OF_AN_ARM: &[&[&str]] = &[&[], &["uniform-field"]];

/// Laws of a body's rotation, with the inertia that they take: a uniform spin, one that is damped or driven,
/// and tumbling.
const OF_A_ROTATION: &[(InertiaForm, &[(&str, Port)])] = &[
    (InertiaForm::Isotropic, &[]),
    (InertiaForm::Isotropic, &[("linear-drag", Port::Spin)]),
    (InertiaForm::Isotropic, &[("constant-drive", Port::Turn)]),
    (InertiaForm::Isotropic, &[("constant-drive", Port::Turn), ("linear-drag", Port::Spin)]),
    (InertiaForm::Prior, &[]),
    (InertiaForm::Prior, &[("linear-drag", Port::Spin)]),
    (InertiaForm::Prior, &[("linear-drag", Port::InertialSpin)]),
    (InertiaForm::Round, &[]),
    (InertiaForm::Round, &[("linear-drag", Port::Spin)]),
    (InertiaForm::Round, &[("linear-drag", Port::InertialSpin)]),
    (InertiaForm::Free, &[]),
    (InertiaForm::Free, &[("linear-drag", Port::Spin)]),
    (InertiaForm::Free, &[("linear-drag", Port::InertialSpin)]),
    (InertiaForm::Whole, &[]),
    (InertiaForm::Whole, &[("linear-drag", Port::Spin)]),
    (InertiaForm::Whole, &[("linear-drag", Port::InertialSpin)]),
];

/// All combinations that the coordinates can have; names that do not suit a port drop out.
///
/// A body's moments of inertia are those of a ball, those given, or free, whichever form is given; round and
/// whole ones are offered to a body of that form.
#[must_use]
pub fn candidates(coordinates: &Coordinates) -> Vec<Candidate> {
    let sets = match coordinates {
        Coordinates::Rigid(inertia) => {
            return of_a_body(coordinates, inertia, &sets(Port::Center, OF_A_POINT));
        }
        Coordinates::Ball(ball) => return of_a_body(coordinates, &ball.inertia, &sets(Port::Arm, OF_AN_ARM)),
        Coordinates::Point => sets(Port::Whole, OF_A_POINT),
        Coordinates::Modal(_) => sets(Port::Whole, OF_MODES),
        Coordinates::Tree(_) => {
            let both = product(&sets(Port::First, OF_A_JOINT), &sets(Port::Second, OF_A_JOINT));
            let damped =
                product(&sets(Port::First, &[&["linear-drag"]]), &sets(Port::Between, &[&["linear-drag"]]));
            [product(&both, &[Vec::new()]), product(&both, &damped)].concat()
        }
        Coordinates::Pair => product(&sets(Port::Both, OF_BOTH), &sets(Port::Between, BETWEEN)),
        _ => sets(Port::Whole, OF_AN_AXIS),
    };
    sets.into_iter().filter_map(|terms| Candidate::new(coordinates.clone(), terms).ok()).collect()
}

/// Laws of a point or along an axis that combine more terms than [`candidates`] and are none of these: sought
/// where none of these explains a motion.
#[must_use]
pub fn further_candidates(coordinates: &Coordinates) -> Vec<Candidate> {
    let (energies, forces) = match coordinates {
        Coordinates::Point => (ENERGIES_OF_A_POINT, FORCES_ON_A_POINT),
        Coordinates::Hinge(_) | Coordinates::Rolling(_) => (ENERGIES_OF_AN_AXIS, FORCES_ON_AN_AXIS),
        _ => return Vec::new(),
    };
    let first = candidates(coordinates);
    let all = product(&sets(Port::Whole, energies), &sets(Port::Whole, forces));
    let candidate = |terms| Candidate::new(coordinates.clone(), terms).ok();
    all.into_iter().filter_map(candidate).filter(|candidate| !first.contains(candidate)).collect()
}

/// Laws of a point among surroundings that move, or have energy to give: sought where none of
/// [`further_candidates`] explains a motion either.
#[must_use]
pub fn surrounded_candidates(coordinates: &Coordinates) -> Vec<Candidate> {
    if *coordinates != Coordinates::Point {
        return Vec::new();
    }
    let all = product(&sets(Port::Whole, ENERGIES_OF_A_POINT), &sets(Port::Whole, FORCES_OF_SURROUNDINGS));
    all.into_iter().filter_map(|terms| Candidate::new(coordinates.clone(), terms).ok()).collect()
}

/// Sets of terms at a port.
fn sets(port: Port, list: &[&[&str]]) -> Vec<Vec<Term>> {
    let named = |names: &&[&str]| names.iter().map(|name| Term::named(name, port).ok()).collect();
    list.iter().filter_map(named).collect()
}

/// Laws of a rigid body or ball joint: those of its rotation with each of the sets of other terms.
fn of_a_body(coordinates: &Coordinates, inertia: &Inertia, others: &[Vec<Term>]) -> Vec<Candidate> {
    let round = inertia.moments.iter().all(|moment| *moment == inertia.moments[0]);
    let mut found = Vec::new();
    for (form, turning) in OF_A_ROTATION {
        if matches!(form, InertiaForm::Round | InertiaForm::Whole) && *form != inertia.form {
            continue;
        }
        // The moments given are those of a ball as well.
        if round && *form == InertiaForm::Prior {
            continue;
        }
        let inertia = Inertia { form: *form, ..*inertia };
        let own = match coordinates {
            Coordinates::Ball(ball) => Coordinates::Ball(Ball { inertia, ..*ball }),
            _ => Coordinates::Rigid(inertia),
        };
        let named = |&(name, port): &(&str, Port)| Term::named(name, port).ok();
        let turning: Vec<Term> = turning.iter().filter_map(named).collect();
        let all = product(others, &[turning]);
        found.extend(all.into_iter().filter_map(|terms| Candidate::new(own.clone(), terms).ok()));
    }
    found
}

/// Every set of the first list with every set of the second.
fn product(first: &[Vec<Term>], second: &[Vec<Term>]) -> Vec<Vec<Term>> {
    first.iter().flat_map(|a| second.iter().map(|b| [a.as_slice(), b].concat())).collect()
}

/// Number of unknowns, in halves, and the surcharges of terms without an energy.
#[must_use]
pub fn simplicity(candidate: &Candidate) -> usize {
    let surcharge = |term: &Term| match term.kind.role() {
        Role::Conserves => 0,
        Role::Gyroscopic => GYROSCOPIC,
        Role::Dissipates => DISSIPATES,
        Role::Drives => DRIVES,
    };
    2 * candidate.unknown_count() + candidate.terms.iter().map(surcharge).sum::<usize>()
}
