//! The motion of a trained source model's Gaussians: the one part of the trainer that knows which kind it
//! trains.

use std::sync::Arc;

use burn::tensor::Tensor;
use lgs_core::{GaussianCloud, stream};
use lgs_model::source::freegave::tensor::{AdvectionSpec, carry};
use lgs_model::source::freegave::{Advection, FreeGaveNetworks, Learns};
use lgs_model::source::tensor::{DeformSpec, deform};
use lgs_model::source::{
    DEFORMED_SCALE_FLOOR, DefGs, Deformation, DeformationConfig, FreeGave, FreeGaveConfig, InputFrame,
    ScaleMode, SourceModel,
};
use rand::RngExt;

use super::advection::training_advection;
use super::config::SourceConfig;
use super::config_groups::AdvectionConfig;
use super::moment::Moment;
use crate::cloud_tensors::{CloudTensors, row_indices};
use crate::thresholds::AGREEMENT_STRIDE;

/// Networks that move Gaussians, without their parameters, which the trainer keeps as one flat vector.
pub(super) trait SourceMotion {
    /// Parameters at the start of training.
    fn init(&self, seed: u64) -> Vec<f32>;

    /// Number of parameters.
    fn len(&self) -> usize;

    /// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, as they are drawn
    /// in training.
    fn poses(&self, network: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, at: Moment) -> Tensor<2>;

    /// The cost of the motion beside the photometric loss, for canonical Gaussians that are constants;
    /// nothing where the kind has none.
    fn prior(&self, network: &Tensor<1>, canonical: &Canonical, at: Moment) -> Option<Tensor<1>>;

    /// The effect of pose rows on scales.
    fn scale_mode(&self) -> ScaleMode;

    /// The model of canonical Gaussians and parameters.
    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel>;
}

/// Canonical positions `[n, 3]` and quaternions `[n, 4]`, as constants.
pub(super) struct Canonical {
    pub(super) means: Tensor<2>,
    pub(super) rotations: Tensor<2>,
}

/// Properties of the captured sequence that training a kind of source model needs beside its configuration.
#[derive(Clone, Copy)]
pub(super) struct Captured {
    /// The map of positions before encoding.
    pub(super) frame: InputFrame,
    /// Last time of the training images.
    pub(super) time_window: f32,
    /// Seed of the run.
    pub(super) seed: u64,
}

impl CloudTensors {
    /// The Gaussians in pose rows `[n, DELTAS]`, whose last numbers change scales in a mode.
    pub(super) fn posed(self, poses: Tensor<2>, mode: ScaleMode) -> Self {
        let by_scale = poses.clone().narrow(1, 7, 3);
        let log_scales = match mode {
            ScaleMode::Additive => (self.log_scales.exp() + by_scale).clamp_min(DEFORMED_SCALE_FLOOR).log(),
            ScaleMode::Exponent => self.log_scales + by_scale,
            ScaleMode::Fixed => self.log_scales,
        };
        let (means, rotations) = (poses.clone().narrow(1, 0, 3), poses.narrow(1, 3, 4));
        Self { means, rotations, log_scales, ..self }
    }
}

/// The motion that a configuration asks for.
pub(super) fn source_motion(config: &SourceConfig, captured: Captured) -> Box<dyn SourceMotion> {
    let deformation = config.deformation.clone();
    match (&config.velocity, &config.advection) {
        (Some(velocity), Some(advection)) => {
            let config = Arc::new(FreeGaveConfig { deformation, velocity: velocity.clone() });
            Box::new(Flow { config, advection: advection.clone(), captured })
        }
        _ => Box::new(Displacement { config: deformation, frame: captured.frame }),
    }
}

/// The motion of DefGS: a deformation network.
struct Displacement {
    config: DeformationConfig,
    frame: InputFrame,
}

impl SourceMotion for Displacement {
    fn init(&self, seed: u64) -> Vec<f32> {
        Deformation::init(self.config.clone(), self.frame, seed).params
    }

    fn len(&self) -> usize {
        self.config.layout().len
    }

    fn poses(&self, network: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, at: Moment) -> Tensor<2> {
        deform(
            network,
            means,
            rotations,
            DeformSpec { config: self.config.clone(), frame: self.frame, time: at.time },
        )
    }

    fn prior(&self, _network: &Tensor<1>, _canonical: &Canonical, _at: Moment) -> Option<Tensor<1>> {
        None
    }

    fn scale_mode(&self) -> ScaleMode {
        self.config.scale_mode
    }

    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel> {
        Box::new(DefGs {
            canonical,
            deformation: Deformation { config: self.config.clone(), frame: self.frame, params },
        })
    }
}

/// The motion of FreeGave: a deformation network and a velocity field.
struct Flow {
    config: Arc<FreeGaveConfig>,
    advection: AdvectionConfig,
    captured: Captured,
}

