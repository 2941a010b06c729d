//! Laws in all coordinates, and starts of theirs, for the tests.
#![allow(
    clippy::unwrap_used,
    dead_code,
    unreachable_pub,
    reason = "each test file compiles this module for itself"
)]

use lgs_core::geometry::exp;
use lgs_mechanics::Law;
use lgs_mechanics::choose::candidates;
use lgs_mechanics::collisions::Body;
use lgs_mechanics::contact::Surface;
use lgs_mechanics::coordinates::{
    AffineMode, Ball, Coordinates, Hinge, Inertia, InertiaForm, Modal, Port, State, Tree,
};
use lgs_mechanics::terms::Term;

/// A law of terms given by name, port and parameters; `own` are the coordinates' parameters.
pub fn law(coordinates: Coordinates, own: &[f64], terms: &[(&str, Port, &[f64])]) -> Law {
    let placed = terms.iter().map(|(name, port, _)| Term::named(name, *port).unwrap()).collect();
    let mut parameters = own.to_vec();
    terms.iter().for_each(|(_, _, values)| parameters.extend_from_slice(values));
    Law::new(coordinates, placed, parameters, 0.01).unwrap()
}

pub fn state(x: &[f64], v: &[f64]) -> State {
    State { x: x.to_vec(), v: v.to_vec() }
}

/// A ball of radius 0.1 that may follow any law of a point, away from planes and other bodies.
pub fn round_body() -> Body {
    Body {
        coordinates: Coordinates::Point,
        centers: candidates(&Coordinates::Point),
        spins: Vec::new(),
        surface: Surface { points: vec![[0.0; 3]], radius: 0.1 },
        grounds: Vec::new(),
        is_shell: false,
        hits: Vec::new(),
    }
}

pub fn asymmetric() -> Inertia {
    Inertia { form: InertiaForm::Free, frame: [1.0, 0.0, 0.0, 0.0], moments: [0.05, 0.08, 0.11] }
}

pub fn hinge() -> Coordinates {
    Coordinates::Hinge(Hinge { axis: [0.0, 1.0, 0.0], pivot: [0.0, 0.0, 1.0] })
}

pub fn tree() -> Coordinates {
    let down = |length: f64| [0.0, 0.0, -length];
    let tree = Tree { axis: [0.0, 1.0, 0.0], pivot: [0.0, 0.0, 1.0], link: down(0.5), arm: down(0.3) };
    Coordinates::Tree(tree)
}

pub fn top() -> Coordinates {
    let inertia = Inertia { moments: [0.1, 0.1, 0.02], ..asymmetric() };
    Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.0, 0.0, 0.3], inertia })
}

pub fn modes() -> Coordinates {
    let mode = AffineMode { linear: [[0.0; 3]; 3], shift: [0.0; 3] };
    Coordinates::Modal(Modal { affine: vec![mode; 2], further: 0 })
}

/// A quaternion away from the identity, in the order of configurations.
pub fn tilted() -> [f64; 4] {
    let q = exp(glam::DVec3::new(0.3, -0.5, 0.8));
    [q.w, q.x, q.y, q.z]
}

/// One law and start in each kind of coordinates, with conservative and other terms.
pub fn examples() -> Vec<(Law, State)> {
    let vector = vec![point(), pair(), vibrating(), falling(), hinged(), chained()];
    vector.into_iter().chain([flying(), spinning(), wobbling(), round()]).collect()
}

fn point() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 5] = [
        ("uniform-field", Port::Whole, &[0.1, -0.4, -2.0]),
        ("spring-full", Port::Whole, &[9.0, 0.5, -0.3, 7.0, 0.2, 11.0, 0.1, 0.2, -0.1]),
        ("linear-drag", Port::Whole, &[0.6]),
        ("gyroscopic", Port::Whole, &[0.5, -1.0, 2.0]),
        ("dry-friction", Port::Whole, &[0.3, 0.01]),
    ];
    (law(Coordinates::Point, &[], &terms), state(&[0.5, -0.2, 0.3], &[1.0, 0.4, -0.7]))
}

fn pair() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 4] = [
        ("uniform-field", Port::Both, &[0.0, 0.0, -9.0]),
        ("spring-length", Port::Between, &[20.0, 0.7]),
        ("central-inverse-square", Port::Between, &[0.1]),
        ("linear-drag", Port::Second, &[0.3]),
    ];
    let start = state(&[0.5, -0.2, 0.3, -0.4, 0.1, 0.2], &[1.0, 0.4, 2.7, -1.0, 0.3, 1.5]);
    (law(Coordinates::Pair, &[1.7, 0.1, -0.05, 0.02], &terms), start)
}

