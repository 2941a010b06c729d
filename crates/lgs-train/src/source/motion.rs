//! What moves the Gaussians of a trained source model: the one part of the trainer that knows which kind it trains.

use std::sync::Arc;

use burn::tensor::{Tensor, TensorData};
use lgs_core::{GaussianCloud, stream};
use lgs_model::source::freegave::tensor::{HopSpec, carry};
use lgs_model::source::freegave::{FreeGaveNetworks, Hop, Learns};
use lgs_model::source::tensor::{DeformSpec, deform};
use lgs_model::source::{
    DefGs, Deformation, DeformationConfig, FreeGave, FreeGaveConfig, InputFrame, ScaleMode, SourceModel, VelocityConfig,
};
use rand::RngExt;

use super::config::{HopConfig, SourceConfig};
use super::params::HostShapes;

/// A frame's time, and when in training it is seen.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    pub(super) time: f32,
    pub(super) iteration: usize,
    /// Last time that training has come to.
    pub(super) window_end: f32,
}

/// Networks that move Gaussians, without their parameters, which the trainer keeps as one flat vector.
pub(super) trait SourceMotion {
    /// Fresh parameters.
    fn init(&self, seed: u64) -> Vec<f32>;

    /// Number of parameters.
    fn len(&self) -> usize;

    /// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, as they are drawn in training.
    fn poses(&self, network: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, at: Moment) -> Tensor<2>;

    /// What the motion is to cost beside what images say of it, for canonical Gaussians that are constants.
    fn prior(&self, network: &Tensor<1>, canonical: &HostShapes, at: Moment) -> Option<Tensor<1>>;

    /// What pose rows do to scales.
    fn scale_mode(&self) -> ScaleMode;

    /// The model of canonical Gaussians and parameters.
    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel>;
}

/// What training a kind of source model needs beside its configuration.
#[derive(Clone, Copy)]
pub(super) struct Captured {
    /// The map of positions before encoding.
    pub(super) frame: InputFrame,
    /// Last time of the training images.
    pub(super) time_window: f32,
    /// Seed of the run.
    pub(super) seed: u64,
}

/// The motion that a configuration asks for.
pub(super) fn source_motion(config: &SourceConfig, captured: Captured) -> Box<dyn SourceMotion> {
    let deformation = config.deformation.clone();
    match (&config.velocity, &config.hop) {
        (Some(velocity), Some(hop)) => {
            let config = Arc::new(FreeGaveConfig { deformation, velocity: velocity.clone() });
            Box::new(Flow { config, hop: hop.clone(), captured })
        }
        _ => Box::new(Displacement { config: deformation, frame: captured.frame }),
    }
}

/// DefGS.
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
        deform(network, means, rotations, DeformSpec { config: self.config.clone(), frame: self.frame, time: at.time })
    }

    fn prior(&self, _network: &Tensor<1>, _canonical: &HostShapes, _at: Moment) -> Option<Tensor<1>> {
        None
    }

    fn scale_mode(&self) -> ScaleMode {
        self.config.scale_mode
    }

    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel> {
        Box::new(DefGs { canonical, deformation: Deformation { config: self.config.clone(), frame: self.frame, params } })
    }
}

/// One in so many Gaussians is asked whether velocity field and deformation agree.
const EVERY: usize = 4;

/// FreeGave.
struct Flow {
    config: Arc<FreeGaveConfig>,
    hop: HopConfig,
    captured: Captured,
}

impl Flow {
    fn spec(&self, hop: Hop) -> HopSpec {
        HopSpec { config: Arc::clone(&self.config), frame: self.captured.frame, hop }
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
        let hop = training_hop(&self.config.velocity, &self.hop, at, self.captured.seed);
        carry(network, means, rotations, self.spec(hop))
    }

