//! The rigidity prior: neighbouring Gaussians keep the distances that they have before deformation. It is
//! evaluated as a gradient by the deformed positions.
//!
//! `E = weight · mean over edges of ρ(e)`, `e = |q_i − q_j| / |p_i − p_j| − 1` with canonical p and deformed
//! q, and `ρ(e) = e² / (1 + (e/c)²)`: an edge between two bodies that part stretches beyond c, and the pull
//! on it vanishes.

use burn::tensor::{Device, IndexingUpdateOp, Int, Tensor};
use lgs_core::k_nearest;
use lgs_model::{TensorFile, TensorFileError};

use super::config_groups::RigidityConfig;
use crate::cloud_tensors::row_indices;
use crate::device::has_kernels;
use crate::thresholds::{MIN_LENGTH, MIN_REST_LENGTH};

/// Name of the neighbours in a checkpoint.
const NAME: &str = "rigidity.neighbors";

/// Edges from every Gaussian to its nearest neighbours.
pub(super) struct NeighborGraph {
    /// Numbers of the neighbours of every Gaussian, `[n, k]`.
    indices: Vec<u32>,
    /// Number of neighbours per Gaussian, k.
    row: usize,
    /// First end of every edge, `[n k]`.
    first: Tensor<1, Int>,
    /// Second end of every edge, `[n k]`.
    second: Tensor<1, Int>,
    /// First and second end of every edge in turns, `[2 n k]`.
    ends: Tensor<1, Int>,
    /// Edges by their second ends, where sums over them are gathered.
    by_second: Option<BySecond>,
}

/// The edges that end at every Gaussian, as many places each as there are edges at most; those without an
/// edge hold the number behind the last edge's. The tensor library adds into rows one edge after the other,
/// which a GPU does with three units; a gather keeps all of them at work.
struct BySecond {
    edges: Tensor<1, Int>,
    most: usize,
}

impl BySecond {
    fn of(indices: &[u32], gaussians: usize, device: &Device) -> Self {
        let mut ending = vec![Vec::new(); gaussians];
        indices.iter().enumerate().for_each(|(edge, &j)| ending[j as usize].push(edge));
        let most = ending.iter().map(Vec::len).max().unwrap_or(0).max(1);
        ending.iter_mut().for_each(|edges| edges.resize(most, indices.len()));
        Self { edges: row_indices(ending.into_iter().flatten(), device), most }
    }

    /// Sums `[n, 3]` over the edges at both ends, of values `[n k, 3]` that the second end has negated.
    fn sums(&self, values: &Tensor<2>, row: usize) -> Tensor<2> {
        let [edges, _] = values.dims();
        let n = edges / row;
        let of_first = values.clone().reshape([n, row, 3]).sum_dim(1);
        let padded = Tensor::cat(vec![values.clone(), Tensor::zeros([1, 3], &values.device())], 0);
        let of_second = padded.select(0, self.edges.clone()).reshape([n, self.most, 3]).sum_dim(1);
        (of_first - of_second).reshape([n, 3])
    }
}

impl NeighborGraph {
    /// The graph of the nearest `neighbors` of every point.
    pub(super) fn new(points: &[[f32; 3]], neighbors: usize, device: &Device) -> Self {
        let (all, row) = k_nearest(points, neighbors);
        let indices = all.chunks_exact(row.max(1)).flat_map(|r| &r[1..]).copied().collect();
        Self::of(indices, row.saturating_sub(1), device)
    }

    fn of(indices: Vec<u32>, row: usize, device: &Device) -> Self {
        let edges = || indices.iter().enumerate().map(|(at, &j)| [at / row.max(1), j as usize]);
        let gathers = has_kernels(device) && row > 0;
        Self {
            by_second: gathers.then(|| BySecond::of(&indices, indices.len() / row, device)),
            first: row_indices(edges().map(|[i, _]| i), device),
            second: row_indices(edges().map(|[_, j]| j), device),
            ends: row_indices(edges().flatten(), device),
            indices,
            row,
        }
    }

