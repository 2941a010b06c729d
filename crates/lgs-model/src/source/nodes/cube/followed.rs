//! Who follows whom, on the device: the nodes of every Gaussian, and the followers of every node.

use lgs_tensor::cube::latest::Latest;
use lgs_tensor::cube::{CubeDevice, CubeTensor, numbers};

use crate::source::nodes::neighbors::Neighbors;

/// The neighbours of one search.
#[derive(Clone, Debug)]
pub(super) struct Followed {
    /// `[n row]`: nodes of every Gaussian.
    pub(super) neighbors: CubeTensor,
    /// `[m + 1]`: where the followers of each node begin.
    pub(super) begins: CubeTensor,
    /// `[n row]`: places of each node among the neighbours, in their order.
    pub(super) members: CubeTensor,
    /// Nodes of a Gaussian.
    pub(super) row: usize,
}

/// Uploads the neighbours among a number of nodes to the device of a tensor. Those of the last call stay
/// there: a search serves many steps of training.
pub(super) fn followed(neighbors: &Neighbors, nodes: usize, like: &CubeTensor) -> Followed {
    static LATEST: Latest<Vec<u32>, Followed> = Latest::none();
    LATEST.of(&neighbors.indices, (&like.device, nodes), || upload(neighbors, nodes, &like.device))
}

fn upload(neighbors: &Neighbors, nodes: usize, device: &CubeDevice) -> Followed {
    let (begins, members) = by_node(&neighbors.indices, nodes);
    Followed {
        neighbors: numbers(neighbors.indices.to_vec(), device),
        begins: numbers(begins, device),
        members: numbers(members, device),
        row: neighbors.row,
    }
}

/// Where the places of every node among the neighbours begin, and the places.
fn by_node(indices: &[u32], nodes: usize) -> (Vec<u32>, Vec<u32>) {
    let mut begins = vec![0; nodes + 1];
    indices.iter().for_each(|&node| begins[node as usize + 1] += 1);
    (0..nodes).for_each(|node| begins[node + 1] += begins[node]);
    let (mut next, mut members) = (begins.clone(), vec![0; indices.len()]);
    for (place, &node) in (0..).zip(indices) {
        members[next[node as usize] as usize] = place;
        next[node as usize] += 1;
    }
    (begins, members)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_come_node_by_node_in_their_order() {
        let (begins, members) = by_node(&[2, 0, 0, 2, 2, 0], 4);
        assert_eq!((begins.as_slice(), members.as_slice()), (&[0, 3, 3, 6, 6][..], &[1, 2, 5, 0, 3, 4][..]));
    }
}