    /// Disagreement of velocity field and deformation over a hop at a random time, for every few Gaussians.
    fn prior(&self, network: &Tensor<1>, canonical: &HostShapes, at: Moment) -> Option<Tensor<1>> {
        let HopConfig { length, longest_step, agreement, .. } = self.hop;
        let last = at.window_end.min(self.config.velocity.max_time) - length;
        if agreement <= 0.0 || last <= 0.0 {
            return None;
        }
        let mut random = stream(self.captured.seed, "agreement", at.iteration as u64);
        let from = random.random_range(0.0..last);
        let chosen: Vec<usize> = (random.random_range(0..EVERY)..canonical.means.len()).step_by(EVERY).collect();
        let means: Vec<[f32; 3]> = chosen.iter().map(|&i| canonical.means[i]).collect();
        let rotations: Vec<[f32; 4]> = chosen.iter().map(|&i| canonical.rotations[i]).collect();
        let device = network.device();
        let rows = |values: &[f32], width| Tensor::<2>::from_data(TensorData::new(values.to_vec(), [chosen.len(), width]), &device);
        let (means, rotations) = (rows(means.as_flattened(), 3), rows(rotations.as_flattened(), 4));
        let position = |network: Tensor<1>, hop| carry(network, means.clone(), rotations.clone(), self.spec(hop)).narrow(1, 0, 3);
        let step = if longest_step > 0.0 { longest_step } else { f32::INFINITY };
        let hop = Hop { from, to: from + length, longest_step: step, turns: false, learns: Learns::Velocity };
        let carried = position(network.clone(), hop);
        let target = position(network.clone(), Hop { learns: Learns::Velocity, ..Hop::none(from + length) }).detach();
        let velocity = (carried - target) / length;
        Some(velocity.square().sum_dim(1).mean() * agreement)
    }

    fn scale_mode(&self) -> ScaleMode {
        self.config.deformation.scale_mode
    }

    fn model(&self, canonical: GaussianCloud, params: Vec<f32>) -> Box<dyn SourceModel> {
        let networks = FreeGaveNetworks { config: (*self.config).clone(), frame: self.captured.frame, params };
        Box::new(FreeGave::new(canonical, networks, self.captured.time_window))
    }
}

/// The training step (§4.3): from a hop before or after the frame's time, or from T* for what lies beyond it.
fn training_hop(velocity: &VelocityConfig, config: &HopConfig, at: Moment, seed: u64) -> Hop {
    let longest_step = if config.longest_step > 0.0 { config.longest_step } else { f32::INFINITY };
    let hop = |from| Hop { from, to: at.time, longest_step, turns: config.turns, learns: Learns::All };
    if at.time > velocity.max_time {
        return hop(velocity.max_time);
    }
    let mut random = stream(seed, "hop", at.iteration as u64);
    let (back, made) = (random.random::<bool>(), random.random::<f32>() < config.share);
    if at.time < config.length || !made {
        return Hop::none(at.time);
    }
    let length = if back { -config.length } else { config.length };
    hop((at.time - length).clamp(0.0, velocity.max_time))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hops(config: &HopConfig, time: f32) -> Vec<Hop> {
        let velocity = VelocityConfig { max_time: 0.7, ..VelocityConfig::paper() };
        (0..50).map(|iteration| training_hop(&velocity, config, Moment { time, iteration, window_end: 0.75 }, 3)).collect()
    }

    #[test]
    fn hops_go_both_ways_inside_the_deformations_time_and_one_way_beyond() {
        let paper = HopConfig::paper();
        let h = paper.length;
        let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
        let inside = hops(&paper, 0.3);
        assert!(inside.iter().all(|hop| near(hop.from, 0.3 - h) || near(hop.from, 0.3 + h)));
        assert!(inside.iter().any(|hop| hop.from < 0.3) && inside.iter().any(|hop| hop.from > 0.3));
        assert!(hops(&paper, 0.7).iter().all(|hop| near(hop.from, 0.7) || near(hop.from, 0.7 - h)), "clipped at T*");
        assert!(hops(&paper, 0.74).iter().all(|hop| hop.from == 0.7 && hop.to == 0.74 && hop.longest_step.is_infinite()));
        assert!(hops(&paper, 0.5 * h).iter().all(|hop| *hop == Hop::none(0.5 * h)));
        let some = HopConfig { share: 0.5, ..paper };
        let still = hops(&some, 0.3).iter().filter(|hop| hop.from == hop.to).count();
        assert!((10..40).contains(&still), "{still}");
    }
}
