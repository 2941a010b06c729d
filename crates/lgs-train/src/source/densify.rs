//! Adaptive density (method §3.4) as data: the plan that the Gaussians' attributes ask for.
//!
//! A plan is pure data. Applying it gives this order: kept Gaussians, clones, first children of the split
//! ones, second children; the pruning that the authors do last is worked out beforehand, since clones and
//! children inherit the attributes it looks at.

use lgs_core::linear::{mat_vec, matrix_from_quat, quat_normalize};
use rand_distr::{Distribution, StandardNormal};

use super::config_groups::DensifyConfig;
use crate::thresholds::{FEWEST_GAUSSIANS, SPLIT_SHRINK};

/// Properties of Gaussians that decide what becomes of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attributes<'a> {
    /// Mean norms of the gradients by the projected centres, NDC.
    pub(super) gradients: &'a [f32],
    /// Largest standard deviation of each, world units.
    pub(super) max_scales: &'a [f32],
    /// Opacities in (0, 1).
    pub(super) opacities: &'a [f32],
    /// Extent of the scene (method §1), world units.
    pub(super) extent: f32,
    /// Gaussians that lie too far out to be kept.
    pub(super) outside: &'a [bool],
}

/// Which Gaussians stay as they are, and which are the parents of new ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DensifyPlan {
    /// Gaussians that stay as they are.
    pub(super) keep: Vec<usize>,
    /// Parents of exact copies.
    pub(super) clone: Vec<usize>,
    /// Parents of two children each.
    pub(super) split: Vec<usize>,
}

impl DensifyPlan {
    /// Decides for all Gaussians after an iteration.
    pub(super) fn new(config: &DensifyConfig, attributes: Attributes<'_>, iteration: usize) -> Self {
        let (n, gradients) = (attributes.opacities.len(), attributes.gradients);
        let large = config.prune_extent * attributes.extent;
        let survives = |i: usize, shrink: f32| {
            let too_large = large > 0.0
                && iteration > config.prune_large_after
                && attributes.max_scales[i] / shrink > large;
            attributes.opacities[i] >= config.min_opacity && !too_large && !attributes.outside[i]
        };
        let mut chosen: Vec<usize> = (0..n).filter(|&i| gradients[i] >= config.gradient_threshold).collect();
        if config.max_gaussians > 0 {
            chosen.sort_by(|&a, &b| gradients[b].total_cmp(&gradients[a]).then(a.cmp(&b)));
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

/// The most opaque of some Gaussians, in the order of their numbers.
pub(super) fn most_opaque(opacities: &[f32], count: usize) -> Vec<usize> {
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
                log_scales[i].map(|s| s.exp() * Distribution::<f32>::sample(&StandardNormal, random));
            let offset = mat_vec(&matrix_from_quat(quat_normalize(rotations[i])), draw);
            new_means.push(std::array::from_fn(|axis| means[i][axis] + offset[axis]));
            new_scales.push(log_scales[i].map(|s| s - SPLIT_SHRINK.ln()));
        }
    }
    (new_means, new_scales)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Attributes of twenty Gaussians of an opacity.
    fn twenty<'a>(gradients: &'a [f32], opacities: &'a [f32]) -> Attributes<'a> {
        let (max_scales, outside) = (&[0.01; 20], &[false; 20]);
        Attributes { gradients, max_scales, opacities, extent: 4.0, outside }
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
        let attributes = Attributes { max_scales: &scales, ..twenty(&gradients, &opacities) };
        let early = DensifyPlan::new(&config, attributes, 600);
        assert_eq!((early.clone.as_slice(), early.split.as_slice()), ([0, 2].as_slice(), [1].as_slice()));
        assert!(!early.keep.contains(&1) && !early.keep.contains(&3) && early.keep.contains(&4));
        assert_eq!(early.parents().collect::<Vec<_>>(), [0, 2, 1, 1]);
        let late = DensifyPlan::new(&config, attributes, 3100);
        assert!(!late.keep.contains(&4), "0.9 is above a tenth of the extent");
    }

    #[test]
    fn pruning_never_empties_a_scene() {
        let opacities: Vec<f32> = (0..20).map(|i| 1e-5 * i as f32).collect();
        let plan = DensifyPlan::new(&DensifyConfig::paper(), twenty(&[0.0; 20], &opacities), 600);
        assert_eq!(plan.keep, (4..20).collect::<Vec<_>>());
    }

    #[test]
    fn a_limit_takes_the_largest_gradients() {
        let config = DensifyConfig { max_gaussians: 22, ..DensifyConfig::paper() };
        let gradients: Vec<f32> = (0..20).map(|i| 1e-3 * (i as f32 + 1.0)).collect();
        let plan = DensifyPlan::new(&config, twenty(&gradients, &[0.5; 20]), 600);
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
