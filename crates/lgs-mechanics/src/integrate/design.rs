//! The equation of motion as a linear regression.

use super::ports::{BodyPort, Moved};
use crate::coordinates::{Coordinates, Inertia, Site, State, Tree};
use crate::law::{ranges, space_of};
use crate::terms::{At, Block, Term, linear_entries};
use glam::DVec3;
use nalgebra::{DMatrix, DMatrixViewMut};
use std::ops::Range;

/// The columns that the terms of a candidate offer to regression.
#[derive(Debug)]
pub struct Design<'a> {
    coordinates: &'a Coordinates,
    terms: Vec<TermColumns>,
}

/// The columns of one term.
#[derive(Debug)]
struct TermColumns {
    term: Term,
    /// Its parameters among all, and the indices of the linear ones among its own.
    parameters: Range<usize>,
    linear: Vec<usize>,
    dimension: usize,
    sites: Vec<Site>,
    columns: usize,
}

impl<'a> Design<'a> {
    pub(crate) fn new(coordinates: &'a Coordinates, terms: &[Term]) -> Self {
        let columns = |(&term, parameters): (&Term, Range<usize>)| {
            let space = space_of(coordinates, &term);
            TermColumns {
                term,
                parameters,
                linear: linear_entries(&term.kind.parameters(space)).collect(),
                dimension: space.dimension,
                sites: if coordinates.has_rotation() { Vec::new() } else { coordinates.sites(term.port) },
                columns: term.kind.columns(space),
            }
        };
        let terms = terms.iter().zip(ranges(coordinates, terms)).map(columns).collect();
        Self { coordinates, terms }
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.terms.iter().map(|term| term.columns).sum()
    }

    /// The columns at a state, `[n, columns]`: with coefficients they add up to the inertial force.
    /// Parameters that do not enter linearly have the values in `p`.
    #[must_use]
    pub fn at(&self, p: &[f64], state: &State) -> DMatrix<f64> {
        let mut found = DMatrix::zeros(self.coordinates.freedoms(), self.columns());
        let mut first = 0;
        for term in &self.terms {
            let mut own = found.columns_mut(first, term.columns);
            if self.coordinates.has_rotation() {
                term.add_of_body(self.coordinates, p, state, &mut own);
            } else {
                term.add_of_vector(p, state, &mut own);
            }
            first += term.columns;
        }
        found
    }
}

impl TermColumns {
    /// Columns at a position and velocity of the term's space.
    fn block(&self, p: &[f64], at: At<'_>) -> Block {
        let mut block = Block::zeros(self.dimension, self.columns);
        self.term.kind.design(&p[self.parameters.clone()], at, &self.linear, &mut block);
        block
    }

    fn add_of_body(
        &self,
        coordinates: &Coordinates,
        p: &[f64],
        state: &State,
        to: &mut DMatrixViewMut<'_, f64>,
    ) {
        let arm = match coordinates {
            Coordinates::Ball(ball) => ball.arm(p),
            _ => DVec3::ZERO,
        };
        let inertia = coordinates.inertia().copied().unwrap_or(Inertia::ball(1.0));
        let middle = inertia.moments[1];
        let moved = Moved::new(&state.x, &state.v);
        let port = BodyPort { port: self.term.port, arm, scale: middle, tensor: inertia.tensor(p) };
        let (y, w) = port.read(&moved);
        let block = self.block(p, At { y: &y.to_array(), w: &w.to_array() });
        for column in 0..self.columns {
            let force = DVec3::new(block[(0, column)], block[(1, column)], block[(2, column)]);
            let (torque, pull) = port.act(&moved, force);
            let both = [(torque / middle).to_array(), pull.to_array()];
            to.column_mut(column).iter_mut().zip(both.as_flattened()).for_each(|(to, value)| *to += value);
        }
    }

    fn add_of_vector(&self, p: &[f64], state: &State, to: &mut DMatrixViewMut<'_, f64>) {
        let d = self.dimension;
        for site in &self.sites {
            let read = |from: &[f64]| -> Vec<f64> {
                let part = |start: usize| &from[start..start + d];
                match site.minus {
                    Some(minus) => part(site.plus).iter().zip(part(minus)).map(|(a, b)| a - b).collect(),
                    None => part(site.plus).to_vec(),
                }
            };
            let mut y = read(&state.x);
            y.iter_mut().enumerate().for_each(|(axis, y)| *y -= site.offset_in(p, axis));
            let block = self.block(p, At { y: &y, w: &read(&state.v) });
            let reaction = site.mass.map_or(1.0, |mass| 1.0 / p[mass]);
            for (axis, column) in (0..d).flat_map(|axis| (0..self.columns).map(move |column| (axis, column)))
            {
                to[(site.plus + axis, column)] += block[(axis, column)];
                if let Some(minus) = site.minus {
                    to[(minus + axis, column)] -= reaction * block[(axis, column)];
                }
            }
        }
    }
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
