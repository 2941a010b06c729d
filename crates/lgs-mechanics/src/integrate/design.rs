//! The equation of motion as a linear regression.

use super::ports::{BodyPort, Moved};
use crate::coordinates::{Coordinates, Inertia, State, Tree};
use crate::law::{ranges, space_of};
use crate::terms::{At, Block, Term};
use glam::DVec3;
use nalgebra::DMatrix;

/// Columns of all terms at a state, `[n, columns]`.
pub(crate) fn design(
    (coordinates, terms): (&Coordinates, &[Term]),
    p: &[f64],
    state: &State,
) -> DMatrix<f64> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for (term, range) in terms.iter().zip(ranges(coordinates, terms)) {
        let own = &p[range];
        if coordinates.has_rotation() {
            columns.extend(body_columns(coordinates, term, (p, own), state));
        } else {
            columns.extend(vector_columns(coordinates, term, (p, own), state));
        }
    }
    let n = coordinates.freedoms();
    DMatrix::from_fn(n, columns.len(), |row, column| columns[column][row])
}

/// Columns of a term at a position and velocity of its space.
fn block(coordinates: &Coordinates, term: &Term, p: &[f64], at: At<'_>) -> Block {
    let space = space_of(coordinates, term);
    let mut block = Block::zeros(space.dimension, term.kind.columns(space));
    term.kind.design(p, at, space, &mut block);
    block
}

fn body_columns(
    coordinates: &Coordinates,
    term: &Term,
    (all, p): (&[f64], &[f64]),
    state: &State,
) -> Vec<Vec<f64>> {
    let arm = match coordinates {
        Coordinates::Ball(ball) => ball.arm(all),
        _ => DVec3::ZERO,
    };
    let inertia = coordinates.inertia().copied().unwrap_or(Inertia::ball(1.0));
    let middle = inertia.moments[1];
    let moved = Moved::new(&state.x, &state.v);
    let port = BodyPort { port: term.port, arm, scale: middle, tensor: inertia.tensor(all) };
    let (y, w) = port.read(&moved);
    let block = block(coordinates, term, p, At { y: &y.to_array(), w: &w.to_array() });
    let column = |index: usize| {
        let force = DVec3::new(block[(0, index)], block[(1, index)], block[(2, index)]);
        let (torque, pull) = port.act(&moved, force);
        [(torque / middle).to_array(), pull.to_array()].concat()
    };
    (0..block.columns()).map(column).collect()
}

fn vector_columns(
    coordinates: &Coordinates,
    term: &Term,
    (all, p): (&[f64], &[f64]),
    state: &State,
) -> Vec<Vec<f64>> {
    let space = space_of(coordinates, term);
    let mut columns = vec![vec![0.0; coordinates.freedoms()]; term.kind.columns(space)];
    for site in coordinates.sites(term.port) {
        let read = |from: &[f64]| -> Vec<f64> {
            let part = |start: usize| &from[start..start + space.dimension];
            match site.minus {
                Some(minus) => part(site.plus).iter().zip(part(minus)).map(|(a, b)| a - b).collect(),
                None => part(site.plus).to_vec(),
            }
        };
        let mut y = read(&state.x);
        y.iter_mut().enumerate().for_each(|(axis, y)| *y -= site.offset_in(all, axis));
        let block = block(coordinates, term, p, At { y: &y, w: &read(&state.v) });
        let reaction = site.mass.map_or(1.0, |mass| 1.0 / all[mass]);
        for (index, column) in columns.iter_mut().enumerate() {
            for axis in 0..space.dimension {
                column[site.plus + axis] += block[(axis, index)];
                if let Some(minus) = site.minus {
                    column[minus + axis] -= reaction * block[(axis, index)];
                }
            }
        }
    }
    columns
}

/// The left side of the equation of motion.
pub(crate) fn inertial_force(coordinates: &Coordinates, p: &[f64], state: &State, a: &[f64]) -> Vec<f64> {
    if let Coordinates::Tree(_) = coordinates {
        let [ratio, mixed, slope] = Tree::mass(p, &state.x);
        let v = &state.v;
        return vec![
            a[0] + mixed * a[1] - slope * v[1] * v[1],
            mixed * a[0] + ratio * a[1] + slope * v[0] * v[0],
        ];
    }
    let mut force = a.to_vec();
    if let Some(inertia) = coordinates.inertia() {
        let tensor = inertia.tensor(p);
        let spin = DVec3::from_slice(&state.v);
        let torque = tensor * DVec3::from_slice(a) + spin.cross(tensor * spin);
        force[..3].copy_from_slice(&(torque / inertia.moments[1]).to_array());
    }
    force
}
