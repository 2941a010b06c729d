//! Possible positions of a moving thing at a time: voxels that the silhouettes near that time agree on, and
//! the smoothest path through them.

use lgs_data::dataset::SceneBox;
use rayon::prelude::*;

use super::silhouettes::Silhouette;
use super::thresholds::{CANDIDATES, MISS_WEIGHT, STRIDE, STRIDE_COST, VOTE_REACH, VOXELS};

/// Votes of every silhouette on every voxel: 1 covered, −1 missed, 0 out of view.
pub(super) struct Votes {
    times: Vec<f32>,
    centers: Vec<[f32; 3]>,
    votes: Vec<Vec<i8>>,
    half_side: f32,
}

impl Votes {
    pub(super) fn new(silhouettes: &[Silhouette], bounds: SceneBox) -> Self {
        let at = |i: usize| (2.0 * (i as f32 + 0.5) / VOXELS as f32 - 1.0) * bounds.half_side;
        let center = |i: usize| {
            let cell = [i % VOXELS, i / VOXELS % VOXELS, i / (VOXELS * VOXELS)];
            std::array::from_fn(|axis| bounds.center[axis] + at(cell[axis]))
        };
        let centers: Vec<[f32; 3]> = (0..VOXELS.pow(3)).map(center).collect();
        let votes = silhouettes
            .par_iter()
            .map(|silhouette| centers.iter().map(|&c| vote(silhouette, c)).collect())
            .collect();
        Self {
            times: silhouettes.iter().map(|s| s.time).collect(),
            centers,
            votes,
            half_side: bounds.half_side,
        }
    }

    /// Whether any silhouette is near enough in time to a moment, `span` being that of the whole.
    pub(super) fn reach(silhouettes: &[Silhouette], moment: f32, span: f32) -> bool {
        silhouettes.iter().any(|silhouette| (silhouette.time - moment).abs() < VOTE_REACH * span)
    }

    /// The voxels with the most votes at every moment, with the share of the votes that they got.
    fn candidates(&self, moments: &[f32]) -> Vec<Vec<(usize, f32)>> {
        let reach = VOTE_REACH * (moments[moments.len() - 1] - moments[0]).max(1e-6);
        moments.par_iter().map(|&moment| self.candidates_at(moment, reach)).collect()
    }

    fn candidates_at(&self, moment: f32, reach: f32) -> Vec<(usize, f32)> {
        let mut scores = vec![0.0_f32; self.centers.len()];
        let mut total = 0.0;
        for (votes, &time) in self.votes.iter().zip(&self.times) {
            let weight = 1.0 - (time - moment).abs() / reach;
            if weight <= 0.0 {
                continue;
            }
            total += weight;
            let worth = [-MISS_WEIGHT * weight, 0.0, weight];
            scores.iter_mut().zip(votes).for_each(|(score, &vote)| *score += worth[(vote + 1) as usize]);
        }
        let mut order: Vec<usize> = (0..scores.len()).collect();
        let better = |a: &usize, b: &usize| scores[*b].total_cmp(&scores[*a]).then(a.cmp(b));
        order.select_nth_unstable_by(CANDIDATES, better);
        order.truncate(CANDIDATES);
        order.into_iter().map(|i| (i, scores[i] / total.max(1e-6))).collect()
    }

    /// The path through one candidate per moment that gets the most votes for the least way (dynamic
    /// programming).
    pub(super) fn path(&self, moments: &[f32]) -> Vec<[f32; 3]> {
        let candidates = self.candidates(moments);
        let unit = STRIDE * self.half_side;
        let way = |a: usize, b: usize| {
            let (a, b) = (self.centers[a], self.centers[b]);
            (0..3).map(|axis| ((a[axis] - b[axis]) / unit).powi(2)).sum::<f32>() * STRIDE_COST
        };
        let mut costs: Vec<f32> = candidates[0].iter().map(|c| -c.1).collect();
        let mut origins: Vec<Vec<usize>> = Vec::new();
        for pair in candidates.windows(2) {
            let best = |&(to, votes): &(usize, f32)| {
                let arrive = |i: usize| costs[i] + way(pair[0][i].0, to);
                let origin = (0..costs.len()).min_by(|&a, &b| arrive(a).total_cmp(&arrive(b))).unwrap_or(0);
                (origin, arrive(origin) - votes)
            };
            let (from, reached): (Vec<usize>, Vec<f32>) = pair[1].par_iter().map(best).unzip();
            origins.push(from);
            costs = reached;
        }
        let mut at = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
        let mut path = vec![self.centers[candidates[moments.len() - 1][at].0]];
        for (from, moment) in origins.iter().zip(&candidates).rev() {
            at = from[at];
            path.push(self.centers[moment[at].0]);
        }
        path.reverse();
        path
    }
}

fn vote(silhouette: &Silhouette, point: [f32; 3]) -> i8 {
    let camera = &silhouette.camera;
    let ([x, y], depth) = camera.pixel_from_world(point);
    if depth <= 0.0 || x < 0.0 || y < 0.0 || x >= camera.width as f32 || y >= camera.height as f32 {
        return 0;
    }
    if silhouette.inside[y as usize * camera.width as usize + x as usize] { 1 } else { -1 }
}
