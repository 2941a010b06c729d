//! Systems and particles that the sections share.

use lgs_dynamics::{State, StateCotangents, System, SystemConfig};
use rand::RngExt;

/// Points `[n, 3]` in a cube of half an edge `half`, in no order.
pub(crate) fn points(n: usize, half: f32, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = lgs_core::stream(seed, "points", 0);
    (0..n).map(|_| std::array::from_fn(|_| half * (2.0 * rng.random::<f32>() - 1.0))).collect()
}

/// The paper's networks (four layers of 128) with a last layer that is not zero.
pub(crate) fn system() -> System {
    let mut system = System::init(SystemConfig::paper(), 1);
    let last =
        system.layout().into_iter().find(|entry| entry.name == "force.3.weight").expect("a force network");
    for (i, value) in system.params[last.range].iter_mut().enumerate() {
        *value = ((i * 37 % 101) as f32 / 101.0 - 0.5) * 0.1;
    }
    system
}

/// Moving particles in a box of half side one.
pub(crate) fn start(n: usize) -> State {
    State::at_start(points(n, 1.0, 1), points(n, 1.0, 2))
}

/// Cotangents of all positions of a rollout.
pub(crate) fn cotangents(n: usize, states: usize) -> Vec<StateCotangents> {
    vec![StateCotangents { q: points(n, 1.0, 3), ..StateCotangents::default() }; states]
}

/// Multiplications and additions of one acceleration of one particle: two passes through U and one through Q
/// (method §4.1), their matrix products only.
pub(crate) fn operations(config: &SystemConfig) -> f64 {
    let h = config.hidden;
    let between = (config.hidden_layers - 1) * h * h;
    let (potential, force) = (3 * h + between + h, 6 * h + between + 3 * h);
    2.0 * (2 * potential + force) as f64
}
