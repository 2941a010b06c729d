//! The rigidity prior: neighbouring Gaussians keep the distances that they have before deformation. It is
//! evaluated as a gradient by the deformed positions.
//!
//! `E = weight · mean over edges of ρ(e)`, `e = |q_i − q_j| / |p_i − p_j| − 1` with canonical p and deformed
//! q, and `ρ(e) = e² / (1 + (e/c)²)`: an edge between two bodies that part stretches beyond c, and the pull
//! on it vanishes.

use burn::tensor::{Device, Int, Tensor};
use lgs_core::k_nearest;
use lgs_core::linear::{add, norm, scale, sub};
use lgs_model::{TensorFile, TensorFileError};

use super::config_groups::RigidityConfig;
use crate::cloud_tensors::{host_rows, row_indices, rows};
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
    /// The edges as tensors, for devices with kernels of their own.
    on_device: Option<EdgeTensors>,
}

/// Edges on a device with kernels of its own. The tensor library adds into rows one edge after the other,
/// which a GPU does with three units; a gather of the edges that end at each Gaussian keeps all of them at
/// work.
struct EdgeTensors {
    /// First end of every edge, `[n k]`.
    first: Tensor<1, Int>,
    /// Second end of every edge, `[n k]`.
    second: Tensor<1, Int>,
    /// The edges that have each Gaussian as their second end, `[n most]`; places without an edge hold n k.
    by_second: Tensor<1, Int>,
    /// The most edges that have one Gaussian as their second end.
    most: usize,
}

impl EdgeTensors {
    fn of(indices: &[u32], row: usize, device: &Device) -> Self {
        let mut ending = vec![Vec::new(); indices.len() / row];
        indices.iter().enumerate().for_each(|(edge, &j)| ending[j as usize].push(edge));
        let most = ending.iter().map(Vec::len).max().unwrap_or(0).max(1);
        ending.iter_mut().for_each(|edges| edges.resize(most, indices.len()));
        Self {
            first: row_indices((0..indices.len()).map(|edge| edge / row), device),
            second: row_indices(indices.iter().map(|&j| j as usize), device),
            by_second: row_indices(ending.into_iter().flatten(), device),
            most,
        }
    }

    /// The gradient `[n, 3]` of the energy by the deformed positions.
    fn gradient(&self, canonical: &Tensor<2>, deformed: &Tensor<2>, config: &RigidityConfig) -> Tensor<2> {
        let ([n, _], [edges]) = (deformed.dims(), self.first.dims());
        let rest = length(&self.difference(canonical)).clamp_min(MIN_REST_LENGTH);
        let difference = self.difference(deformed);
        let length = length(&difference).clamp_min(MIN_LENGTH);
        let strain = length.clone() / rest.clone() - 1.0;
        let spread = strain.clone().div_scalar(config.robust_scale).square() + 1.0;
        let factor = 2.0 * config.weight / edges as f32;
        let pulls = difference * (strain.mul_scalar(factor) / spread.square() / (rest * length));
        let of_first = pulls.clone().reshape([n, edges / n, 3]).sum_dim(1);
        let padded = Tensor::cat(vec![pulls, Tensor::zeros([1, 3], &deformed.device())], 0);
        let of_second = padded.select(0, self.by_second.clone()).reshape([n, self.most, 3]).sum_dim(1);
        (of_first - of_second).reshape([n, 3])
    }

    /// Differences `[n k, 3]` of rows at the ends of every edge.
    fn difference(&self, points: &Tensor<2>) -> Tensor<2> {
        points.clone().select(0, self.first.clone()) - points.clone().select(0, self.second.clone())
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
        let on_device = has_kernels(device) && !indices.is_empty();
        Self { on_device: on_device.then(|| EdgeTensors::of(&indices, row, device)), indices, row }
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
        match &self.on_device {
            Some(edges) => edges.gradient(canonical, deformed, config),
            None => self.gradient_on_processor(canonical, deformed, config),
        }
    }

    /// The same edge by edge, without a tensor for each intermediate result, whose memory would take most of
    /// the time.
    fn gradient_on_processor(
        &self,
        canonical: &Tensor<2>,
        deformed: &Tensor<2>,
        config: &RigidityConfig,
    ) -> Tensor<2> {
        let (p, q) = (host_rows::<3>(canonical), host_rows::<3>(deformed));
        let factor = 2.0 * config.weight / self.indices.len() as f32;
        let mut gradient = vec![[0.0_f32; 3]; q.len()];
        for (i, neighbors) in self.indices.chunks_exact(self.row).enumerate() {
            for j in neighbors.iter().map(|&j| j as usize) {
                let rest = norm(sub(p[i], p[j])).max(MIN_REST_LENGTH);
                let difference = sub(q[i], q[j]);
                let length = norm(difference).max(MIN_LENGTH);
                let strain = length / rest - 1.0;
                let spread = (strain / config.robust_scale).powi(2) + 1.0;
                let pull = scale(difference, factor * strain / (spread * spread * rest * length));
                gradient[i] = add(gradient[i], pull);
                gradient[j] = sub(gradient[j], pull);
            }
        }
        rows(&gradient, &deformed.device())
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
    use crate::device::DeviceName;

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
    fn the_gradient_on_devices_is_that_of_the_processor() {
        let (device, p) = (DeviceName::Cpu.device(), points());
        let q: Vec<[f32; 3]> = p.iter().map(|v| [v[0] * 1.2, v[1] + 0.3 * v[0], v[2]]).collect();
        let (mut graph, expected) = gradient(&p, &q);
        graph.on_device = Some(EdgeTensors::of(&graph.indices, graph.row, &device));
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
