//! Accelerations by forces, and the motion without any.

use super::solve::add_scaled;
use super::stepper::Tangent;
use crate::coordinates::State;
use crate::terms::Block;

/// Acceleration and derivatives at one state.
#[derive(Debug, Default)]
pub(crate) struct Linearised {
    pub(crate) a: Vec<f64>,
    pub(crate) x: Block,
    pub(crate) v: Block,
    pub(crate) p: Block,
}

impl Linearised {
    /// Zeros for a number of freedoms and of parameters.
    pub(crate) fn reset(&mut self, freedoms: usize, parameters: usize) {
        self.a.resize(freedoms, 0.0);
        self.x.reset(freedoms, freedoms);
        self.v.reset(freedoms, freedoms);
        self.p.reset(freedoms, parameters);
    }

    /// `to += s (A_x X + A_p)`, matrices `[freedoms, columns]`: the change of the acceleration with positions
    /// and parameters.
    pub(super) fn add_by_position(&self, tangent: &Tangent, s: f64, to: &mut [f64]) {
        add_product(&self.x, &tangent.x, tangent.columns, s, to);
        let from = tangent.columns - self.p.columns();
        for (i, row) in to.chunks_exact_mut(tangent.columns).enumerate() {
            add_scaled(&mut row[from..], self.p.row(i), s);
        }
    }

    /// `to += s A_v V`, matrices `[freedoms, columns]`: the change of the acceleration with velocities.
    pub(super) fn add_by_velocity(&self, tangent: &Tangent, s: f64, to: &mut [f64]) {
        add_product(&self.v, &tangent.v, tangent.columns, s, to);
    }
}

/// `to += s A B` for a square `A` and rows `[n, columns]`.
fn add_product(a: &Block, b: &[f64], columns: usize, s: f64, to: &mut [f64]) {
    for (i, row) in to.chunks_exact_mut(columns).enumerate() {
        for (j, b) in b.chunks_exact(columns).enumerate() {
            add_scaled(row, b, s * a[(i, j)]);
        }
    }
}

/// Forces as accelerations, and the motion without any force.
pub(crate) trait KickField {
    /// Degrees of freedom.
    fn freedoms(&self) -> usize;

    /// Whether any force depends on the velocity.
    fn depends_on_velocity(&self) -> bool;

    /// Writes the acceleration by forces, `[freedoms]`.
    fn acceleration(&mut self, x: &[f64], v: &[f64], a: &mut [f64]);

    /// Writes the acceleration by forces and its derivatives.
    fn linearise(&mut self, x: &[f64], v: &[f64], out: &mut Linearised);

    /// Writes the derivative of the acceleration by the velocity; what else there is may be left as it is.
    fn linearise_by_velocity(&mut self, x: &[f64], v: &[f64], out: &mut Linearised);

    /// The exact or a symmetric motion without forces.
    fn drift(&self, state: &mut State, h: f64);

    /// Carries the tangent along, from the state before the drift.
    fn drift_tangent(&self, state: &State, tangent: &mut Tangent, h: f64);
}
