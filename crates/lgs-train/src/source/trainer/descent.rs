//! The last part of an iteration: a step of the Gaussians, and what the schedule asks of their number.

use std::ops::RangeInclusive;

use burn::tensor::{Gradients, Tensor};

use super::SourceTrainer;
use crate::adam::AdamSteps;
use crate::cloud_tensors::host_rows;
use crate::source::density::Replaced;
use crate::source::proposals::ProposalRound;
use crate::source::snapshot::Snapshot;
use crate::trainable_cloud::{CloudGradients, CloudLeaves, NewGaussians};

impl SourceTrainer<'_> {
    /// Gaussians for what the model lacks, where an iteration asks for them.
    fn proposed(&self, iteration: usize) -> NewGaussians {
        let count = self.config.densify.proposals;
        if count == 0 || !self.density.is_due(iteration) {
            return NewGaussians::default();
        }
        let last_time = self.order.last_time(iteration, &self.config);
        let (sh_degree, cameras) = (self.config.sh_degree, self.cameras.refined());
        let round = ProposalRound { iteration, last_time, count, sh_degree, cameras: cameras.as_ref() };
        let is_deformed = !self.config.is_warmup(iteration);
        let snapshot = Snapshot { motion: &*self.motion, learned: self.drawn(), is_deformed };
        let cloud = self.proposals.find(round, &snapshot);
        NewGaussians { features: self.motion.fresh_features(&cloud), cloud }
    }

    /// Takes a step along the gradients, after what the passed iterations of the schedule ask of the density.
    pub(super) fn descend(
        &mut self,
        (leaves, network): (&CloudLeaves, &Tensor<1>),
        gradients: &mut Gradients,
        passed: RangeInclusive<usize>,
    ) {
        let mut replaced = Replaced::Nothing;
        for iteration in passed {
            let proposed = self.proposed(iteration);
            replaced = replaced.max(self.density.adapt(&mut self.cloud, iteration, &proposed));
        }
        let iteration = self.clock.iteration();
        let mut by_attribute = leaves.gradients(gradients);
        match replaced {
            Replaced::Nothing => {}
            Replaced::Opacities => by_attribute.raw_opacities = None,
            Replaced::Gaussians => {
                by_attribute = CloudGradients::default();
                self.priors.forget_neighbors();
                self.smoothing.renew(|| host_rows(&self.cloud.means.value()));
                self.motion.forget_gaussians();
            }
        }
        if let Some(gradients) = by_attribute.means.as_ref().filter(|_| self.motion.observes()) {
            self.motion.observe(gradients);
        }
        let rates = self.config.cloud_rates(iteration);
        let mut steps = AdamSteps::default();
        self.cloud.add_steps(by_attribute, &rates, &mut steps);
        steps.add(&mut self.network, self.config.deformation_rate(iteration), network.grad_remove(gradients));
        steps.take();
        self.density.disturb(&mut self.cloud, self.clock.taken(), rates.means);
    }

    /// After its trial brightness begins anew if it is that of light, and is given up if not.
    pub(super) fn judge_brightness(&mut self, passed: &RangeInclusive<usize>) {
        let Some(shading) = self.shading.as_ref().filter(|shading| shading.is_judged_in(passed)) else {
            return;
        };
        if shading.is_smooth(&self.cloud.shading()) {
            self.cloud.restart_shading();
        } else {
            self.shading = None;
            self.cloud.forget_shading();
        }
    }
}
