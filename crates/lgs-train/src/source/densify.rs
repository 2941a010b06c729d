//! Adaptive density (method §3.4) as data: statistics of gradients, and the plan that they and the Gaussians'
//! attributes ask for.
//!
//! A plan is pure data. Applying it gives this order: kept Gaussians, clones, first children of the split
//! ones, second children; the pruning that the authors do last is worked out beforehand, since clones and
//! children inherit the attributes it looks at.

use lgs_core::linear::{mat_vec, matrix_from_quat, quat_normalize};
use rand::RngExt;

use super::config_groups::DensifyConfig;
use crate::thresholds::{FEWEST_GAUSSIANS, SPLIT_SHRINK};

/// Sums since the last densification.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DensifyStatistics {
    /// Sum of NDC gradient norms, per Gaussian.
    pub(super) gradient_sum: Vec<f32>,
    /// Images in which it was visible.
    pub(super) count: Vec<f32>,
}

impl DensifyStatistics {
    /// Nothing seen yet of `n` Gaussians.
    pub(super) fn new(n: usize) -> Self {
        Self { gradient_sum: vec![0.0; n], count: vec![0.0; n] }
    }

    /// Adds one image of a width and a height: gradients by the projected centres in pixels, `[n, 2]`, which
    /// are turned into NDC by half the image size.
    pub(super) fn observe(&mut self, v_means2d: &[[f32; 2]], visible: &[bool], size: [u32; 2]) {
        let half = size.map(|pixels| 0.5 * pixels as f32);
        for (i, (v, &visible)) in v_means2d.iter().zip(visible).enumerate() {
            if visible {
                self.gradient_sum[i] += (v[0] * half[0]).hypot(v[1] * half[1]);
                self.count[i] += 1.0;
            }
        }
    }

    fn mean(&self, index: usize) -> f32 {
        if self.count[index] > 0.0 { self.gradient_sum[index] / self.count[index] } else { 0.0 }
    }
}

/// What a Gaussian is judged by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attributes<'a> {
    /// Largest standard deviation of each, world units.
    pub(super) max_scales: &'a [f32],
    /// Opacities in (0, 1).
    pub(super) opacities: &'a [f32],
    /// Extent of the scene (method §1), world units.
    pub(super) extent: f32,
    /// Which lie too far out to be kept.
    pub(super) outside: &'a [bool],
}

/// Which Gaussians stay as they are, and which are the parents of new ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DensifyPlan {
    /// Kept.
    pub(super) keep: Vec<usize>,
    /// Parents of exact copies.
    pub(super) clone: Vec<usize>,
    /// Parents of two children each.
    pub(super) split: Vec<usize>,
}

impl DensifyPlan {
    /// Decides for all Gaussians after an iteration.
    pub(super) fn new(
        config: &DensifyConfig,
        statistics: &DensifyStatistics,
        attributes: Attributes<'_>,
        iteration: usize,
    ) -> Self {
        let n = attributes.opacities.len();
        let large = config.prune_extent * attributes.extent;
        let survives = |i: usize, shrink: f32| {
            let too_large = iteration > config.prune_large_after && attributes.max_scales[i] / shrink > large;
            attributes.opacities[i] >= config.min_opacity && !too_large && !attributes.outside[i]
        };
        let mut chosen: Vec<usize> =
            (0..n).filter(|&i| statistics.mean(i) >= config.gradient_threshold).collect();
        if config.max_gaussians > 0 {
            chosen.sort_by(|&a, &b| statistics.mean(b).total_cmp(&statistics.mean(a)).then(a.cmp(&b)));
            chosen.truncate(config.max_gaussians.saturating_sub(n));
            chosen.sort_unstable();
        }
        let splits = |i: usize| attributes.max_scales[i] > config.clone_extent * attributes.extent;
        let (split, clone): (Vec<usize>, Vec<usize>) = chosen.into_iter().partition(|&i| splits(i));
        let mut keep: Vec<usize> =
            (0..n).filter(|&i| survives(i, 1.0) && split.binary_search(&i).is_err()).collect();
        let clone: Vec<usize> = clone.into_iter().filter(|&i| survives(i, 1.0)).collect();
        let split: Vec<usize> = split.into_iter().filter(|&i| survives(i, SPLIT_SHRINK)).collect();
        if keep.len() + clone.len() + 2 * split.len() < FEWEST_GAUSSIANS.min(n) {
            keep = most_opaque(attributes.opacities, FEWEST_GAUSSIANS.min(n));
        }
        Self { keep, clone, split }
    }

    /// Parents of the appended rows, in order: clones, first children, second children.
    pub(super) fn parents(&self) -> impl Iterator<Item = usize> {
        self.clone.iter().chain(&self.split).chain(&self.split).copied()
    }
}

fn most_opaque(opacities: &[f32], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..opacities.len()).collect();
    order.sort_by(|&a, &b| opacities[b].total_cmp(&opacities[a]).then(a.cmp(&b)));
    order.truncate(count);
    order.sort_unstable();
    order
}

