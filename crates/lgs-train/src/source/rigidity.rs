//! A pull of neighbouring Gaussians towards the distances they have before deformation, as a cotangent of the
//! deformed positions.
//!
//! `E = weight · mean over edges of ρ(e)`, `e = |q_i − q_j| / |p_i − p_j| − 1` with canonical p and deformed
//! q, and `ρ(e) = e² / (1 + (e/c)²)`: edges between bodies that part stretch beyond c and are let go.

use lgs_core::k_nearest;
use lgs_core::linear::{norm, sub};

use super::config::RigidityConfig;

/// Edges between Gaussians, `[n, k]` indices of neighbours.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NeighborGraph {
    pub(super) indices: Vec<u32>,
    pub(super) row: usize,
}

impl NeighborGraph {
    pub(super) fn new(points: &[[f32; 3]], neighbors: usize) -> Self {
        let (all, row) = k_nearest(points, neighbors);
        let indices = all.chunks_exact(row.max(1)).flat_map(|r| &r[1..]).copied().collect();
        Self { indices, row: row.saturating_sub(1) }
    }

    /// The gradient of the energy by the deformed positions.
    pub(super) fn gradient(
        &self,
        canonical: &[[f32; 3]],
        deformed: &[[f32; 3]],
        config: &RigidityConfig,
    ) -> Vec<[f32; 3]> {
        let mut gradient = vec![[0.0; 3]; deformed.len()];
        let factor = config.weight / self.indices.len().max(1) as f32;
        for (i, row) in self.indices.chunks_exact(self.row.max(1)).enumerate() {
            for &j in row {
                let j = j as usize;
                let rest = norm(sub(canonical[i], canonical[j])).max(1e-6);
                let d = sub(deformed[i], deformed[j]);
                let length = norm(d).max(1e-9);
                let e = length / rest - 1.0;
                let spread = 1.0 + (e / config.robust_scale).powi(2);
                let slope = factor * 2.0 * e / (spread * spread) / (rest * length);
                for axis in 0..3 {
                    gradient[i][axis] += slope * d[axis];
                    gradient[j][axis] -= slope * d[axis];
                }
            }
        }
        gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: RigidityConfig = RigidityConfig { weight: 1.0, neighbors: 4, robust_scale: 0.5 };

    fn points() -> Vec<[f32; 3]> {
        (0..30).map(|i| [(i as f32 * 1.7).sin(), (i as f32 * 0.9).cos(), (i as f32 * 2.3).sin()]).collect()
    }

    #[test]
    fn a_rigid_motion_costs_nothing() {
        let p = points();
        let graph = NeighborGraph::new(&p, 4);
        let moved: Vec<[f32; 3]> = p.iter().map(|q| [q[1] + 1.0, -q[0], q[2] - 2.0]).collect();
        assert!(graph.gradient(&p, &moved, &CONFIG).as_flattened().iter().all(|v| v.abs() < 1e-5));
    }

    #[test]
    fn the_gradient_is_that_of_the_energy() {
        let p = points();
        let graph = NeighborGraph::new(&p, 4);
        let q: Vec<[f32; 3]> =
            p.iter().enumerate().map(|(i, v)| [v[0] * 1.2, v[1], v[2] + 0.01 * i as f32]).collect();
        let energy = |q: &[[f32; 3]]| {
            let edges = graph
                .indices
                .chunks_exact(graph.row)
                .enumerate()
                .flat_map(|(i, r)| r.iter().map(move |&j| (i, j as usize)));
            let rho = |(i, j): (usize, usize)| {
                let e = f64::from(norm(sub(q[i], q[j])) / norm(sub(p[i], p[j])) - 1.0);
                e * e / (1.0 + (e / 0.5).powi(2))
            };
            edges.map(rho).sum::<f64>() / graph.indices.len() as f64
        };
        let gradient = graph.gradient(&p, &q, &CONFIG);
        let direction: Vec<[f32; 3]> =
            (0..30).map(|i| [(i as f32).cos(), (i as f32 * 0.3).sin(), 0.5]).collect();
        let shifted = |h: f32| -> Vec<[f32; 3]> {
            q.iter().zip(&direction).map(|(a, b)| std::array::from_fn(|axis| a[axis] + h * b[axis])).collect()
        };
        let numeric = (energy(&shifted(1e-3)) - energy(&shifted(-1e-3))) / 2e-3;
        let exact: f32 =
            gradient.as_flattened().iter().zip(direction.as_flattened()).map(|(a, b)| a * b).sum();
        assert!((numeric - f64::from(exact)).abs() < 1e-3 * numeric.abs().max(0.1), "{numeric} {exact}");
    }
}
