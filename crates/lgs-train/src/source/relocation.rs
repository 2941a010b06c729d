//! Densification with a fixed budget (method §3.4): dead Gaussians and new ones become copies of live ones,
//! drawn by opacity, and a Gaussian shares its opacity and size with its copies so that the image stays as it
//! was (Kheradmand et al. 2024, Eq. 9).

use lgs_core::Stream;
use rand::RngExt;

use super::config_groups::DensifyConfig;
use crate::thresholds::OPACITY_MARGIN;

/// Which Gaussians stay as they are, and which are drawn from: every other one gives its place away.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Relocation {
    /// Live Gaussians that nothing was drawn from.
    pub(super) keep: Vec<usize>,
    /// Live Gaussians that were drawn, and how many there are of each from now on, at least two.
    pub(super) families: Vec<(usize, usize)>,
}

impl Relocation {
    /// Draws as many copies as there are dead Gaussians and as the budget allows to add; nothing changes
    /// where no Gaussian lives.
    pub(super) fn new(
        config: &DensifyConfig,
        opacities: &[f32],
        outside: &[bool],
        random: &mut Stream,
    ) -> Self {
        let n = opacities.len();
        let live: Vec<usize> = (0..n).filter(|&i| opacities[i] > config.min_opacity && !outside[i]).collect();
        if live.is_empty() {
            return Self { keep: (0..n).collect(), families: Vec::new() };
        }
        let grown = n + (config.mcmc.growth * n as f32).ceil() as usize;
        let copies = grown.min(config.max_gaussians.max(n)) - live.len();
        let sums: Vec<f64> = live
            .iter()
            .scan(0.0, |sum, &i| {
                *sum += f64::from(opacities[i]);
                Some(*sum)
            })
            .collect();
        let whole = sums[sums.len() - 1];
        let mut size = vec![1; live.len()];
        for _ in 0..copies {
            let at = random.random_range(0.0..whole);
            size[sums.partition_point(|&sum| sum <= at).min(live.len() - 1)] += 1;
        }
        let (alone, drawn): (Vec<_>, Vec<_>) = live.into_iter().zip(size).partition(|&(_, size)| size == 1);
        Self { keep: alone.into_iter().map(|(i, _)| i).collect(), families: drawn }
    }

    /// The Gaussians that every row comes from: kept ones first, then the families.
    pub(super) fn order(&self) -> Vec<usize> {
        let families = self.families.iter().flat_map(|&(parent, size)| std::iter::repeat_n(parent, size));
        self.keep.iter().copied().chain(families).collect()
    }
}

/// Opacity of each of `copies` Gaussians in one place that together are as opaque as one, and the factor of
/// its standard deviations, by which the line integrals of the densities agree.
///
/// With `o' = 1 − (1 − o)^(1/N)` the factor is `o / Σ_{j=1}^{N} C(N, j) (−1)^{j−1} o'^j / √j`, which is Eq. 9
/// of Kheradmand et al. (2024) with its inner sum carried out.
pub(super) fn shared(opacity: f64, copies: usize) -> (f64, f64) {
    let n = copies as f64;
    let each = -((-opacity).ln_1p() / n).exp_m1();
    let (mut sum, mut term) = (0.0, -1.0);
    for j in 1..=copies {
        let j = j as f64;
        term *= -each * (n - j + 1.0) / j;
        sum += term / j.sqrt();
    }
    (each, opacity / sum)
}

/// Raw opacity and log scales of each of `copies` Gaussians from those of the one they share; never fainter
/// than `least`, so that a copy does not die of being one.
pub(super) fn share(raw_opacity: f32, log_scales: [f32; 3], copies: usize, least: f32) -> (f32, [f32; 3]) {
    let opacity = 1.0 / (1.0 + (-f64::from(raw_opacity)).exp());
    let (each, factor) = shared(opacity.min(1.0 - f64::from(OPACITY_MARGIN)), copies);
    let each = each.max(f64::from(least + OPACITY_MARGIN));
    ((each / (1.0 - each)).ln() as f32, log_scales.map(|s| s + factor.ln() as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::config_groups::DensifyMethod;

    fn config(max_gaussians: usize) -> DensifyConfig {
        DensifyConfig { method: DensifyMethod::Mcmc, max_gaussians, ..DensifyConfig::paper() }
    }

    #[test]
    fn dead_ones_move_onto_live_ones_by_opacity_and_the_number_grows_to_the_budget() {
        let mut opacities = vec![0.001; 1000];
        (opacities[7], opacities[400], opacities[900]) = (0.2, 0.8, 0.9);
        let mut outside = vec![false; 1000];
        outside[900] = true;
        let draw = |budget| {
            Relocation::new(&config(budget), &opacities, &outside, &mut lgs_core::stream(1, "relocation", 3))
        };
        let plan = draw(1010);
        let [(7, few), (400, many)] = plan.families[..] else { panic!("{plan:?}") };
        assert_eq!((few + many, plan.order().len()), (1010, 1010));
        assert!((f64::from(many as u32) / 1010.0 - 0.8).abs() < 0.05, "{many}");
        assert_eq!(draw(5000).order().len(), 1050, "a twentieth more");
        assert_eq!(draw(3).order().len(), 1000, "nothing is taken away");
        assert_eq!(plan, draw(1010), "the draws are those of the stream");
    }

    #[test]
    fn a_scene_without_live_gaussians_is_left_alone() {
        let plan =
            Relocation::new(&config(9), &[0.0; 4], &[false; 4], &mut lgs_core::stream(1, "relocation", 3));
        assert_eq!((plan.order(), plan.families.len()), (vec![0, 1, 2, 3], 0));
    }

    #[test]
    fn copies_together_are_as_opaque_and_as_wide_as_the_one_they_share() {
        for (opacity, copies) in [(0.3, 2), (0.9, 3), (0.999_99, 51), (0.5, 400)] {
            let (each, factor) = shared(opacity, copies);
            assert!((1.0 - (1.0 - each).powi(copies as i32) - opacity).abs() < 1e-9);
            // The integral over a line of what the copies cover, against that of the one.
            let covered = |each: f64, width: f64, copies: i32| -> f64 {
                let step = 1e-3;
                let alpha = |x: f64| each * (-0.5 * (x / width).powi(2)).exp();
                (-9000..=9000).map(|i| (1.0 - (1.0 - alpha(step * f64::from(i))).powi(copies)) * step).sum()
            };
            let (one, all) = (covered(opacity, 1.0, 1), covered(each, factor, copies as i32));
            assert!((one - all).abs() < 1e-4 * one, "{opacity} {copies}: {one} {all}");
        }
    }
}
