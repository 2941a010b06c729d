//! States with their derivatives.

use crate::coordinates::State;
use nalgebra::DMatrix;

/// A state and its derivatives by all unknowns, columns: changes of the start's configuration `[n]`, of its
/// velocity `[n]`, and of the law's parameters `[m]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The state.
    pub state: State,
    /// Change of the configuration (as by `Coordinates::retract`), `[n, 2 n + m]`.
    pub position: DMatrix<f64>,
    /// Change of the velocity, `[n, 2 n + m]`.
    pub velocity: DMatrix<f64>,
}
