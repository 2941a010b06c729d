//! Lloyd's k-means with k-means++ seeding (method §5.1).
//!
//! Seeds are drawn from a fixed stream and sums run in order of the points: the same points always give the
//! same clusters.

use rand::RngExt;

/// The cluster of each point, as the smallest index of its members. Fewer than `k` clusters come back where
/// points coincide.
pub(crate) fn k_means<const D: usize>(points: &[[f64; D]], k: usize) -> Vec<usize> {
    let mut centers = seeds(points, k);
    let mut own = assigned(points, &centers);
    let mut spread = f64::INFINITY;
    loop {
        centers = means(points, &own, &centers);
        let next = assigned(points, &centers);
        let next_spread = points.iter().zip(&next).map(|(p, &c)| distance2(p, &centers[c])).sum();
        if next_spread >= spread {
            break;
        }
        (own, spread) = (next, next_spread);
    }
    let mut first = vec![usize::MAX; centers.len()];
    own.iter().enumerate().for_each(|(i, &c)| first[c] = first[c].min(i));
    own.into_iter().map(|c| first[c]).collect()
}

/// First centres: each is a point drawn with a probability proportional to its squared distance from those
/// before.
fn seeds<const D: usize>(points: &[[f64; D]], k: usize) -> Vec<[f64; D]> {
    let mut rng = lgs_core::stream(0, "k-means", 0);
    let mut centers: Vec<[f64; D]> = points.first().copied().into_iter().collect();
    let mut nearest: Vec<f64> =
        points.iter().map(|p| centers.first().map_or(0.0, |c| distance2(p, c))).collect();
    while centers.len() < k {
        let total: f64 = nearest.iter().sum();
        if total <= 0.0 {
            break;
        }
        let mut left = rng.random_range(0.0..total);
        let drawn = nearest.iter().position(|&d| {
            left -= d;
            d > 0.0 && left < 0.0
        });
        // Rounding may leave a rest beyond the last point.
        let Some(drawn) = drawn.or_else(|| nearest.iter().rposition(|&d| d > 0.0)) else { break };
        let center = points[drawn];
        nearest.iter_mut().zip(points).for_each(|(d, p)| *d = d.min(distance2(p, &center)));
        centers.push(center);
    }
    centers
}

fn assigned<const D: usize>(points: &[[f64; D]], centers: &[[f64; D]]) -> Vec<usize> {
    let nearest = |p: &[f64; D]| {
        (0..centers.len()).min_by(|&a, &b| distance2(p, &centers[a]).total_cmp(&distance2(p, &centers[b])))
    };
    points.iter().map(|p| nearest(p).unwrap_or(0)).collect()
}

/// Means of the clusters; an empty one keeps its centre.
fn means<const D: usize>(points: &[[f64; D]], own: &[usize], centers: &[[f64; D]]) -> Vec<[f64; D]> {
    let mut sums = vec![([0.0; D], 0_usize); centers.len()];
    for (point, &c) in points.iter().zip(own) {
        sums[c].0.iter_mut().zip(point).for_each(|(sum, x)| *sum += x);
        sums[c].1 += 1;
    }
    let mean = |(&(sum, count), center): (&([f64; D], usize), &[f64; D])| {
        if count == 0 { *center } else { sum.map(|x| x / count as f64) }
    };
    sums.iter().zip(centers).map(mean).collect()
}

fn distance2<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blobs() -> Vec<[f64; 2]> {
        let offsets = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]];
        let at = |c: [f64; 2]| offsets.map(|o| [c[0] + o[0], c[1] + o[1]]);
        [at([0.0, 0.0]), at([5.0, 0.0]), at([0.0, 5.0])].concat()
    }

    #[test]
    fn separate_groups_are_found() {
        assert_eq!(k_means(&blobs(), 3), [0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8]);
        assert_eq!(k_means(&blobs(), 1), [0; 12]);
    }

    #[test]
    fn more_clusters_than_distinct_points_is_no_error() {
        assert_eq!(k_means(&[[1.0], [1.0], [2.0]], 5), [0, 0, 2]);
        assert_eq!(k_means::<1>(&[], 3), Vec::<usize>::new());
    }
}
