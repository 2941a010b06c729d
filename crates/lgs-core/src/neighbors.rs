//! Nearest neighbours by a kd-tree, with ties broken by index so that the answer is one.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// For each point the indices of itself and its `k` nearest others, nearest first: `[n, k + 1]`.
///
/// With fewer than `k + 1` points every row holds all of them; the row length is `min(k + 1, n)`.
#[must_use]
pub fn k_nearest(points: &[[f32; 3]], k: usize) -> (Vec<u32>, usize) {
    let row = (k + 1).min(points.len());
    if row == 0 {
        return (Vec::new(), 0);
    }
    let found = nearest_with_distance(points, points, row);
    let mut indices = Vec::with_capacity(points.len() * row);
    for (own, neighbours) in found.chunks_exact(row).enumerate() {
        let own = own as u32;
        indices.push(own);
        indices.extend(neighbours.iter().map(|&(_, i)| i).filter(|&i| i != own).take(row - 1));
    }
    (indices, row)
}

/// For each query the index of the nearest of `points`; empty if there are no points.
#[must_use]
pub fn nearest_indices(points: &[[f32; 3]], queries: &[[f32; 3]]) -> Vec<u32> {
    nearest_with_distance(points, queries, 1).into_iter().map(|(_, i)| i).collect()
}

/// For each point the mean squared distance to its `k` nearest others (0 for a lone point).
#[must_use]
pub fn mean_squared_neighbor_distance(points: &[[f32; 3]], k: usize) -> Vec<f32> {
    let row = (k + 1).min(points.len());
    if row < 2 {
        return vec![0.0; points.len()];
    }
    let found = nearest_with_distance(points, points, row);
    found.chunks_exact(row).map(|r| r.iter().map(|&(d, _)| d).sum::<f32>() / (row - 1) as f32).collect()
}

/// `[queries, count]` pairs of squared distance and index, nearest first, ties by index.
fn nearest_with_distance(points: &[[f32; 3]], queries: &[[f32; 3]], count: usize) -> Vec<(f32, u32)> {
    let Some(wanted) = NonZero::new(count.min(points.len())) else { return Vec::new() };
    let tree: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(points);
    let mut found = Vec::with_capacity(queries.len() * wanted.get());
    for query in queries {
        let mut row: Vec<(f32, u32)> = tree
            .nearest_n::<SquaredEuclidean>(query, wanted)
            .into_iter()
            .map(|n| (n.distance, n.item as u32))
            .collect();
        row.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.extend(row);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_start_with_the_point_itself_and_are_sorted_by_distance() {
        let points: Vec<[f32; 3]> = (0..20).map(|i| [i as f32 * i as f32, 0.0, 0.0]).collect();
        let (indices, row) = k_nearest(&points, 3);
        assert_eq!(row, 4);
        assert_eq!(&indices[4 * 10..4 * 11], [10, 9, 11, 8]);
    }

    #[test]
    fn coincident_points_keep_their_own_index_first() {
        let points = vec![[1.0, 2.0, 3.0]; 300];
        let (indices, row) = k_nearest(&points, 4);
        for (own, neighbours) in indices.chunks_exact(row).enumerate() {
            assert_eq!(neighbours[0] as usize, own);
            assert!(!neighbours[1..].contains(&(own as u32)));
        }
    }

    #[test]
    fn fewer_points_than_neighbours_is_no_error() {
        assert_eq!(k_nearest(&[[0.0; 3]], 5), (vec![0], 1));
        assert_eq!(k_nearest(&[], 5), (vec![], 0));
        assert_eq!(mean_squared_neighbor_distance(&[[0.0; 3]], 3), [0.0]);
    }
}
