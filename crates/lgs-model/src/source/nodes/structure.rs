//! What training keeps of nodes beside their parameters, and its place in a checkpoint.

use super::choose::Discord;
use super::neighbors::Neighbors;
use super::node::NODE;
use super::priors::Edges;
use crate::tensor_file::{TensorFile, TensorFileError};

/// Name of the nodes of every Gaussian in a checkpoint.
const NEIGHBORS: &str = "nodes.neighbors";

/// Which nodes there are, who follows them, and which of them are near each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Structure {
    /// Number of nodes.
    pub(super) count: usize,
    /// Iteration at which they were last chosen.
    pub(super) adapted: usize,
    /// Nodes of every Gaussian; none if the Gaussians are others since.
    pub(super) neighbors: Option<Neighbors>,
    /// Near nodes.
    pub(super) edges: Edges,
    /// Discord since they were last chosen.
    pub(super) discord: Discord,
}

impl Structure {
    /// Nodes that were chosen at an iteration, before anyone follows them.
    pub(super) fn new(nodes: &[[f32; NODE]], near: usize, iteration: usize) -> Self {
        Self {
            count: nodes.len(),
            adapted: iteration,
            neighbors: None,
            edges: Edges::new(nodes, near),
            discord: Discord { of_nodes: vec![0.0; nodes.len()] },
        }
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        file.set_metadata("nodes.count", self.count.to_string());
        file.set_metadata("nodes.adapted", self.adapted.to_string());
        file.insert("nodes.discord", &[self.count], &self.discord.of_nodes);
        let pairs: Vec<u32> = self.edges.pairs().flatten().collect();
        file.insert_indices("nodes.edges", &[pairs.len() / 2, 2], &pairs);
        if let Some(Neighbors { indices, row }) = &self.neighbors {
            file.insert_indices(NEIGHBORS, &[indices.len() / row.max(&1), *row], indices);
        }
    }

    /// Reads what [`Self::insert_into`] wrote, for a number of Gaussians.
    pub(super) fn read_from(file: &TensorFile, gaussians: usize) -> Result<Self, TensorFileError> {
        let count: usize = file.metadata_json("nodes.count")?;
        let (shape, discord) = file.values("nodes.discord")?;
        if shape != [count] {
            return Err(file.field("nodes.discord", &format!("[{count}]"), format!("{shape:?}")));
        }
        let pairs = rows(file, "nodes.edges", (None, Some(2)), count)?.1;
        let neighbors = match file.names().any(|name| name == NEIGHBORS) {
            true => {
                let (row, indices) = rows(file, NEIGHBORS, (Some(gaussians), None), count)?;
                Some(Neighbors { indices: indices.into(), row })
            }
            false => None,
        };
        Ok(Self {
            count,
            adapted: file.metadata_json("nodes.adapted")?,
            neighbors,
            edges: Edges::of(pairs.as_chunks().0.iter().copied()),
            discord: Discord { of_nodes: discord.to_vec() },
        })
    }
}

/// Row length and values of rows of numbers of nodes; a wanted extent of `None` may be any.
fn rows(
    file: &TensorFile,
    name: &str,
    wanted: (Option<usize>, Option<usize>),
    nodes: usize,
) -> Result<(usize, Vec<u32>), TensorFileError> {
    let (shape, indices) = file.indices(name)?;
    let fits = |n: usize, row: usize| wanted.0.is_none_or(|w| w == n) && wanted.1.is_none_or(|w| w == row);
    match *shape {
        [n, row] if fits(n, row) && indices.iter().all(|&i| (i as usize) < nodes) => {
            Ok((row, indices.to_vec()))
        }
        _ => Err(file.field(name, &format!("rows of numbers below {nodes}"), format!("shape {shape:?}"))),
    }
}
