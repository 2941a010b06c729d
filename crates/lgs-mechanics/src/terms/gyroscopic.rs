//! Gyroscopic force: `Q = G w` with an antisymmetric matrix `G`; in three dimensions `Q = b × w`, the force
//! of a uniform magnetic field (up to the charge's sign). Its power is zero.

use super::kind::{At, Derivatives, Label, Role, TermKind};
use crate::parameter::{Parameter, Space, axis_name};

/// The kind `gyroscopic`.
pub(super) const GYROSCOPIC: Gyroscopic = Gyroscopic;

/// A gyroscopic force.
#[derive(Debug)]
pub(super) struct Gyroscopic;

/// The entries of `G` that the parameters are: `G[row, column] = p` and its mirror image `−p`.
fn entries(d: usize) -> impl Iterator<Item = (usize, usize)> {
    let (of_rotation, rows) = if d == 3 { (3, 0) } else { (0, d) };
    let below = (0..rows).flat_map(move |i| (i + 1..rows).map(move |j| (j, i)));
    [(2, 1), (0, 2), (1, 0)].into_iter().take(of_rotation).chain(below)
}

impl TermKind for Gyroscopic {
    fn label(&self) -> Label {
        Label { name: "gyroscopic", role: Role::Gyroscopic }
    }

    fn suits(&self, space: Space) -> bool {
        space.dimension >= 2
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let name = |index: usize, (row, column): (usize, usize)| match space.dimension {
            3 => format!("rate-{}", axis_name(3, index)),
            d => format!("rate-{}{}", axis_name(d, row), axis_name(d, column)),
        };
        let entries = entries(space.dimension).enumerate();
        entries.map(|(index, entry)| Parameter::linear(name(index, entry), 0, -1)).collect()
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        if let ([x, y, z], [u, v, w]) = (p, at.w) {
            force.copy_from_slice(&[y * w - z * v, z * u - x * w, x * v - y * u]);
            return;
        }
        force.fill(0.0);
        for ((row, column), rate) in entries(at.w.len()).zip(p) {
            force[row] += rate * at.w[column];
            force[column] -= rate * at.w[row];
        }
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        for (index, (row, column)) in entries(at.w.len()).enumerate() {
            out.w[(row, column)] = p[index];
            out.w[(column, row)] = -p[index];
            out.p[(row, index)] = at.w[column];
            out.p[(column, index)] = -at.w[row];
        }
    }
}