fn vibrating() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 3] = [
        ("spring-positive", Port::Whole, &[5.0, 1.0, 6.0, 0.1, -0.2]),
        ("damping-positive", Port::Whole, &[0.5, 0.1, 0.6]),
        ("gyroscopic", Port::Whole, &[0.7]),
    ];
    (law(modes(), &[], &terms), state(&[0.3, -0.2], &[0.5, 1.0]))
}

/// A body that vibrates in two modes while it falls.
fn falling() -> (Law, State) {
    let stretch =
        AffineMode { linear: [[0.5, 0.1, 0.0], [0.1, -0.2, 0.0], [0.0; 3]], shift: [0.0, 0.1, 0.0] };
    let shear = AffineMode { linear: [[0.0, 0.4, 0.0], [0.4, 0.0, 0.1], [0.0; 3]], shift: [0.0; 3] };
    let terms: [(&str, Port, &[f64]); 4] = [
        ("uniform-field", Port::Center, &[0.1, -0.4, -2.0]),
        ("linear-drag", Port::Center, &[0.3]),
        ("spring-positive", Port::Shape, &[5.0, 1.0, 6.0, 0.1, -0.2]),
        ("damping-positive", Port::Shape, &[0.5, 0.1, 0.6]),
    ];
    let start = state(&[0.3, -0.2, 0.1, 0.2, 0.3], &[0.5, 1.0, 1.0, 0.4, 0.7]);
    (law(Coordinates::Modal(Modal::in_flight(&[stretch, shear])), &[], &terms), start)
}

fn hinged() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 4] = [
        ("spring", Port::Whole, &[30.0, 0.2]),
        ("fourier-two", Port::Whole, &[20.0, 1.0, 2.0, -1.0]),
        ("constant-drive", Port::Whole, &[2.0]),
        ("linear-drag", Port::Whole, &[0.4]),
    ];
    (law(hinge(), &[], &terms), state(&[1.0], &[2.0]))
}

fn chained() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 3] = [
        ("fourier", Port::First, &[30.0, 0.2]),
        ("spring", Port::Between, &[12.0, 0.1]),
        ("linear-drag", Port::Second, &[0.1]),
    ];
    (law(tree(), &[0.4, 0.6, 0.2], &terms), state(&[1.0, -0.7], &[2.0, -3.0]))
}

fn flying() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 5] = [
        ("uniform-field", Port::Center, &[0.0, 0.3, -9.0]),
        ("linear-drag", Port::Center, &[0.2]),
        ("constant-drive", Port::BodyAxes, &[0.5, -0.3, 0.8]),
        ("linear-drag", Port::Spin, &[0.3]),
        ("constant-drive", Port::Turn, &[0.9, 0.2, -1.0]),
    ];
    let start = state(&[&tilted()[..], &[0.1, 0.2, 0.3]].concat(), &[3.0, -1.0, 2.0, 1.0, 0.5, 2.0]);
    (law(Coordinates::Rigid(asymmetric()), &[0.2, -0.1], &terms), start)
}

fn spinning() -> (Law, State) {
    let terms: [(&str, Port, &[f64]); 4] = [
        ("uniform-field", Port::Arm, &[0.0, 0.3, -9.0]),
        ("spring-full", Port::Arm, &[20.0, 1.0, -2.0, 9.0, 0.5, 14.0, 0.1, 0.2, -0.2]),
        ("linear-drag", Port::Arm, &[0.4]),
        ("linear-drag", Port::Turn, &[0.2]),
    ];
    (law(top(), &[0.1, -0.2], &terms), state(&tilted(), &[1.0, -2.0, 20.0]))
}

/// A body whose axes of inertia and whose centre are not those of the prior.
fn wobbling() -> (Law, State) {
    let inertia = Inertia { form: InertiaForm::Whole, ..asymmetric() };
    let ball = Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.1, -0.05, 0.3], inertia });
    let terms: [(&str, Port, &[f64]); 4] = [
        ("uniform-field", Port::Arm, &[0.0, 0.3, -9.0]),
        ("linear-drag", Port::Arm, &[0.3]),
        ("linear-drag", Port::Spin, &[0.2]),
        ("linear-drag", Port::InertialSpin, &[0.3]),
    ];
    let own = [0.1, -0.2, 0.2, -0.3, 0.1, 0.2, -0.1];
    (law(ball, &own, &terms), state(&tilted(), &[1.0, -2.0, 6.0]))
}

/// A round body whose axis is not that of the prior.
fn round() -> (Law, State) {
    let inertia = Inertia { form: InertiaForm::Round, ..asymmetric() };
    let ball = Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.0, 0.0, 0.3], inertia });
    let terms: [(&str, Port, &[f64]); 1] = [("uniform-field", Port::Arm, &[0.0, 0.3, -9.0])];
    (law(ball, &[0.1, -0.2, 0.3], &terms), state(&tilted(), &[1.0, -2.0, 6.0]))
}