/// Means and log scales of the appended Gaussians from the rows of their parents, the cloned before the split
/// ones: clones as their parents, children drawn from their parent's Gaussian.
pub(super) fn new_shapes(
    plan: &DensifyPlan,
    means: &[[f32; 3]],
    rotations: &[[f32; 4]],
    log_scales: &[[f32; 3]],
    random: &mut lgs_core::Stream,
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let clones = plan.clone.len();
    let (mut new_means, mut new_scales) = (means[..clones].to_vec(), log_scales[..clones].to_vec());
    for _ in 0..2 {
        for i in clones..means.len() {
            let draw: [f32; 3] =
                std::array::from_fn(|axis| standard_normal(random) * log_scales[i][axis].exp());
            let offset = mat_vec(&matrix_from_quat(quat_normalize(rotations[i])), draw);
            new_means.push(std::array::from_fn(|axis| means[i][axis] + offset[axis]));
            new_scales.push(log_scales[i].map(|s| s - SPLIT_SHRINK.ln()));
        }
    }
    (new_means, new_scales)
}

/// A draw of N(0, 1) by the Box–Muller transform.
fn standard_normal(random: &mut lgs_core::Stream) -> f32 {
    let (u, v): (f32, f32) = (1.0 - random.random::<f32>(), random.random());
    (-2.0 * u.ln()).sqrt() * (std::f32::consts::TAU * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statistics(means: &[f32]) -> DensifyStatistics {
        DensifyStatistics {
            gradient_sum: means.iter().map(|m| 2.0 * m).collect(),
            count: vec![2.0; means.len()],
        }
    }

    #[test]
    fn the_statistic_is_the_mean_ndc_gradient_over_images_that_show_the_gaussian() {
        let mut statistics = DensifyStatistics::new(2);
        statistics.observe(&[[0.01, 0.0], [5.0, 5.0]], &[true, false], [200, 100]);
        statistics.observe(&[[0.0, 0.04], [5.0, 5.0]], &[true, false], [200, 100]);
        assert!((statistics.mean(0) - 1.5).abs() < 1e-6);
        assert_eq!(statistics.mean(1), 0.0);
    }

    #[test]
    fn small_ones_are_cloned_large_ones_split_and_faint_ones_removed() {
        let config = DensifyConfig::paper();
        let many = 20;
        let (mut scales, mut opacities) = (vec![0.02; many], vec![0.5; many]);
        scales[1] = 0.1;
        opacities[3] = 0.001;
        scales[4] = 0.9;
        let mut gradients = vec![0.0; many];
        gradients[..4].copy_from_slice(&[3e-4; 4]);
        let statistics = statistics(&gradients);
        let attributes =
            Attributes { max_scales: &scales, opacities: &opacities, extent: 4.0, outside: &[false; 20] };
        let early = DensifyPlan::new(&config, &statistics, attributes, 600);
        assert_eq!((early.clone.as_slice(), early.split.as_slice()), ([0, 2].as_slice(), [1].as_slice()));
        assert!(!early.keep.contains(&1) && !early.keep.contains(&3) && early.keep.contains(&4));
        assert_eq!(early.parents().collect::<Vec<_>>(), [0, 2, 1, 1]);
        let late = DensifyPlan::new(&config, &statistics, attributes, 3100);
        assert!(!late.keep.contains(&4), "0.9 is above a tenth of the extent");
    }

    #[test]
    fn pruning_never_empties_a_scene() {
        let opacities: Vec<f32> = (0..20).map(|i| 1e-5 * i as f32).collect();
        let attributes =
            Attributes { max_scales: &[0.01; 20], opacities: &opacities, extent: 4.0, outside: &[false; 20] };
        let plan = DensifyPlan::new(&DensifyConfig::paper(), &DensifyStatistics::new(20), attributes, 600);
        assert_eq!(plan.keep, (4..20).collect::<Vec<_>>());
    }

    #[test]
    fn a_limit_takes_the_largest_gradients() {
        let config = DensifyConfig { max_gaussians: 22, ..DensifyConfig::paper() };
        let gradients: Vec<f32> = (0..20).map(|i| 1e-3 * (i as f32 + 1.0)).collect();
        let attributes =
            Attributes { max_scales: &[0.01; 20], opacities: &[0.5; 20], extent: 4.0, outside: &[false; 20] };
        let plan = DensifyPlan::new(&config, &statistics(&gradients), attributes, 600);
        assert_eq!(plan.clone, [18, 19]);
        assert_eq!(plan.keep.len(), 20);
    }

    #[test]
    fn children_are_smaller_and_scattered_about_their_parent() {
        let plan = DensifyPlan { keep: vec![], clone: vec![0], split: vec![1; 500] };
        let mut means = vec![[2.0, 0.0, 0.0]; 501];
        let mut rotations = vec![[0.5_f32.sqrt(), 0.0, 0.0, 0.5_f32.sqrt()]; 501];
        let mut log_scales = vec![[1.0_f32.ln(), 0.1_f32.ln(), 0.01_f32.ln()]; 501];
        (means[0], rotations[0], log_scales[0]) = ([1.0; 3], [1.0, 0.0, 0.0, 0.0], [-1.0; 3]);
        let (m, s) = new_shapes(&plan, &means, &rotations, &log_scales, &mut lgs_core::stream(1, "split", 0));
        assert_eq!((m[0], s[0], m.len()), ([1.0; 3], [-1.0; 3], 1001));
        assert!((s[1][0] - (1.0_f32 / 1.6).ln()).abs() < 1e-6);
        let spread = |axis: usize| {
            let mean = means[1][axis];
            (m[1..].iter().map(|p| (p[axis] - mean).powi(2)).sum::<f32>() / 1000.0).sqrt()
        };
        // A quarter turn about z takes the long axis from x to y.
        assert!(
            (spread(0) - 0.1).abs() < 0.01
                && (spread(1) - 1.0).abs() < 0.1
                && (spread(2) - 0.01).abs() < 0.001
        );
    }
}