impl Flow {
    fn spec(&self, advection: Advection) -> AdvectionSpec {
        AdvectionSpec { config: Arc::clone(&self.config), frame: self.captured.frame, advection }
    }
}

impl SourceMotion for Flow {
    fn init(&self, seed: u64) -> Vec<f32> {
        FreeGaveNetworks::init((*self.config).clone(), self.captured.frame, seed).params
    }

    fn len(&self) -> usize {
        self.config.layout().len
    }

    fn poses(&self, network: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, at: Moment) -> Tensor<2> {
        let advection = training_advection(&self.config.velocity, &self.advection, at, self.captured.seed);
        carry(network, means, rotations, self.spec(advection))
    }

    /// Disagreement of velocity field and deformation over an advection step at a random time, for every few
    /// Gaussians.
    fn prior(&self, network: &Tensor<1>, canonical: &Canonical, at: Moment) -> Option<Tensor<1>> {
        let AdvectionConfig { length, longest_step, agreement, .. } = self.advection;
        let last = at.window_end.min(self.config.velocity.max_time) - length;
        if agreement <= 0.0 || last <= 0.0 {
            return None;
        }
        let mut random = stream(self.captured.seed, "agreement", at.iteration as u64);
        let from = random.random_range(0.0..last);
        let chosen =
            (random.random_range(0..AGREEMENT_STRIDE)..canonical.means.dims()[0]).step_by(AGREEMENT_STRIDE);
        let chosen = row_indices(chosen, &canonical.means.device());
        let [means, rotations] =
            [&canonical.means, &canonical.rotations].map(|all| all.clone().select(0, chosen.clone()));
        let position = |network: Tensor<1>, advection| {
            carry(network, means.clone(), rotations.clone(), self.spec(advection)).narrow(1, 0, 3)
        };
        let step = if longest_step > 0.0 { longest_step } else { f32::INFINITY };
        let advection =
            Advection { from, to: from + length, longest_step: step, turns: false, learns: Learns::Velocity };
        let carried = position(network.clone(), advection);
        let target = position(
            network.clone(),
            Advection { learns: Learns::Velocity, ..Advection::none(from + length) },
        )
        .detach();
        let velocity = (carried - target) / length;
        Some(velocity.square().sum_dim(1).mean() * agreement)
    }

    fn scale_mode(&self) -> ScaleMode {
        self.config.deformation.scale_mode
    }

    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel> {
        let networks =
            FreeGaveNetworks { config: (*self.config).clone(), frame: self.captured.frame, params };
        Box::new(FreeGave::new(canonical, networks, self.captured.time_window))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adam::{AdamGroup, values};
    use crate::cloud_tensors::rows;
    use crate::device::DeviceName;
    use lgs_model::source::{HeadInit, VelocityConfig};

    #[test]
    fn agreement_leads_the_velocity_field_to_the_deformation_and_not_the_reverse() {
        let deformation =
            DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::freegave_quick() };
        let config = Arc::new(FreeGaveConfig { deformation, velocity: VelocityConfig::quick() });
        let captured = Captured { frame: InputFrame::IDENTITY, time_window: 0.75, seed: 1 };
        let flow = Flow { config: Arc::clone(&config), advection: AdvectionConfig::quick(), captured };
        let wave = |i: usize, f: f32| (i as f32 * f).sin();
        let means: Vec<[f32; 3]> =
            (0..120).map(|i| [wave(i, 0.37), wave(i + 9, 0.11), wave(i, 0.23)]).collect();
        let rotations = vec![[1.0, 0.0, 0.0, 0.0]; means.len()];
        let device = DeviceName::Cpu.device();
        let canonical = Canonical { means: rows(&means, &device), rotations: rows(&rotations, &device) };
        let params = flow.init(7);
        let mut network = AdamGroup::new(params.clone(), [params.len()], &device);
        let at = |iteration| Moment { time: 0.3, iteration, window_end: 0.75 };
        assert!(
            flow.prior(&network.leaf(), &canonical, Moment { window_end: 0.05, ..at(0) }).is_none(),
            "no room for an advection step"
        );
        let (mut first, mut last) = (0.0, 0.0);
        for iteration in 0..200 {
            let leaf = network.leaf();
            let loss = flow.prior(&leaf, &canonical, at(iteration)).expect("a weight");
            let value = values(&loss)[0];
            if iteration < 20 {
                first += value;
            } else if iteration >= 180 {
                last += value;
            }
            let mut gradients = loss.backward();
            network.step(3e-3, leaf.grad_remove(&mut gradients));
        }
        assert!(last < 0.5 * first, "{first} {last}");
        let own = config.deformation.layout().len;
        assert_eq!(network.values()[..own], params[..own], "the deformation is a constant");
    }
}