    /// The gradient `[n, 3]` of the energy by the deformed positions.
    pub(super) fn gradient(
        &self,
        canonical: &Tensor<2>,
        deformed: &Tensor<2>,
        config: &RigidityConfig,
    ) -> Tensor<2> {
        if self.indices.is_empty() {
            return deformed.zeros_like();
        }
        let (edges, factor) = (self.indices.len(), config.weight / self.indices.len() as f32);
        let rest = length(&self.difference(canonical)).clamp_min(MIN_REST_LENGTH);
        let difference = self.difference(deformed);
        let length = length(&difference).clamp_min(MIN_LENGTH);
        let strain = length.clone() / rest.clone() - 1.0;
        let spread = strain.clone().div_scalar(config.robust_scale).square() + 1.0;
        let slope = strain.mul_scalar(2.0 * factor) / spread.square() / (rest * length);
        let pull = difference * slope;
        if let Some(by_second) = &self.by_second {
            return by_second.sums(&pull, self.row);
        }
        let on_ends = Tensor::cat(vec![pull.clone(), -pull], 1).reshape([2 * edges, 3]);
        deformed.zeros_like().select_assign(0, self.ends.clone(), on_ends, IndexingUpdateOp::Add)
    }

    /// Differences `[n k, 3]` of rows at the ends of every edge.
    fn difference(&self, points: &Tensor<2>) -> Tensor<2> {
        points.clone().select(0, self.first.clone()) - points.clone().select(0, self.second.clone())
    }

    /// Adds the neighbours to a checkpoint.
    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        file.insert_indices(NAME, &[self.indices.len() / self.row.max(1), self.row], &self.indices);
    }

    /// Reads the neighbours of `n` Gaussians, if the checkpoint holds any.
    pub(super) fn read_from(
        file: &TensorFile,
        n: usize,
        device: &Device,
    ) -> Result<Option<Self>, TensorFileError> {
        if !file.names().any(|name| name == NAME) {
            return Ok(None);
        }
        let (shape, indices) = file.indices(NAME)?;
        if shape.len() != 2 || shape[0] != n || indices.iter().any(|&i| i as usize >= n) {
            return Err(file.field(NAME, &format!("[{n}, k] indices below {n}"), format!("shape {shape:?}")));
        }
        Ok(Some(Self::of(indices.to_vec(), shape[1], device)))
    }
}

/// Lengths `[n, 1]` of rows.
fn length(rows: &Tensor<2>) -> Tensor<2> {
    rows.clone().square().sum_dim(1).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud_tensors::{host_rows, rows};
    use crate::device::DeviceName;
    use lgs_core::linear::{norm, sub};

    const CONFIG: RigidityConfig = RigidityConfig { weight: 1.0, neighbors: 4, robust_scale: 0.5 };

    fn points() -> Vec<[f32; 3]> {
        (0..30).map(|i| [(i as f32 * 1.7).sin(), (i as f32 * 0.9).cos(), (i as f32 * 2.3).sin()]).collect()
    }

    /// Neighbours, and the gradient for points deformed to others.
    fn gradient(p: &[[f32; 3]], q: &[[f32; 3]]) -> (NeighborGraph, Vec<[f32; 3]>) {
        let device = DeviceName::Cpu.device();
        let graph = NeighborGraph::new(p, 4, &device);
        let gradient = host_rows(&graph.gradient(&rows(p, &device), &rows(q, &device), &CONFIG));
        (graph, gradient)
    }

    #[test]
    fn a_rigid_motion_costs_nothing() {
        let p = points();
        let moved: Vec<[f32; 3]> = p.iter().map(|q| [q[1] + 1.0, -q[0], q[2] - 2.0]).collect();
        assert!(gradient(&p, &moved).1.as_flattened().iter().all(|v| v.abs() < 1e-5));
    }

    #[test]
    fn gathered_sums_are_those_of_the_edges_one_by_one() {
        let (device, p) = (DeviceName::Cpu.device(), points());
        let q: Vec<[f32; 3]> = p.iter().map(|v| [v[0] * 1.2, v[1] + 0.3 * v[0], v[2]]).collect();
        let (mut graph, expected) = gradient(&p, &q);
        graph.by_second = Some(BySecond::of(&graph.indices, p.len(), &device));
        let found: Vec<[f32; 3]> =
            host_rows(&graph.gradient(&rows(&p, &device), &rows(&q, &device), &CONFIG));
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_energy() {
        let p = points();
        let q: Vec<[f32; 3]> =
            p.iter().enumerate().map(|(i, v)| [v[0] * 1.2, v[1], v[2] + 0.01 * i as f32]).collect();
        let (graph, gradient) = gradient(&p, &q);
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
