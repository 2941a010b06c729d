//! Kinetic energy, and the positions of ports.

use super::{Coordinates, Port, State};
use glam::DVec3;
use lgs_core::geometry::quaternion;

impl Coordinates {
    /// Kinetic energy per mass; `p` are the law's parameters.
    #[must_use]
    pub fn kinetic_energy(&self, p: &[f64], state: &State) -> f64 {
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let v = &state.v;
        match self {
            Self::Pair => 0.5 * (square(&v[..3]) + p[0] * square(&v[3..])),
            Self::Tree(tree) => tree.kinetic_energy(p, state),
            _ => match self.inertia() {
                None => 0.5 * square(v),
                Some(inertia) => {
                    let spin = DVec3::from_slice(v);
                    0.5 * (spin.dot(inertia.tensor(p) * spin) + square(&v[3..]))
                }
            },
        }
    }

    /// Positions at which the energy of a term at a port counts, each with its weight (the point's mass).
    pub(crate) fn positions(&self, p: &[f64], port: Port, state: &State) -> Vec<(f64, Vec<f64>)> {
        if let (Self::Ball(ball), Port::Arm) = (self, port) {
            let arm = quaternion(&state.x) * ball.arm(p);
            return vec![(1.0, arm.to_array().to_vec())];
        }
        if self.has_rotation() {
            return vec![(1.0, state.x[4..].to_vec())];
        }
        let dimension = self.space(port).map_or(0, |space| space.dimension);
        let part = |start: usize| &state.x[start..start + dimension];
        let sites = self.sites(port).into_iter().map(|site| match site.minus {
            Some(minus) => {
                let apart = part(site.plus).iter().zip(part(minus)).enumerate();
                (1.0, apart.map(|(axis, (a, b))| a - b - site.offset_in(p, axis)).collect())
            }
            None => {
                let second = matches!(self, Self::Pair) && site.plus > 0;
                (if second { p[0] } else { 1.0 }, part(site.plus).to_vec())
            }
        });
        sites.collect()
    }
}
